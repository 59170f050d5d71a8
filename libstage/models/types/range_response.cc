// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/range_response.hh"

#include <algorithm>
#include <cmath>
#include <string>

#include "models/noise.hh"
#include "models/property_checks.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {
constexpr size_t kMaxPoints = 1000;
}  // namespace

void RangeResponse::Load(Worldfile* wf, int entity) {
  const size_t numbers = wf->TupleLength(entity, "response");
  if (wf->PropertyExists(entity, "response")) {
    if (numbers < 4 || numbers % 2 != 0 || numbers > 2 * kMaxPoints)
      wf->Fail(entity, "response",
               "found " + std::to_string(numbers) +
                   " numbers, expected 2 to 1000 pairs of a distance and a value");
    points_.resize(numbers / 2);
    for (size_t i = 0; i < points_.size(); i++)
      wf->ReadTuple(entity, "response", static_cast<unsigned>(2 * i), 2, "lf", &points_[i].range,
                    &points_[i].value);
    const auto descends = [](const Point& a, const Point& b) { return a.range >= b.range; };
    if (points_[0].range < 0 ||
        std::adjacent_find(points_.begin(), points_.end(), descends) != points_.end())
      wf->Fail(entity, "response",
               "found distances that do not ascend from 0 or more, expected each above the last");
  }
  wf->ReadTuple(entity, "response_noise", 0, 2, "ff", &noise_, &relative_noise_);
  CheckNotNegative(*wf, entity, "response_noise", std::min(noise_, relative_noise_));
}

double RangeResponse::At(double range) const {
  const auto after = std::upper_bound(points_.begin(), points_.end(), range,
                                      [](double r, const Point& p) { return r < p.range; });
  if (after == points_.begin()) return points_.front().value;
  const Point& before = after[-1];
  if (after == points_.end()) return before.value;
  const double part = (range - before.range) / (after->range - before.range);
  return before.value + part * (after->value - before.value);
}

void RangeResponse::Fill(const std::vector<double>& ranges, RandomStream* random,
                         std::vector<double>* values) const {
  const bool signless = std::all_of(points_.begin(), points_.end(),
                                    [](const Point& point) { return point.value >= 0; });
  values->resize(ranges.size());
  for (size_t i = 0; i < ranges.size(); i++) {
    double value = At(ranges[i]);
    if (IsNoisy()) {
      const double relative = relative_noise_ * value;
      value += std::sqrt(noise_ * noise_ + relative * relative) * NormalError(random);
    }
    (*values)[i] = signless ? std::max(value, 0.0) : value;
  }
}

}  // namespace Stg
