// SPDX-License-Identifier: GPL-2.0-or-later

#include "transforms.hh"

#include "topics.hh"

namespace stage_ros2_cpp {

using tf2_msgs::msg::TFMessage;

namespace {

geometry_msgs::msg::TransformStamped MakeTransform(const std::string& parent,
                                                   const std::string& child,
                                                   const Transform& pose) {
  geometry_msgs::msg::TransformStamped made;
  made.header.frame_id = parent;
  made.child_frame_id = child;
  made.transform.translation.x = pose.x;
  made.transform.translation.y = pose.y;
  made.transform.translation.z = pose.z;
  made.transform.rotation.x = pose.qx;
  made.transform.rotation.y = pose.qy;
  made.transform.rotation.z = pose.qz;
  made.transform.rotation.w = pose.qw;
  return made;
}

}  // namespace

TFMessage StaticTransforms(const std::vector<RobotPlan>& plans) {
  TFMessage message;
  for (const RobotPlan& plan : plans)
    for (const Mount& mount : plan.mounts)
      message.transforms.push_back(MakeTransform(mount.parent, mount.child, mount.pose));
  return message;
}

void Transforms::Add(size_t robot, const std::string& parent, const std::string& child,
                     const Transform& pose, TFMessage* message) const {
  message->transforms.push_back(MakeTransform(parent, child, pose));
  message->transforms.back().header.stamp = StampOf(bodies_.Time(robot));
}

TFMessage Transforms::At(int64_t now, bool everything) const {
  TFMessage message;
  std::vector<size_t> chosen;
  for (size_t i = 0; i < plans_.size(); i++)
    if (bodies_.Exists(i) && (everything || bodies_.Time(i) == now)) chosen.push_back(i);
  for (const size_t i : chosen)
    Add(i, Joined(plans_[i].prefix, look_.odom), Joined(plans_[i].prefix, look_.footprint),
        Planar(bodies_.Estimate(i)), &message);
  for (const size_t i : chosen)
    if (with_map_)
      Add(i, look_.map, Joined(plans_[i].prefix, look_.odom), Planar(frames_.Origin(i)), &message);
  for (const size_t i : chosen)
    for (const Joint& joint : plans_[i].joints)
      if (const Stg::Model* const sensor = simulation_.Find(joint.sensor))
        Add(i, joint.parent, joint.child, PoseOf(joint, *sensor, *simulation_.Robot(i)), &message);
  return message;
}

}  // namespace stage_ros2_cpp
