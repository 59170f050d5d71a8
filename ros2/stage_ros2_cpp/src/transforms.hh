// SPDX-License-Identifier: GPL-2.0-or-later
//
// Messages for /tf and /tf_static: from the odometry of each robot to its body and its sensors.

#ifndef STAGE_ROS2_CPP_TRANSFORMS_HH
#define STAGE_ROS2_CPP_TRANSFORMS_HH

#include <tf2_msgs/msg/tf_message.hpp>
#include <vector>

#include "frames.hh"

namespace stage_ros2_cpp {

/// The frames that do not move on their robots.
tf2_msgs::msg::TFMessage StaticTransforms(const std::vector<RobotPlan>& plans);

/// The frames that move, with the stamps of each robot's odometry and the poses of that instant.
class Transforms {
 public:
  /// `with_map`: also the transforms from the map to the odometry. The arguments outlive it.
  Transforms(const Look& look, const std::vector<RobotPlan>& plans, const Simulation& simulation,
             const Bodies& bodies, const Frames& frames, bool with_map)
      : look_(look),
        plans_(plans),
        simulation_(simulation),
        bodies_(bodies),
        frames_(frames),
        with_map_(with_map) {}

  /// Frames of the robots that sensed at the time `now` (microseconds), or of all.
  tf2_msgs::msg::TFMessage At(int64_t now, bool everything) const;

 private:
  void Add(size_t robot, const std::string& parent, const std::string& child, const Transform& pose,
           tf2_msgs::msg::TFMessage* message) const;

  const Look& look_;
  const std::vector<RobotPlan>& plans_;
  const Simulation& simulation_;
  const Bodies& bodies_;
  const Frames& frames_;
  const bool with_map_;
};

}  // namespace stage_ros2_cpp

#endif
