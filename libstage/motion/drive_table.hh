// SPDX-License-Identifier: GPL-2.0-or-later
//
// The table of drives, and the bounds that apply to all of them.

#ifndef STAGE_MOTION_DRIVE_TABLE_HH
#define STAGE_MOTION_DRIVE_TABLE_HH

#include <cmath>
#include <string>

#include "motion/drive.hh"

namespace Stg {

/// A drive with its name in world files. It exists as long as the process.
struct RegisteredDrive {
  std::string name;
  DriveFunction function;
};

namespace motion {

/// Position of the built-in drives in the table; equal to ModelPosition::DriveMode.
enum BuiltInDrive { kDifferential, kOmni, kCar, kBuiltInDrives };

const RegisteredDrive& DriveOf(BuiltInDrive kind);
/// Returns null if no drive has that name. Can be called from any thread.
const RegisteredDrive* FindDrive(const std::string& name);
/// Quoted names of all drives, as `"diff", "omni" or "car"`.
std::string DriveNames();

/// Clips a drive's output to the velocity bounds and, if the input says so, to the velocities that
/// the acceleration bounds allow after dt. A velocity outside of the velocity bounds returns to
/// them no faster than that.
Velocity Bounded(const DriveInput& input, const DriveOutput& output);

/// The result of a drive for a command. All numbers are finite or infinite, not NaN.
struct Driven {
  Velocity wanted;  ///< before the bounds
  Velocity made;    ///< within the bounds
  double steering;
};
Driven Drive(DriveFunction drive, const DriveInput& input);

/// Watts that a robot of this mass (kg) draws at a velocity.
inline double PowerAt(double mass, const Velocity& v) {
  return 1.0 + 10.0 * mass * (std::fabs(v.x) + std::fabs(v.y) + std::fabs(v.a));
}
/// Watts that a drive draws for a command; not finite if the command is not. Uses the velocity
/// before the bounds, as Stage 4.3 does, unless that is infinite or, if accelerations are limited,
/// only aimed at.
inline double PowerOf(const Driven& driven, double mass, bool limits_acceleration) {
  const double power = PowerAt(mass, driven.wanted);
  return limits_acceleration || !std::isfinite(power) ? PowerAt(mass, driven.made) : power;
}

}  // namespace motion
}  // namespace Stg

#endif
