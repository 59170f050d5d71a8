// SPDX-License-Identifier: GPL-2.0-or-later
//
// A log's record of what a robot is told, what it touches, and what its battery holds.

#ifndef STAGE_RECORDING_ACTIVITY_HH
#define STAGE_RECORDING_ACTIVITY_HH

#include <optional>
#include <unordered_map>
#include <vector>

#include "recording/log_writer.hh"
#include "recording/robot_messages.hh"
#include "recording/robots.hh"
#include "world/world.hh"

namespace Stg::recording {

/// Contacts of a world, by the ids of the models that touch.
using TouchesByModel = std::unordered_multimap<uint32_t, ContactPoint>;
/// Returns the contacts at the present poses. Each is there for both of its models; the normal
/// leads away from the model of the key, which is `a`.
TouchesByModel FindTouches(World* world);

class Activity {
 public:
  /// Call before each step: notes the command that the robot has then.
  void BeforeStep(const ModelPosition& position);
  /// Call after each step: that command took effect if the robot has updated.
  void AfterStep(const ModelPosition& position, usec_t now);

  /// Writes the command that the robot obeyed in its last update, unless that has been written.
  void WriteCommand(const Robot& robot, usec_t now, LogWriter* log);
  /// Writes the contacts of the robot and of all that it carries, if there are any, or if there
  /// were any in the last message.
  void WriteContacts(const Robot& robot, const TouchesByModel& all, usec_t now, LogWriter* log);
  /// Writes the state of the robot's power pack if it has one, and if its state has changed.
  void WriteBattery(const Robot& robot, usec_t now, LogWriter* log);

 private:
  struct Command {
    ModelPosition::ControlMode mode = ModelPosition::CONTROL_VELOCITY;
    Pose goal;
  };
  struct Battery {
    double stored = 0, share = 0;
    BatteryStatus status = BatteryStatus::kNotCharging;
  };

  std::optional<Command> next_;  // in force when the present step began
  Command obeyed_;               // in the last update
  usec_t obeyed_at_ = 0, written_at_ = 0;
  bool touched_ = false;  // the last message had contacts
  std::optional<Battery> battery_;
};

}  // namespace Stg::recording

#endif
