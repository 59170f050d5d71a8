// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measurements of inertial sensors and encoders of wheels, followed from step to step.

#ifndef STAGE_ROS2_CPP_MOTION_HH
#define STAGE_ROS2_CPP_MOTION_HH

#include <array>
#include <string>
#include <vector>

#include "bodies.hh"

namespace stage_ros2_cpp {

constexpr double kGravity = 9.80665;  ///< m/s2, which accelerometers at rest measure (REP 145)

/// Sizes of the wheels of a robot.
class Wheels {
 public:
  static constexpr size_t kMax = 4;

  /// `radius`, `separation`: metres; 0: the separation is the width of the body, and the radius a
  /// fifth of that.
  Wheels(const Stg::ModelPosition& robot, double radius, double separation);

  /// Names of the wheels; empty if the drive has no wheels that are modelled.
  const std::vector<std::string>& names() const { return names_; }
  /// Names of the joints that steer; none but for cars.
  const std::vector<std::string>& steering() const { return steering_; }
  /// Turn rates of the wheels, rad/s, at a velocity of the robot: m/s and rad/s.
  std::array<double, kMax> Speeds(double ahead, double turn) const;
  /// Angles of the two front wheels of a car, whose axes meet that of the rear ones.
  std::array<double, 2> Angles(double steering) const;

 private:
  std::vector<std::string> names_, steering_;
  double radius_, separation_;
  double wheelbase_;  // 0: there are no front wheels
};

/// Accelerations of all robots, and the angles by which their wheels have turned.
class Motion {
 public:
  struct State {
    bool accelerated = false;                             ///< true: `ahead` and `left` are known
    double ahead = 0, left = 0;                           ///< acceleration of the body, m/s2
    std::array<double, Wheels::kMax> turned{}, speeds{};  ///< of wheels, rad and rad/s
    Stg::Velocity before;
  };

  /// `dt`: duration of a step, seconds.
  Motion(const Bodies& bodies, std::vector<Wheels> wheels, double dt);

  const Wheels& wheels(size_t robot) const { return wheels_[robot]; }
  const State& state(size_t robot) const { return states_[robot]; }
  /// Computes accelerations from now on.
  void FollowBodies();
  /// Counts the turns of wheels from now on.
  void FollowWheels();
  /// Starts anew after a reset.
  void Begin();
  /// Follows a step that has just been made.
  void Step();

 private:
  void StartBodies();
  void ReadSpeeds();
  void Accelerate(State* state, const Stg::Velocity& now) const;

  const Bodies& bodies_;
  const std::vector<Wheels> wheels_;
  const double dt_;
  std::vector<State> states_;
  bool follows_bodies_ = false, follows_wheels_ = false;
};

}  // namespace stage_ros2_cpp

#endif
