// SPDX-License-Identifier: GPL-2.0-or-later
//
// The sensors of each robot, and the names of their topics and frames.

#ifndef STAGE_ROS2_CPP_ROBOTS_HH
#define STAGE_ROS2_CPP_ROBOTS_HH

#include <string>
#include <utility>
#include <vector>

#include "names.hh"
#include "places.hh"
#include "simulation.hh"

namespace stage_ros2_cpp {

/// The parameters of the node that determine topics and frames.
struct Look {
  const NamingScheme* scheme;
  bool enforce_prefixes;  ///< a single robot has a prefix, too
  std::string odom, base, footprint, map;
  std::string single_beams;  ///< sensors of one ray are published as "scan", "range" or "none"
  bool by_rep117;            ///< false: ranges and depths are published as Stage has them
  int64_t ticks_per_turn;    ///< of encoders
};

/// A frame that does not move on its robot.
struct Mount {
  std::string parent, child;  ///< with the robot's prefix
  Transform pose;
};

/// A frame of a sensor that an actuator or another robot carries.
struct Joint {
  std::string parent, child;
  uint32_t sensor;  ///< id of its model
  Stg::Pose inner;  ///< the frame on the sensor
  double pan, tilt;
};

/// One sensor of a ranger: its name without the prefix, and its frame with it.
struct Scanner {
  size_t ranger;  ///< number of the ranger on the robot
  size_t sensor;  ///< number of the sensor on the ranger
  size_t first;   ///< its first ray among those of the ranger
  double min_range, max_range, fov, time_increment;
  size_t samples;
};

/// Image size and lens of a camera; angles in radians.
struct View {
  uint32_t width, height;
  double fov, vertical_fov, near, far, pan, tilt;
};

/// A sensor with topics of its own.
struct Sensor {
  enum Kind { kScanner, kCamera } kind;
  uint32_t model;    ///< id
  size_t index;      ///< number of the ranger or camera on the robot
  int64_t interval;  ///< between updates, microseconds; at least a step
  std::string frame;
  /// With the prefix: a scanner's topic, or what follows "image" in the topics of a camera.
  std::string topic;
  Scanner scanner;
  View view;
};

struct RobotPlan {
  uint32_t id;
  std::string name, prefix;
  std::vector<Sensor> sensors;
  std::vector<Mount> mounts;
  std::vector<Joint> joints;
  /// Types and numbers of all its sensors, also of those without topics.
  std::vector<std::pair<std::string, size_t>> all_sensors;
};

/// The plans of all robots of a world, in their order.
std::vector<RobotPlan> PlanRobots(const Simulation& simulation, const Look& look);
/// Pose of a joint's frame in its parent at the time of the newest readings.
Transform PoseOf(const Joint& joint, const Stg::Model& sensor, const Stg::Model& robot);

}  // namespace stage_ros2_cpp

#endif
