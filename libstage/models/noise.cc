// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/noise.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"

namespace Stg {

namespace {

/// The numbers that are the same for all rays of a sensor.
struct ErrorTerms {
  double fraction, deviation, min_range, max_range;

  ErrorTerms(const RangeNoise& noise, const Bounds& range)
      : fraction(std::isfinite(noise.fraction) ? noise.fraction : 0.0),
        deviation(noise.variance > 0 && std::isfinite(noise.variance) ? std::sqrt(noise.variance)
                                                                      : 0.0),
        min_range(range.min < range.max && range.min > 0 ? range.min : 0.0),
        max_range(range.max) {}

  bool Any() const { return fraction != 0 || deviation > 0; }
  double Noisy(double r, RandomStream* random) const {
    const double relative = r * fraction * UniformError(random);
    const double noisy = r + relative + (deviation > 0 ? deviation * NormalError(random) : 0.0);
    STAGE_ASSERT(min_range <= max_range);
    return std::clamp(noisy, min_range, max_range);
  }
};

/// True if a ray meets the chord between its hit and that of the ray beside it steeply.
bool IsSteep(const RangeDefects& defects, double r, double beside) {
  const double across = beside * defects.sine;
  const double chord2 = r * r + beside * beside - 2.0 * r * beside * defects.cosine;
  return across * across < defects.least_cosine2 * chord2;
}

/// Returns the measured value of the range `r`. `before` and `after` are those of the rays beside
/// it, or infinite.
double Measured(const ErrorTerms& terms, const RangeDefects& defects, double r, double before,
                double after, RandomStream* random) {
  const double farthest = terms.max_range;
  if (!(r < farthest)) return r;
  if (r < terms.min_range) return defects.blind_near ? farthest : r;
  if (defects.loss > 0 && random->Uniform() < defects.loss) return farthest;
  if (defects.least_cosine2 > 0 && (before < farthest || after < farthest) &&
      (!(before < farthest) || IsSteep(defects, r, before)) &&
      (!(after < farthest) || IsSteep(defects, r, after)))
    return farthest;
  if (terms.Any()) r = terms.Noisy(r, random);
  if (!(defects.step > 0)) return r;
  return std::min(defects.step * std::floor(r / defects.step + 0.5), farthest);
}

}  // namespace

RangeDefects MakeRangeDefects(bool blind_near, double loss, double step, double steepest,
                              double increment) {
  RangeDefects defects;
  defects.blind_near = blind_near;
  defects.loss = loss > 0 ? loss : 0.0;
  defects.step = step > 0 && std::isfinite(step) ? step : 0.0;
  if (steepest < M_PI / 2 && increment != 0) {
    const double cosine = SinCos(std::max(0.0, steepest)).cosine;
    const SineCosine between = SinCos(increment);
    defects.least_cosine2 = cosine * cosine;
    defects.sine = between.sine;
    defects.cosine = between.cosine;
  }
  return defects;
}

void AddRangeErrors(const RangeNoise& noise, const RangeDefects& defects, const Bounds& range,
                    RandomStream* random, double* to, size_t count) {
  const ErrorTerms terms(noise, range);
  if (!defects.Any()) {
    if (!terms.Any()) return;
    for (size_t i = 0; i < count; i++)
      if (to[i] < range.max && !(to[i] < terms.min_range)) to[i] = terms.Noisy(to[i], random);
    return;
  }
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  double before = kNothing;
  for (size_t i = 0; i < count; i++) {
    const double r = to[i];
    to[i] = Measured(terms, defects, r, before, i + 1 < count ? to[i + 1] : kNothing, random);
    before = r;
  }
}

}  // namespace Stg
