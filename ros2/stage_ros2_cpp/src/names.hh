// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names of topics, frames and robots, equal to those of the Python node and of logs.

#ifndef STAGE_ROS2_CPP_NAMES_HH
#define STAGE_ROS2_CPP_NAMES_HH

#include <cstddef>
#include <string>
#include <vector>

namespace stage_ros2_cpp {

/// A scheme of names of topics and frames.
struct NamingScheme {
  const char* name;
  const char* ground_truth;  ///< topic of the true pose
  const char* separator;     ///< between a sensor's name and its number
  bool numbered_robots;      ///< true: robot_0, robot_1, ...; false: as in the world file
  const char* scan_frame;
  const char* camera_frame;

  /// Name of thing `number` of `count` of one kind, without a number if it is the only one.
  std::string Numbered(const std::string& base, size_t number, size_t count) const;
  /// Prefixes of the robots' topics and frames. A single robot has an empty one, unless `always`.
  std::vector<std::string> Prefixes(const std::vector<std::string>& robots, bool always) const;
};

/// The scheme of that name; null: there is none.
const NamingScheme* FindScheme(const std::string& name);
/// Name of sensor `number` of a ranger; the first sensor has the ranger's name.
std::string SensorName(const std::string& ranger, size_t number);
/// Returns prefix/name, or the name alone if the prefix is empty.
std::string Joined(const std::string& prefix, const std::string& name);

}  // namespace stage_ros2_cpp

#endif
