// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/scan_path.hh"

#include <algorithm>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/state_exchange.hh"

namespace Stg {

void ScanPath::Note(const Velocity& made, size_t steps) {
  if (motions_.size() >= steps) motions_.resize(steps > 0 ? steps - 1 : 0);
  if (steps > 0) motions_.insert(motions_.begin(), made);
}

bool ScanPath::IsStill() const {
  return std::ranges::all_of(motions_, [](const Velocity& v) { return v.IsZero(); });
}

void ScanPath::StartAt(const Pose& now, double dt) {
  STAGE_ASSERT(dt > 0);
  dt_ = dt;
  poses_.clear();
  poses_.push_back(now);
  for (const Velocity& v : motions_) {
    // A step translates along the old heading, then turns.
    Pose before = poses_.back();
    before.a -= v.a * dt;
    const SineCosine turn = SinCos(normalize(before.a));
    before.x -= (v.x * turn.cosine - v.y * turn.sine) * dt;
    before.y -= (v.x * turn.sine + v.y * turn.cosine) * dt;
    poses_.push_back(before);
  }
}

Pose ScanPath::Before(double seconds) const {
  STAGE_ASSERT(seconds >= 0 && !poses_.empty());
  const double steps = std::min(seconds / dt_, static_cast<double>(poses_.size() - 1));
  const auto index = static_cast<size_t>(steps);
  const Pose& after = poses_[index];
  if (index + 1 == poses_.size()) return after;
  const Pose& before = poses_[index + 1];
  const double part = steps - static_cast<double>(index);
  return Pose(after.x + (before.x - after.x) * part, after.y + (before.y - after.y) * part, after.z,
              normalize(after.a + (before.a - after.a) * part));
}

void ScanPath::ExchangeState(StateExchange& exchange) {
  exchange(motions_);
  if (motions_.size() > kMostSteps) exchange.Fail("found too long a way of a scan");
}

}  // namespace Stg
