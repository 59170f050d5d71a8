// SPDX-License-Identifier: GPL-2.0-or-later
//
// Names of topics, frames and robots in ROS, for logs, replays and the ROS node.

#ifndef STAGE_RECORDING_ROS_NAMES_HH
#define STAGE_RECORDING_ROS_NAMES_HH

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace Stg::recording {

// Topics of a robot, and frames.
constexpr char kOdometryTopic[] = "odom", kScanTopic[] = "base_scan";
constexpr char kMapFrame[] = "map", kOdometryFrame[] = "odom";
constexpr char kFootprintFrame[] = "base_footprint", kBaseFrame[] = "base_link";

/// A scheme of names of topics and frames.
struct NamingScheme {
  const char* name;
  const char* ground_truth;  ///< topic of the true pose
  const char* separator;     ///< between a sensor's name and its number
  bool numbered_robots;      ///< true: robot_0, robot_1, ...; false: as in the world file
  const char* scan_frame;    ///< frame of a ranger
  const char* camera_frame;

  /// Name of thing `number` of `count` of one kind, without a number if it is the only one.
  std::string Numbered(const std::string& base, size_t number, size_t count) const;
  /// Prefixes of the robots' topics and frames, which are not in `taken` and are added to it. A
  /// single robot has an empty one, unless `always`.
  std::vector<std::string> Prefixes(const std::vector<std::string>& robots, bool always,
                                    std::set<std::string>* taken) const;
};

/// All schemes; logs have the names of the first one.
const std::vector<NamingScheme>& NamingSchemes();

/// Reduces a name to letters, digits and single underscores that do not start with a digit.
std::string RosName(const std::string& token);
/// Name of sensor `number` of a ranger; the first sensor has the ranger's name.
std::string SensorName(const std::string& ranger, size_t number);
/// Returns prefix/name, or the name alone if the prefix is empty.
std::string Joined(const std::string& prefix, const std::string& name);

}  // namespace Stg::recording

#endif
