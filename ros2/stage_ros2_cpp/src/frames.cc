// SPDX-License-Identifier: GPL-2.0-or-later

#include "frames.hh"

#include <stdexcept>

namespace stage_ros2_cpp {

using Stg::ModelPosition;
using Stg::Pose;

Frames::Frames(const Look& look, const std::vector<RobotPlan>& plans, const Simulation& simulation)
    : map_(look.map), simulation_(simulation) {
  for (size_t i = 0; i < plans.size(); i++) {
    odometry_[Joined(plans[i].prefix, look.odom)] = i;
    bodies_[Joined(plans[i].prefix, look.footprint)] = i;
    bodies_[Joined(plans[i].prefix, look.base)] = i;
  }
  expected_ = map_ + ", " + Joined(plans[0].prefix, look.odom) + ", " +
              Joined(plans[0].prefix, look.footprint) + " or another robot's";
}

Pose Frames::Origin(size_t robot) const {
  const ModelPosition& model = *simulation_.Robot(robot);
  return FrameBetween(model.GetSensedPose(), model.est_pose);
}

Pose Frames::InWorld(const Pose& pose, const std::string& frame) const {
  const std::string name = frame.substr(frame.empty() || frame[0] != '/' ? 0 : 1);
  if (name.empty() || name == map_) return pose;
  const auto odometry = odometry_.find(name), body = bodies_.find(name);
  if (odometry != odometry_.end() && simulation_.Robot(odometry->second))
    return Composed(Origin(odometry->second), pose);
  if (body != bodies_.end() && simulation_.Robot(body->second))
    return Composed(simulation_.Robot(body->second)->GetGlobalPose(), pose);
  throw std::invalid_argument("found the frame '" + frame.substr(0, 60) + "', expected " +
                              expected_);
}

}  // namespace stage_ros2_cpp
