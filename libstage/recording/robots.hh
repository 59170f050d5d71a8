// SPDX-License-Identifier: GPL-2.0-or-later
//
// The robots of a world as ROS sees them: names of topics and frames. Logs and replays have to
// agree on these.

#ifndef STAGE_RECORDING_ROBOTS_HH
#define STAGE_RECORDING_ROBOTS_HH

#include <string>
#include <vector>

#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::recording {

/// A sensor of a ranger.
struct ScanSource {
  ModelRanger* ranger;
  uint32_t sensor;    // its number
  std::string topic;  // "/base_scan", "/r0/base_scan1_sensor_2"
  std::string frame;  // "base_scan_link", "r0/base_scan_link1_sensor_2"
  bool moves;         // an actuator, or another position, moves it, relative to the robot
};

/// A position model that no other one carries, with all that is on it; or a model without any that
/// carries range sensors, such as a lamp post.
struct Robot {
  Model* model;
  ModelPosition* position;  // null: it has none
  std::string topics;       // what its topics begin with: "/", "/r0/"
  std::string odom_frame, footprint_frame, base_frame;
  std::vector<ScanSource> scans;
};

/// In the order of creation. Names are those of stage_ros2: if there are several robots, topics and
/// frames begin with the robot's name, in signs that ROS allows.
std::vector<Robot> RobotsOf(const std::vector<Model*>& models);

/// Where the rays of a sensor began, in the frame of its robot, when it sensed last.
Pose MountOf(const ScanSource& source, const Model& robot);

}  // namespace Stg::recording

#endif
