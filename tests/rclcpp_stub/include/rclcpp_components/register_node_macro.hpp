// SPDX-License-Identifier: GPL-2.0-or-later
//
// A stand-in for rclcpp_components: the node registers itself for the driver of the tests.

#ifndef STAGE_TESTS_RCLCPP_COMPONENTS_STUB_HPP
#define STAGE_TESTS_RCLCPP_COMPONENTS_STUB_HPP

#include <rclcpp/rclcpp.hpp>

namespace rclcpp_stub {
using NodeMaker = std::shared_ptr<rclcpp::Node> (*)(const rclcpp::NodeOptions&);
/// Makers of nodes by the names of their classes.
std::map<std::string, NodeMaker>& NodeMakers();
}  // namespace rclcpp_stub

#define RCLCPP_COMPONENTS_REGISTER_NODE(Class)                                    \
  static const bool registered_node = [] {                                        \
    rclcpp_stub::NodeMakers()[#Class] =                                           \
        [](const rclcpp::NodeOptions& options) -> std::shared_ptr<rclcpp::Node> { \
      return std::make_shared<Class>(options);                                    \
    };                                                                            \
    return true;                                                                  \
  }();

#endif
