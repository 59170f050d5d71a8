// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives: functions from a command to a velocity, one for each kind of robot base. Part of
// <stage.hh>; C++11.
//
// A plug-in registers a drive of its own, and robots with `drive "tricycle"` use it:
//
//   static const bool registered = Stg::RegisterDrive("tricycle", DriveTricycle);
//
// See examples/drive and docs/motion.md.

#ifndef STAGE_MOTION_DRIVE_HH
#define STAGE_MOTION_DRIVE_HH

#include <string>

#include "geometry/geometry.hh"

namespace Stg {

/// Everything that a drive may use. Velocities are in the body frame: m/s forwards, to the left and
/// upwards, rad/s counter-clockwise.
struct DriveInput {
  enum Mode { kAcceleration, kVelocity, kPosition };

  Mode mode;
  /// By mode: an acceleration per second, a velocity, or a goal in the frame of `estimate`. It is
  /// not clipped and may be infinite, but not NaN; goals are finite.
  Pose command;
  Velocity velocity;  ///< in force, as the drive's last output after all bounds
  /// Estimated pose; given to built-in drives only for commands of position.
  Pose estimate;
  /// Steering angle after the last call, rad. A drive without steering may keep any other number.
  double steering;
  double dt;                 ///< seconds since the last call; may be 0
  double wheelbase;          ///< metres, above 0
  double steering_limit;     ///< largest steering angle to either side, rad; may be infinite
  double steering_rate;      ///< largest change of the steering angle, rad/s; may be infinite
  bool commands_turn;        ///< car_command "turn": a car's command has a turn rate, not an angle
  bool limits_acceleration;  ///< acceleration_bounds limit commands of every mode
  const Bounds* velocity_bounds;      ///< four: x, y, z, turn
  const Bounds* acceleration_bounds;  ///< four, per second

  DriveInput()
      : mode(kVelocity),
        steering(0),
        dt(0),
        wheelbase(1),
        steering_limit(0),
        steering_rate(0),
        commands_turn(false),
        limits_acceleration(false),
        velocity_bounds(nullptr),
        acceleration_bounds(nullptr) {}
};

struct DriveOutput {
  /// Wanted velocity. The caller clips it to the velocity bounds and, if limits_acceleration, to
  /// the acceleration bounds. NaN stops the robot.
  Velocity velocity;
  double steering;  ///< for the next call; NaN: as before
  /// True if the turn rate must be `curvature` times the forward speed, also after that speed has
  /// been clipped. The turn rate is then only clipped to the velocity bounds.
  bool is_steered;
  double curvature;  ///< radians per metre

  DriveOutput() : steering(0), is_steered(false), curvature(0) {}
};

/// A pure function: the output must depend on the input alone. Several threads call it at once for
/// different robots, and again for the same input when a world is restored.
typedef DriveOutput (*DriveFunction)(const DriveInput& input);

/// Registers a drive for the lifetime of the process. Can be called at any time from any thread.
/// Returns false with a message if the name is taken: "diff", "omni" and "car" are built in.
bool RegisterDrive(const std::string& name, DriveFunction function);

}  // namespace Stg

#endif
