// SPDX-License-Identifier: GPL-2.0-or-later

#include "names.hh"

#include <cctype>
#include <set>

namespace stage_ros2_cpp {

namespace {

constexpr NamingScheme kSchemes[] = {
    {"stage_ros2", "ground_truth", "", false, "base_scan_link", "camera_link"},
    {"stage_ros", "base_pose_ground_truth", "_", true, "base_laser_link", "camera"}};

/// Reduces a name to letters, digits and single underscores that do not start with a digit.
std::string RosName(const std::string& token) {
  std::string name;
  for (const char c : token) {
    const bool allowed = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (allowed || (!name.empty() && name.back() != '_')) name += allowed ? c : '_';
  }
  if (!name.empty() && name.back() == '_') name.pop_back();
  if (name.empty()) return "robot";
  return std::isdigit(static_cast<unsigned char>(name[0])) ? "_" + name : name;
}

/// Returns a name that is not taken yet, and marks it as taken.
std::string FreeName(const std::string& token, std::set<std::string>* taken) {
  const std::string name = RosName(token);
  std::string free = name;
  for (int i = 2; !taken->insert(free).second; i++) free = name + "_" + std::to_string(i);
  return free;
}

}  // namespace

std::string NamingScheme::Numbered(const std::string& base, size_t number, size_t count) const {
  return count == 1 ? base : base + separator + std::to_string(number);
}

std::vector<std::string> NamingScheme::Prefixes(const std::vector<std::string>& robots,
                                                bool always) const {
  if (robots.size() == 1 && !always) return {""};
  std::vector<std::string> prefixes;
  std::set<std::string> taken;
  for (const std::string& robot : robots)
    prefixes.push_back(numbered_robots ? "robot_" + std::to_string(prefixes.size())
                                       : FreeName(robot, &taken));
  return prefixes;
}

const NamingScheme* FindScheme(const std::string& name) {
  for (const NamingScheme& scheme : kSchemes)
    if (name == scheme.name) return &scheme;
  return nullptr;
}

std::string SensorName(const std::string& ranger, size_t number) {
  return number == 0 ? ranger : ranger + "_sensor_" + std::to_string(number);
}

std::string Joined(const std::string& prefix, const std::string& name) {
  return prefix.empty() ? name : prefix + "/" + name;
}

}  // namespace stage_ros2_cpp
