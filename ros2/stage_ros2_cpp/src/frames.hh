// SPDX-License-Identifier: GPL-2.0-or-later
//
// The coordinate frames of poses that clients send.

#ifndef STAGE_ROS2_CPP_FRAMES_HH
#define STAGE_ROS2_CPP_FRAMES_HH

#include <map>
#include <string>
#include <vector>

#include "bodies.hh"
#include "robots.hh"

namespace stage_ros2_cpp {

/// The planar frames of a world: the map, and the odometry and the body of each robot.
class Frames {
 public:
  Frames(const Look& look, const std::vector<RobotPlan>& plans, const Simulation& simulation);

  /// Origin of the odometry frame of a robot in the map, by its true pose.
  Stg::Pose Origin(size_t robot) const;
  /// Transforms a pose from `frame` to the map; an empty name is the map, and a leading slash does
  /// not count. Throws std::invalid_argument if there is no such frame.
  Stg::Pose InWorld(const Stg::Pose& pose, const std::string& frame) const;

 private:
  const std::string map_;
  const Simulation& simulation_;
  std::map<std::string, size_t> odometry_, bodies_;  // robots by the names of frames
  std::string expected_;
};

}  // namespace stage_ros2_cpp

#endif
