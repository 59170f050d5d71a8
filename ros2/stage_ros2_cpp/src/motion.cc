// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion.hh"

#include <cmath>
#include <utility>

namespace stage_ros2_cpp {

using Stg::ModelPosition;
using Stg::Velocity;

Wheels::Wheels(const ModelPosition& robot, double radius, double separation)
    : separation_(separation != 0 ? separation : robot.GetGeom().size.y) {
  radius_ = radius != 0 ? radius : separation_ / 5;
  const bool car = robot.GetDriveMode() == ModelPosition::DRIVE_CAR;
  wheelbase_ = car ? robot.GetWheelbase() : 0;
  if (robot.GetDriveMode() == ModelPosition::DRIVE_DIFFERENTIAL)
    names_ = {"left_wheel", "right_wheel"};
  if (car)
    names_ = {"rear_left_wheel", "rear_right_wheel", "front_left_wheel", "front_right_wheel"};
  if (wheelbase_ > 0) steering_ = {"front_left_steering", "front_right_steering"};
}

std::array<double, Wheels::kMax> Wheels::Speeds(double ahead, double turn) const {
  const double left = ahead - turn * separation_ / 2, right = ahead + turn * separation_ / 2;
  std::array<double, kMax> speeds{left, right, 0, 0};
  if (wheelbase_ != 0) {  // front wheels roll in the direction in which they move
    speeds[2] = std::copysign(std::hypot(left, turn * wheelbase_), left);
    speeds[3] = std::copysign(std::hypot(right, turn * wheelbase_), right);
  }
  for (double& speed : speeds) speed /= radius_;
  return speeds;
}

std::array<double, 2> Wheels::Angles(double steering) const {
  const double side = wheelbase_ * std::sin(steering), ahead = wheelbase_ * std::cos(steering);
  const double half = separation_ / 2 * std::sin(steering);
  return {std::atan2(side, ahead - half), std::atan2(side, ahead + half)};
}

Motion::Motion(const Bodies& bodies, std::vector<Wheels> wheels, double dt)
    : bodies_(bodies), wheels_(std::move(wheels)), dt_(dt), states_(wheels_.size()) {}

void Motion::FollowBodies() {
  if (!std::exchange(follows_bodies_, true)) StartBodies();
}

void Motion::FollowWheels() {
  if (!std::exchange(follows_wheels_, true)) ReadSpeeds();
}

void Motion::StartBodies() {
  for (size_t i = 0; i < states_.size(); i++)
    if (bodies_.Exists(i)) states_[i].before = bodies_.ActualVelocity(i);
}

void Motion::Begin() {
  for (State& state : states_) state = State();
  if (follows_bodies_) StartBodies();
}

void Motion::Step() {
  for (size_t i = 0; i < states_.size(); i++) {
    State& state = states_[i];
    if (follows_bodies_ && bodies_.Exists(i)) Accelerate(&state, bodies_.ActualVelocity(i));
    if (follows_wheels_)
      for (size_t wheel = 0; wheel < Wheels::kMax; wheel++)
        state.turned[wheel] += state.speeds[wheel] * dt_;
  }
  if (follows_wheels_) ReadSpeeds();
}

void Motion::ReadSpeeds() {
  for (size_t i = 0; i < states_.size(); i++) {
    if (wheels_[i].names().empty() || !bodies_.Exists(i)) continue;
    const Velocity velocity = bodies_.EstimatedVelocity(i);
    states_[i].speeds = wheels_[i].Speeds(velocity.x, velocity.a);
  }
}

/// The change of the velocity in the frame of the body, plus the turn rate times the velocity.
void Motion::Accelerate(State* state, const Velocity& now) const {
  const Velocity& before = state->before;
  const double x = (now.x + before.x) / 2, y = (now.y + before.y) / 2;
  const double turn = (now.a + before.a) / 2;
  state->ahead = (now.x - before.x) / dt_ - turn * y;
  state->left = (now.y - before.y) / dt_ + turn * x;
  state->accelerated = true;
  state->before = now;
}

}  // namespace stage_ros2_cpp
