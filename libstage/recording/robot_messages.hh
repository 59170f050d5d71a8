// SPDX-License-Identifier: GPL-2.0-or-later
//
// Serializes the ROS 2 messages about what a robot is told, touches and has in its battery.

#ifndef STAGE_RECORDING_ROBOT_MESSAGES_HH
#define STAGE_RECORDING_ROBOT_MESSAGES_HH

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "geometry/geometry.hh"
#include "recording/buffer.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

MessageType TwistType();
MessageType AccelerationType();
MessageType PoseType();
MessageType ContactsType();
MessageType BatteryType();

/// TwistStamped and AccelStamped; `a` is about the vertical axis.
void PutTwist(const Pose& numbers, std::string_view frame, usec_t time, Buffer* to);
void PutPose(const Pose& pose, std::string_view frame, usec_t time, Buffer* to);

/// A place where a robot touches something.
struct Touch {
  double x, y, heading;  ///< in the robot's frame; the heading is that of the thing, from the robot
  std::string thing;     ///< name of the model that is touched
};
/// MarkerArray: deletes the markers of the message before, and shows an arrow for each place.
/// `topic` is the namespace of the markers, without a slash in front.
void PutContacts(const std::vector<Touch>& touches, std::string_view topic, std::string_view frame,
                 usec_t time, Buffer* to);

/// Values of `status` in BatteryState.
enum class BatteryStatus : uint8_t { kCharging = 1, kDischarging = 2, kNotCharging = 3, kFull = 4 };
/// BatteryState: `share` is from 0 to 1. Voltages and the like are NaN.
void PutBattery(double share, BatteryStatus status, usec_t time, Buffer* to);

}  // namespace Stg::recording

#endif
