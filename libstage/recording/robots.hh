// SPDX-License-Identifier: GPL-2.0-or-later
//
// Topic and frame names for the robots of a world. Logs and replays must use the same names.

#ifndef STAGE_RECORDING_ROBOTS_HH
#define STAGE_RECORDING_ROBOTS_HH

#include <string>
#include <vector>

#include "models/model_type.hh"
#include "models/position.hh"
#include "models/ranger.hh"

namespace Stg::recording {

/// One sensor of a ranger.
struct ScanSource {
  ModelRanger* ranger;
  uint32_t sensor;    // index in the ranger
  std::string topic;  // "/base_scan", "/r0/base_scan1_sensor_2"
  std::string frame;  // "base_scan_link", "r0/base_scan_link1_sensor_2"
  bool moves;         // true if an actuator or another position moves it relative to the robot
};

/// A sensor with readings that are not in scans.
struct SensorSource {
  Model* sensor;
  const ModelType* type;  // with the readings
  std::string topic;      // "/readings/sonar_ring", "/r0/readings/fiducial1"
};

/// A position that is not carried by another one, with everything on it. Also a model without a
/// position that carries sensors, such as a lamp post.
struct Robot {
  Model* model;
  ModelPosition* position;  // may be null
  std::string topics;       // prefix of its topics: "/", "/r0/"
  std::string odom_frame, footprint_frame, base_frame;
  std::vector<ScanSource> scans;
  std::vector<SensorSource> sensors;
};

/// Returns all robots in the order of creation. Names follow stage_ros2: if there are several
/// robots, topics and frames start with the robot's name, reduced to the characters that ROS
/// allows.
std::vector<Robot> RobotsOf(const std::vector<Model*>& models);

/// Pose of a sensor's rays in the robot's frame at the last update.
Pose MountOf(const ScanSource& source, const Model& robot);

}  // namespace Stg::recording

#endif
