// SPDX-License-Identifier: GPL-2.0-or-later
//
// Paces the steps of a world by real time.

#ifndef STAGE_ROS2_CPP_PACE_HH
#define STAGE_ROS2_CPP_PACE_HH

#include <chrono>

namespace stage_ros2_cpp {

/// Counts the simulated seconds that are due. Time that is already due is kept when the speed
/// changes or the world pauses.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;

  /// `speed`: simulated seconds per second; 0 or infinity: a step is always due.
  Pace(double speed, bool running) : speed_(speed), running_(running) {}

  /// Starts anew, for example after a reset: no step is due.
  void Begin();
  void SetSpeed(double speed);
  void SetRunning(bool running);
  /// True if a step of `dt` simulated seconds is due.
  bool IsDue(double dt);
  /// Records that a due step of `dt` simulated seconds has been made.
  void Made(double dt);
  bool IsUnlimited() const;

 private:
  void Count();

  double speed_;
  bool running_;
  double due_ = 0;  // simulated seconds
  Clock::time_point counted_ = Clock::now();
};

}  // namespace stage_ros2_cpp

#endif
