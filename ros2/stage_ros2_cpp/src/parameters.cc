// SPDX-License-Identifier: GPL-2.0-or-later

#include "parameters.hh"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace stage_ros2_cpp {

using rclcpp::ParameterType;
using rclcpp::ParameterValue;

namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();
constexpr double kMaxSteps = 1e6;

/// A parameter. Texts with `choices` are one of them; numbers are in [min, max].
struct Known {
  const char* name;
  ParameterValue initial;  // also determines the type
  const char* text;
  bool fixed;  // it can't be changed while the node runs
  std::vector<std::string> choices = {};
  double min = 0, max = kUnbounded;
};

const std::vector<Known>& AllKnown() {
  static const std::vector<Known> known = {
      {"world_file", ParameterValue(""), "path of the world file", true},
      {"naming",
       ParameterValue("stage_ros2"),
       "naming scheme of topics and frames",
       true,
       {"stage_ros2", "stage_ros"}},
      {"enforce_prefixes", ParameterValue(false), "use a prefix for a single robot, too", true},
      {"odom_frame_id", ParameterValue("odom"), "frame of the odometry", true},
      {"base_link_frame_id", ParameterValue("base_link"), "frame of a robot's body", true},
      {"base_footprint_frame_id", ParameterValue("base_footprint"), "frame of a robot on the floor",
       true},
      {"map_frame_id", ParameterValue("map"), "frame of the world", true},
      {"publish_tf", ParameterValue(true), "publish /tf and /tf_static", true},
      {"publish_map_tf", ParameterValue(false),
       "publish the true transform from the map to each odometry", true},
      {"single_beams",
       ParameterValue("scan"),
       "the kind of message for sensors with one ray",
       true,
       {"scan", "range", "none"}},
      {"wheel_radius", ParameterValue(0.0),
       "radius of wheels, metres; 0: a fifth of their separation", true},
      {"wheel_separation", ParameterValue(0.0),
       "distance of the left from the right wheels, metres; 0: the width of the body", true},
      {"ticks_per_turn",
       ParameterValue(1000),
       "ticks that encoders count in a turn of a wheel",
       true,
       {},
       1},
      {"sensor_qos",
       ParameterValue("reliable"),
       "reliability of sensors' topics",
       true,
       {"reliable", "best_effort"}},
      {"ranges",
       ParameterValue("rep117"),
       "values of ranges and depths without a hit: rep117: infinity; stage: the maximum",
       true,
       {"rep117", "stage"}},
      {"stamped_cmd_vel", ParameterValue(false), "messages on cmd_vel are of the type TwistStamped",
       true},
      {"always_on", ParameterValue(false), "run all sensors from the beginning", true},
      {"base_watchdog_timeout", ParameterValue(0.2),
       "seconds of simulated time without a command after which a robot stops; 0: never", false},
      {"speed", ParameterValue(1.0),
       "simulated seconds per second of real time; 0: as many as possible", false},
      {"paused", ParameterValue(false), "start in the paused state", true},
      {"steps",
       ParameterValue(1),
       "number of steps per call of the service step",
       false,
       {},
       1,
       kMaxSteps},
      {"seed",
       ParameterValue(-1),
       "seed for the service reset; -1: keep the current seed",
       false,
       {},
       -1}};
  return known;
}

bool IsNumber(const ParameterValue& value) {
  return value.get_type() == ParameterType::PARAMETER_INTEGER ||
         value.get_type() == ParameterType::PARAMETER_DOUBLE;
}

double Number(const ParameterValue& value) {
  return value.get_type() == ParameterType::PARAMETER_INTEGER
             ? static_cast<double>(value.get<int64_t>())
             : value.get<double>();
}

std::string Short(double number) {
  std::string text = std::to_string(number);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

std::string ExpectedOf(const Known& known) {
  if (known.initial.get_type() == ParameterType::PARAMETER_BOOL) return "true or false";
  if (!IsNumber(known.initial)) {
    std::string text;
    for (const std::string& choice : known.choices) text += (text.empty() ? "" : " or ") + choice;
    return text.empty() ? "a text" : text;
  }
  const bool whole = known.initial.get_type() == ParameterType::PARAMETER_INTEGER;
  const std::string least =
      std::string(whole ? "a whole number, " : "a number, ") + Short(known.min);
  return least + (known.max == kUnbounded ? " or more" : " to " + Short(known.max));
}

bool Fits(const Known& known, const ParameterValue& value) {
  const ParameterType type = known.initial.get_type();
  if (!IsNumber(known.initial)) {
    if (value.get_type() != type) return false;
    bool fits = known.choices.empty();
    for (const std::string& choice : known.choices)
      fits = fits || value.get<std::string>() == choice;
    return fits;
  }
  if (!IsNumber(value) || (type == ParameterType::PARAMETER_INTEGER && value.get_type() != type))
    return false;
  return Number(value) >= known.min && Number(value) <= known.max;
}

/// Describes why a value is invalid; empty if it is valid or of a parameter that is not known.
std::string ComplaintAbout(const std::string& name, const ParameterValue& value) {
  for (const Known& known : AllKnown())
    if (name == known.name && !Fits(known, value))
      return "parameter " + name + ": found " + rclcpp::to_string(value) + ", expected " +
             ExpectedOf(known);
  return "";
}

}  // namespace

void DeclareParameters(rclcpp::Node* node) {
  for (const Known& known : AllKnown()) {
    rcl_interfaces::msg::ParameterDescriptor descriptor;
    descriptor.description = known.text;
    descriptor.read_only = known.fixed;
    // Types are checked here and not by rclcpp, which would refuse 2 instead of 2.0.
    descriptor.dynamic_typing = true;
    const ParameterValue value = node->declare_parameter(known.name, known.initial, descriptor);
    const std::string complaint = ComplaintAbout(known.name, value);
    if (!complaint.empty()) throw std::invalid_argument(complaint);
  }
}

rcl_interfaces::msg::SetParametersResult CheckChanges(
    const std::vector<rclcpp::Parameter>& changes) {
  rcl_interfaces::msg::SetParametersResult result;
  result.successful = true;
  for (const rclcpp::Parameter& change : changes) {
    result.reason = ComplaintAbout(change.get_name(), change.get_parameter_value());
    result.successful = result.reason.empty();
    if (!result.successful) break;
  }
  return result;
}

double NumberOf(const rclcpp::Node& node, const std::string& name) {
  return Number(node.get_parameter(name).get_parameter_value());
}

}  // namespace stage_ros2_cpp
