// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers and modes of commands, for robots in worlds and in rows.

#ifndef STAGE_WHATIF_COMMAND_VALUES_HH
#define STAGE_WHATIF_COMMAND_VALUES_HH

#include "motion/drive.hh"
#include "whatif/branches.hh"

namespace Stg::whatif {

/// ModelPosition::ControlMode has the same numbers.
inline DriveInput::Mode ModeOf(Command::Kind kind) {
  switch (kind) {
    case Command::kGoTo:
      return DriveInput::kPosition;
    case Command::kSetAcceleration:
      return DriveInput::kAcceleration;
    case Command::kSetSpeed:
    case Command::kStop:
      return DriveInput::kVelocity;
  }
  return DriveInput::kVelocity;
}

/// The velocity, acceleration or goal of a command, without a height.
inline Pose ValueOf(const Command& command) {
  return command.kind == Command::kStop ? Pose() : Pose(command.x, command.y, 0, command.a);
}

}  // namespace Stg::whatif

#endif
