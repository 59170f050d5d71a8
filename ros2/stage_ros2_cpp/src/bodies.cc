// SPDX-License-Identifier: GPL-2.0-or-later

#include "bodies.hh"

namespace stage_ros2_cpp {

using Stg::ModelPosition;

Bodies::Bodies(const Simulation& simulation) : simulation_(simulation) {
  for (size_t i = 0; i < simulation.size(); i++) {
    const ModelPosition& robot = *simulation.Robot(i);
    const bool gps = robot.GetLocalizationMode() == ModelPosition::LOCALIZATION_GPS;
    errors_.emplace_back(gps ? Stg::Velocity(0, 0, 0, 0) : robot.GetOdomError());
  }
}

void Bodies::Begin() {
  moved_ = false;
  for (size_t i = 0; i < errors_.size(); i++)
    if (Exists(i)) errors_[i].Begin(Estimate(i));
}

void Bodies::Step() {
  moved_ = false;
  for (size_t i = 0; i < errors_.size(); i++)
    if (Exists(i)) errors_[i].Move(Estimate(i));
}

int64_t Bodies::Time(size_t robot) const {
  const ModelPosition* const model = simulation_.Robot(robot);
  return model ? static_cast<int64_t>(model->GetSensedTime()) : -1;
}

Stg::Pose Bodies::Truth(size_t robot) const {
  const ModelPosition& model = *simulation_.Robot(robot);
  return moved_ ? model.GetGlobalPose() : model.GetSensedPose();
}

Stg::Velocity Bodies::EstimatedVelocity(size_t robot) const {
  return simulation_.Robot(robot)->GetEstimatedVelocity();
}

Stg::Velocity Bodies::ActualVelocity(size_t robot) const {
  return simulation_.Robot(robot)->GetActualVelocity();
}

Covariance Bodies::OfPose(size_t robot) const {
  return errors_[robot].OfPose(simulation_.Robot(robot)->GetOdomCovariance());
}

Covariance Bodies::OfTwist(size_t robot) const {
  return errors_[robot].OfTwist(EstimatedVelocity(robot),
                                simulation_.Robot(robot)->GetOdomVelocityCovariance());
}

}  // namespace stage_ros2_cpp
