// SPDX-License-Identifier: GPL-2.0-or-later
//
// The node's parameters: defaults, valid values and descriptions.

#ifndef STAGE_ROS2_CPP_PARAMETERS_HH
#define STAGE_ROS2_CPP_PARAMETERS_HH

#include <rcl_interfaces/msg/parameter_descriptor.hpp>
#include <rcl_interfaces/msg/set_parameters_result.hpp>
#include <rclcpp/rclcpp.hpp>
#include <string>
#include <vector>

namespace stage_ros2_cpp {

/// Declares all parameters. Throws std::invalid_argument with one line if a given value is invalid.
void DeclareParameters(rclcpp::Node* node);
/// Refuses invalid changes, as a callback for changes of parameters.
rcl_interfaces::msg::SetParametersResult CheckChanges(
    const std::vector<rclcpp::Parameter>& changes);
/// The value of a parameter that is a number, given as an integer or not.
double NumberOf(const rclcpp::Node& node, const std::string& name);

}  // namespace stage_ros2_cpp

#endif
