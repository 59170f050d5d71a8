// SPDX-License-Identifier: GPL-2.0-or-later
//
// The way of a robot during a scan that takes time: where it was when each ray was cast.

#ifndef STAGE_MODELS_SCAN_PATH_HH
#define STAGE_MODELS_SCAN_PATH_HH

#include <cstddef>
#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class StateExchange;

/// Notes how a robot moved in the last steps, and goes back along its way. It goes back from the
/// present pose, so a robot that was moved by SetPose() seems to have come by the same motion to
/// its new place.
class ScanPath {
 public:
  static constexpr size_t kMostSteps = 1000;

  /// Notes the motion of a step in the body frame, and forgets all but the newest `steps`.
  void Note(const Velocity& made, size_t steps);
  /// True if the robot has stood for as long as is known.
  bool IsStill() const;
  /// Sets the present pose. `dt`: seconds of a step.
  void StartAt(const Pose& now, double dt);
  /// Pose of the robot `seconds` ago, after StartAt(). Between two steps, x, y and heading change
  /// evenly, as transforms are interpolated.
  Pose Before(double seconds) const;
  void ExchangeState(StateExchange& exchange);

 private:
  std::vector<Velocity> motions_;  // the newest first
  // Since StartAt(): poses at the ends of the last steps, the present one first. Headings are not
  // normalized.
  std::vector<Pose> poses_;
  double dt_ = 1;
};

}  // namespace Stg

#endif
