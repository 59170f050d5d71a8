// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/drive.hh"

#include <algorithm>
#include <array>
#include <cmath>
#include <forward_list>
#include <mutex>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "motion/drive_table.hh"

namespace Stg {

namespace {

// Parameters of position control, which has a gain of 1/s.
constexpr double kMaxApproach = 0.4;     // m/s
constexpr double kMaxTurn = 1.0;         // rad/s
constexpr double kCloseEnough = 0.02;    // m, per axis
constexpr double kFacing = M_PI / 16.0;  // rad: drive forward only if the goal is within this angle

enum Axis { kX = 0, kY = 1, kTurn = 3 };  // in arrays of bounds

double Symmetric(double value, double limit) { return constrain(value, -limit, limit); }

/// The acceleration of a command, within the bounds.
double BoundedAcceleration(const DriveInput& in, Axis axis, double value) {
  const Bounds& b = in.acceleration_bounds[axis];
  return std::max(b.min, std::min(b.max, value));  // upper bound first, then lower
}

/// Speed towards a goal at distance `error`, up to `limit`. If accelerations are limited, it is
/// also the speed from which the robot can still brake.
double ApproachSpeed(const DriveInput& in, Axis axis, double error, double limit) {
  const double speed = Symmetric(error, limit);
  if (!in.limits_acceleration) return speed;
  const Bounds& b = in.acceleration_bounds[axis];
  const double braking = error > 0 ? -b.min : b.max;
  return Symmetric(speed, std::sqrt(std::max(0.0, 2 * braking * std::fabs(error))));
}

// ---- two wheels side by side --------------------------------------------------------------------

Velocity ApproachDifferentially(const DriveInput& in) {
  const Pose& here = in.estimate;
  const double ex = in.command.x - here.x, ey = in.command.y - here.y;
  if (std::fabs(ex) < kCloseEnough && std::fabs(ey) < kCloseEnough)
    return Velocity(0, 0, 0, ApproachSpeed(in, kTurn, normalize(in.command.a - here.a), kMaxTurn));
  const double off_course = normalize(ArcTangent(ey, ex) - here.a);
  const double distance = std::sqrt(ex * ex + ey * ey);
  const double speed =
      std::fabs(off_course) < kFacing ? ApproachSpeed(in, kX, distance, kMaxApproach) : 0.0;
  return Velocity(speed, 0, 0, ApproachSpeed(in, kTurn, off_course, kMaxTurn));
}

DriveOutput DriveDifferentially(const DriveInput& in) {
  DriveOutput out;
  switch (in.mode) {
    case DriveInput::kVelocity:
      out.velocity = Velocity(in.command.x, 0, 0, in.command.a);
      break;
    case DriveInput::kAcceleration:
      out.velocity = in.velocity;
      out.velocity.x += BoundedAcceleration(in, kX, in.command.x) * in.dt;
      out.velocity.y = 0;
      out.velocity.a += BoundedAcceleration(in, kTurn, in.command.a) * in.dt;
      break;
    case DriveInput::kPosition:
      out.velocity = ApproachDifferentially(in);
      break;
  }
  return out;
}

// ---- any direction ------------------------------------------------------------------------------

Velocity ApproachInAnyDirection(const DriveInput& in) {
  const Pose& here = in.estimate;
  const double ex = in.command.x - here.x, ey = in.command.y - here.y;
  const SineCosine turn = SinCos(-here.a);
  const point_t error(ex * turn.cosine - ey * turn.sine, ex * turn.sine + ey * turn.cosine);
  return Velocity(ApproachSpeed(in, kX, error.x, kMaxApproach),
                  ApproachSpeed(in, kY, error.y, kMaxApproach), 0,
                  ApproachSpeed(in, kTurn, normalize(in.command.a - here.a), kMaxTurn));
}

DriveOutput DriveInAnyDirection(const DriveInput& in) {
  DriveOutput out;
  switch (in.mode) {
    case DriveInput::kVelocity:
      out.velocity = Velocity(in.command.x, in.command.y, 0, in.command.a);
      break;
    case DriveInput::kAcceleration:
      out.velocity = in.velocity;
      out.velocity.x += BoundedAcceleration(in, kX, in.command.x) * in.dt;
      out.velocity.y += BoundedAcceleration(in, kY, in.command.y) * in.dt;
      out.velocity.a += BoundedAcceleration(in, kTurn, in.command.a) * in.dt;
      break;
    case DriveInput::kPosition:
      out.velocity = ApproachInAnyDirection(in);
      break;
  }
  return out;
}

// ---- steered front wheels -----------------------------------------------------------------------

/// Steering angle after dt on the way to `wanted`.
double SteeringTowards(const DriveInput& in, double wanted) {
  wanted = Symmetric(wanted, in.steering_limit);
  if (std::isinf(in.steering_rate)) return wanted;
  const double change = in.steering_rate * in.dt;
  return constrain(wanted, in.steering - change, in.steering + change);
}

/// Steering angle for the commanded turn rate: tan(angle) = rate * wheelbase / speed. A standing
/// car keeps its angle.
double SteeringForTurn(const DriveInput& in) {
  const double speed = in.command.x, side = in.command.a * in.wheelbase;
  if (speed == 0) return in.steering;
  return ArcTangent(speed < 0 ? -side : side, std::fabs(speed));
}

/// The kinematic bicycle; the pose is that of the middle of the rear axle (e.g. S. M. LaValle,
/// "Planning Algorithms", 2006, section 13.1.2.1). A command with a steering angle has the speed v
/// of the front wheel, as in Stage 4.3: the rear axle moves at v cos(angle) and turns at
/// v sin(angle) / wheelbase. A command with a turn rate has the speed of the rear axle.
DriveOutput DriveCar(const DriveInput& in) {
  DriveOutput out;
  out.steering = in.steering;
  if (in.mode == DriveInput::kAcceleration) {  // not for cars
    out.velocity = in.velocity;
    return out;
  }
  const bool moves = in.mode == DriveInput::kVelocity;
  if (moves)
    out.steering = SteeringTowards(in, in.commands_turn ? SteeringForTurn(in) : in.command.a);
  const SineCosine steering = SinCos(out.steering);
  if (moves && !in.commands_turn)
    out.velocity =
        Velocity(in.command.x * steering.cosine, 0, 0, in.command.x * steering.sine / in.wheelbase);
  if (moves && in.commands_turn) out.velocity.x = in.command.x;
  out.is_steered = in.commands_turn || in.limits_acceleration || !std::isinf(in.steering_limit) ||
                   !std::isinf(in.steering_rate);
  if (out.is_steered) {
    out.curvature = steering.sine / steering.cosine / in.wheelbase;
    out.velocity.a = out.curvature == 0 ? 0 : out.velocity.x * out.curvature;
  }
  return out;
}

// ---- the table ----------------------------------------------------------------------------------

using BuiltInDrives = std::array<RegisteredDrive, motion::kBuiltInDrives>;

/// A function, because static initializers of other files may register drives.
const BuiltInDrives& BuiltIn() {
  static const BuiltInDrives drives = {
      {{"diff", DriveDifferentially}, {"omni", DriveInAnyDirection}, {"car", DriveCar}}};
  return drives;
}

/// Drives of plug-ins. They are never removed, so pointers to them stay valid.
struct OwnDrives {
  std::mutex mutex;
  std::forward_list<RegisteredDrive> drives;
};

OwnDrives& Own() {
  static OwnDrives own;
  return own;
}

/// Call it with the mutex held.
const RegisteredDrive* FindAmong(const OwnDrives& own, const std::string& name) {
  const auto has_name = [&](const RegisteredDrive& drive) { return drive.name == name; };
  for (const RegisteredDrive& drive : BuiltIn())
    if (has_name(drive)) return &drive;
  const auto found = std::ranges::find_if(own.drives, has_name);
  return found == own.drives.end() ? nullptr : &*found;
}

}  // namespace

bool RegisterDrive(const std::string& name, DriveFunction function) {
  OwnDrives& own = Own();
  const std::lock_guard lock(own.mutex);
  if (FindAmong(own, name)) {
    messages::Report(LogLevel::kError, "stage: the drive " + messages::Quoted(name) +
                                           " is registered already; the first one stays");
    return false;
  }
  own.drives.push_front({name, function});
  return true;
}

namespace motion {

const RegisteredDrive& DriveOf(BuiltInDrive kind) { return BuiltIn()[kind]; }

const RegisteredDrive* FindDrive(const std::string& name) {
  OwnDrives& own = Own();
  const std::lock_guard lock(own.mutex);
  return FindAmong(own, name);
}

std::string DriveNames() {
  OwnDrives& own = Own();
  const std::lock_guard lock(own.mutex);
  std::string names;
  for (const RegisteredDrive& drive : own.drives)
    names = ", " + messages::Quoted(drive.name) + names;
  // The last of the built-in names follows the word "or" if there are no others.
  return names.empty() ? R"("diff", "omni" or "car")" : R"("diff", "omni", "car")" + names;
}

namespace {

double WithinAcceleration(const DriveInput& in, int axis, double wanted, double now) {
  const Bounds& b = in.acceleration_bounds[axis];
  if (!(in.dt > 0)) return now;
  return constrain(wanted, now + b.min * in.dt, now + b.max * in.dt);
}

}  // namespace

Velocity Bounded(const DriveInput& in, const DriveOutput& out) {
  const auto clipped = [&](int axis, double value) {
    return constrain(value, in.velocity_bounds[axis].min, in.velocity_bounds[axis].max);
  };
  Velocity v(clipped(0, out.velocity.x), clipped(1, out.velocity.y), clipped(2, out.velocity.z),
             clipped(3, out.velocity.a));
  if (in.limits_acceleration) {
    v.x = WithinAcceleration(in, 0, v.x, in.velocity.x);
    v.y = WithinAcceleration(in, 1, v.y, in.velocity.y);
    v.z = WithinAcceleration(in, 2, v.z, in.velocity.z);
    if (!out.is_steered) v.a = WithinAcceleration(in, 3, v.a, in.velocity.a);
  }
  if (out.is_steered) v.a = clipped(3, v.x * out.curvature);
  return v;
}

namespace {

bool AllNumbers(const Velocity& v) {
  return !std::isnan(v.x) && !std::isnan(v.y) && !std::isnan(v.z) && !std::isnan(v.a);
}

}  // namespace

Driven Drive(DriveFunction drive, const DriveInput& input) {
  DriveOutput output = drive(input);
  const double steering = std::isnan(output.steering) ? input.steering : output.steering;
  // For example a car with an infinite steering angle.
  if (!AllNumbers(output.velocity)) output = DriveOutput();
  const Velocity made = Bounded(input, output);
  return {output.velocity, AllNumbers(made) ? made : Velocity(), steering};
}

}  // namespace motion
}  // namespace Stg
