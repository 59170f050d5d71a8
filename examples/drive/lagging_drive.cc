// SPDX-License-Identifier: GPL-2.0-or-later
//
// A drive of one's own in a plug-in: two wheels whose motors take time to reach their speed. World
// files with `plugins "lagging_drive"` may contain robots with `drive "lagging"`. See README.md.

#include <algorithm>

#include "stage.hh"

namespace {

constexpr double kTimeConstant = 0.5;  // seconds

/// First-order lag: in each update, the velocity makes up dt / kTimeConstant of the difference to
/// the command. Goals and accelerations are not supported: the robot then comes to rest.
Stg::DriveOutput DriveWithLag(const Stg::DriveInput& input) {
  Stg::Velocity wanted;
  if (input.mode == Stg::DriveInput::kVelocity)
    wanted = Stg::Velocity(input.command.x, 0, 0, input.command.a);
  const double share = std::min(input.dt / kTimeConstant, 1.0);
  Stg::DriveOutput output;
  output.velocity.x = input.velocity.x + share * (wanted.x - input.velocity.x);
  output.velocity.a = input.velocity.a + share * (wanted.a - input.velocity.a);
  return output;
}

// Registers the drive when the plug-in is loaded.
[[maybe_unused]] const bool kRegistered = Stg::RegisterDrive("lagging", DriveWithLag);

}  // namespace
