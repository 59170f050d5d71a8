/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * From commands to velocities, and from velocities to odometry: the functions of libstage/motion
 * and of Rows::Stepper. Compiled after row_access.h.
 */
#ifndef STAGE_KERNELS_ROW_DRIVE_H
#define STAGE_KERNELS_ROW_DRIVE_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_access.h"
namespace Stg {
#endif

/* Parameters of position control, see motion/drive.cc. */
#define ROW_MAX_APPROACH 0.4
#define ROW_MAX_TURN 1.0
#define ROW_CLOSE_ENOUGH 0.02
#define ROW_FACING (ROW_PI / 16.0)

/* See DriveInput and DriveOutput. */
typedef struct {
  RAY_GLOBAL const row_mover_t* mover;
  RAY_GLOBAL const row_properties_t* own;
  ray_uint mode;
  row_planar_t command, velocity, estimate;
  double steering, dt;
} row_drive_input_t;
typedef struct {
  row_planar_t velocity;
  double steering, curvature;
  int is_steered;
} row_drive_output_t;

RAY_FUNCTION double row_symmetric(double value, double limit) {
  return row_constrain(value, -limit, limit);
}

/* ---- drives ------------------------------------------------------------------------------- */

RAY_FUNCTION double row_approach_speed(const row_drive_input_t* in, row_bounds_t acceleration,
                                       double error, double limit) {
  const double speed = row_symmetric(error, limit);
  const double braking = error > 0 ? -acceleration.min : acceleration.max;
  if ((in->mover->flags & ROW_LIMITS_ACCELERATION) == 0) return speed;
  return row_symmetric(speed, sqrt(row_larger(0.0, 2 * braking * fabs(error))));
}

RAY_FUNCTION double row_turn_towards(const row_drive_input_t* in, double angle) {
  return row_approach_speed(in, in->own->acceleration[ROW_TURN_AXIS], angle, ROW_MAX_TURN);
}

RAY_FUNCTION row_planar_t row_approach_differentially(const row_drive_input_t* in) {
  const double ex = in->command.x - in->estimate.x, ey = in->command.y - in->estimate.y;
  double off_course, distance, speed;
  if (fabs(ex) < ROW_CLOSE_ENOUGH && fabs(ey) < ROW_CLOSE_ENOUGH)
    return row_planar(0, 0, row_turn_towards(in, row_normalize(in->command.a - in->estimate.a)));
  off_course = row_normalize(row_arc_tangent(ey, ex) - in->estimate.a);
  distance = sqrt(ex * ex + ey * ey);
  speed = fabs(off_course) < ROW_FACING
              ? row_approach_speed(in, in->own->acceleration[0], distance, ROW_MAX_APPROACH)
              : 0.0;
  return row_planar(speed, 0, row_turn_towards(in, off_course));
}

RAY_FUNCTION row_planar_t row_approach_in_any_direction(const row_drive_input_t* in) {
  const double ex = in->command.x - in->estimate.x, ey = in->command.y - in->estimate.y;
  const row_turn_t turn = row_turn(-in->estimate.a);
  const double x = ex * turn.cosine - ey * turn.sine, y = ex * turn.sine + ey * turn.cosine;
  return row_planar(row_approach_speed(in, in->own->acceleration[0], x, ROW_MAX_APPROACH),
                    row_approach_speed(in, in->own->acceleration[1], y, ROW_MAX_APPROACH),
                    row_turn_towards(in, row_normalize(in->command.a - in->estimate.a)));
}

/* The velocity after an acceleration, within the bounds, for a time. */
RAY_FUNCTION double row_accelerated(double velocity, row_bounds_t bounds, double acceleration,
                                    double dt) {
  return velocity + row_larger(bounds.min, row_smaller(bounds.max, acceleration)) * dt;
}

RAY_FUNCTION row_planar_t row_drive_by_wheels(const row_drive_input_t* in) {
  const int is_omni = in->mover->drive == ROW_OMNI;
  row_planar_t v = in->velocity;
  if (in->mode == ROW_VELOCITY_MODE)
    return row_planar(in->command.x, is_omni ? in->command.y : 0.0, in->command.a);
  if (in->mode == ROW_POSITION_MODE)
    return is_omni ? row_approach_in_any_direction(in) : row_approach_differentially(in);
  v.x = row_accelerated(v.x, in->own->acceleration[0], in->command.x, in->dt);
  v.y = is_omni ? row_accelerated(v.y, in->own->acceleration[1], in->command.y, in->dt) : 0.0;
  v.a = row_accelerated(v.a, in->own->acceleration[ROW_TURN_AXIS], in->command.a, in->dt);
  return v;
}

/* The steering angle after dt, on the way to that of the command. */
RAY_FUNCTION double row_steering(const row_drive_input_t* in) {
  RAY_GLOBAL const row_properties_t* const car = in->own;
  const double speed = in->command.x, side = in->command.a * car->wheelbase;
  double wanted = in->command.a, change;
  if ((in->mover->flags & ROW_COMMANDS_TURN) != 0)
    wanted = speed == 0 ? in->steering : row_arc_tangent(speed < 0 ? -side : side, fabs(speed));
  wanted = row_symmetric(wanted, car->steering_limit);
  if (row_is_infinite(car->steering_rate)) return wanted;
  change = car->steering_rate * in->dt;
  return row_constrain(wanted, in->steering - change, in->steering + change);
}

/* See DriveCar() in motion/drive.cc. */
RAY_FUNCTION void row_drive_car(const row_drive_input_t* in, row_drive_output_t* out) {
  RAY_GLOBAL const row_properties_t* const car = in->own;
  const ray_uint flags = in->mover->flags;
  const int moves = in->mode == ROW_VELOCITY_MODE;
  const int commands_turn = (flags & ROW_COMMANDS_TURN) != 0;
  row_turn_t steering;
  if (in->mode == ROW_ACCELERATION_MODE) {
    out->velocity = in->velocity;
    return;
  }
  if (moves) out->steering = row_steering(in);
  steering = row_turn(out->steering);
  if (moves && !commands_turn)
    out->velocity = row_planar(in->command.x * steering.cosine, 0,
                               in->command.x * steering.sine / car->wheelbase);
  if (moves && commands_turn) out->velocity.x = in->command.x;
  out->is_steered = commands_turn || (flags & ROW_LIMITS_ACCELERATION) != 0 ||
                    !row_is_infinite(car->steering_limit) || !row_is_infinite(car->steering_rate);
  if (out->is_steered) {
    out->curvature = steering.sine / steering.cosine / car->wheelbase;
    out->velocity.a = out->curvature == 0 ? 0 : out->velocity.x * out->curvature;
  }
}

/* ---- bounds ------------------------------------------------------------------------------- */

RAY_FUNCTION double row_clipped(double value, row_bounds_t bounds) {
  return row_constrain(value, bounds.min, bounds.max);
}
RAY_FUNCTION double row_within_acceleration(double dt, row_bounds_t bounds, double wanted,
                                            double now) {
  if (!(dt > 0)) return now;
  return row_constrain(wanted, now + bounds.min * dt, now + bounds.max * dt);
}

/* See motion::Bounded(). */
RAY_FUNCTION row_planar_t row_bounded(const row_drive_input_t* in, const row_drive_output_t* out) {
  RAY_GLOBAL const row_properties_t* const own = in->own;
  const row_bounds_t turn = own->velocity[ROW_TURN_AXIS];
  row_planar_t v;
  v.x = row_clipped(out->velocity.x, own->velocity[0]);
  v.y = row_clipped(out->velocity.y, own->velocity[1]);
  v.a = row_clipped(out->velocity.a, turn);
  if ((in->mover->flags & ROW_LIMITS_ACCELERATION) != 0) {
    v.x = row_within_acceleration(in->dt, own->acceleration[0], v.x, in->velocity.x);
    v.y = row_within_acceleration(in->dt, own->acceleration[1], v.y, in->velocity.y);
    if (!out->is_steered)
      v.a = row_within_acceleration(in->dt, own->acceleration[ROW_TURN_AXIS], v.a, in->velocity.a);
  }
  if (out->is_steered) v.a = row_clipped(v.x * out->curvature, turn);
  return v;
}

RAY_FUNCTION int row_has_nan(row_planar_t v) {
  return row_is_nan(v.x) || row_is_nan(v.y) || row_is_nan(v.a);
}

RAY_FUNCTION double row_power_at(double mass, row_planar_t v) {
  return 1.0 + 10.0 * mass * (fabs(v.x) + fabs(v.y) + fabs(v.a));
}

/* Sets velocity and power. See Rows::Stepper::UseVelocity(). */
RAY_FUNCTION void row_use_velocity(const row_world_t* w, ray_uint index, row_planar_t wanted,
                                   row_planar_t made, int limits_acceleration) {
  const double mass = row_properties(w, index)->mass;
  double watts = row_power_at(mass, wanted);
  if (limits_acceleration || !row_is_finite(watts)) watts = row_power_at(mass, made);
  if (row_is_finite(watts)) ROW_COLUMN(w, double, ROW_WATTS)[index] = watts;
  ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index] = made;
}

/* See Rows::Stepper::ObeyVelocity(). */
RAY_FUNCTION void row_obey_velocity(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_mover_t* const mover = ROW_PART(w, row_mover_t, ROW_MOVERS) + index;
  RAY_GLOBAL const row_properties_t* const own = row_properties(w, index);
  row_planar_t wanted = ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[index];
  if (mover->drive != ROW_OMNI) wanted.y = 0;
  row_use_velocity(
      w, index, wanted,
      row_planar(row_clipped(wanted.x, own->velocity[0]), row_clipped(wanted.y, own->velocity[1]),
                 row_clipped(wanted.a, own->velocity[ROW_TURN_AXIS])),
      0);
}

/* See Rows::Stepper::EstimateOf(). */
RAY_FUNCTION row_planar_t row_estimate_of(const row_world_t* w, ray_uint index) {
  row_planar_t before, next;
  if ((ROW_PART(w, row_mover_t, ROW_MOVERS)[index].flags & ROW_HAS_ODOMETRY) == 0)
    return ROW_COLUMN(w, row_planar_t, ROW_SENSED)[index];
  before = ROW_COLUMN(w, row_planar_t, ROW_ESTIMATE)[index];
  next = row_sum(before, ROW_COLUMN(w, row_planar_t, ROW_DRIVEN)[index]);
  return row_is_finite_pose(next) ? next : before;
}

/* The estimate of the last update. See RobotView::GetEstimate(). */
RAY_FUNCTION row_planar_t row_known_estimate(const row_world_t* w, ray_uint index) {
  const ray_uint flags = ROW_PART(w, row_mover_t, ROW_MOVERS)[index].flags;
  return ROW_COLUMN(w, row_planar_t,
                    (flags & ROW_HAS_ODOMETRY) != 0 ? ROW_ESTIMATE : ROW_SENSED)[index];
}

/* See motion::Drive(). */
RAY_FUNCTION void row_drive_by(const row_world_t* w, ray_uint index, row_drive_input_t* in) {
  const int steers = in->mover->drive == ROW_CAR;
  row_drive_output_t out;
  double steering;
  out.velocity = row_planar(0, 0, 0);
  out.steering = steers ? in->steering : 0;
  out.curvature = 0;
  out.is_steered = 0;
  if (steers)
    row_drive_car(in, &out);
  else
    out.velocity = row_drive_by_wheels(in);
  steering = row_is_nan(out.steering) ? in->steering : out.steering;
  if (row_has_nan(out.velocity)) {
    out.velocity = row_planar(0, 0, 0);
    out.curvature = 0;
    out.is_steered = 0;
  }
  if (steers) ROW_COLUMN(w, double, ROW_STEERING)[index] = steering;
  {
    const row_planar_t bounded = row_bounded(in, &out);
    row_use_velocity(w, index, out.velocity, row_has_nan(bounded) ? row_planar(0, 0, 0) : bounded,
                     (in->mover->flags & ROW_LIMITS_ACCELERATION) != 0);
  }
}

/* See Rows::Stepper::Drive(). */
RAY_FUNCTION void row_drive(const row_world_t* w, ray_uint index, double dt) {
  row_drive_input_t in;
  in.mover = ROW_PART(w, row_mover_t, ROW_MOVERS) + index;
  if (in.mover->drive == ROW_NO_DRIVE) return;
  in.own = row_properties(w, index);
  if (in.mover->pack != ROW_NONE && ROW_COLUMN(w, double, ROW_STORED)[in.mover->pack] == 0) {
    const row_planar_t none = row_planar(0, 0, 0);
    ROW_COLUMN(w, double, ROW_WATTS)[index] = row_power_at(in.own->mass, none);
    ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index] = none;
    return;
  }
  in.mode = ROW_COLUMN(w, row_byte, ROW_MODE)[index];
  if ((in.mover->flags & ROW_OBEYS_VELOCITY) != 0 && in.mode == ROW_VELOCITY_MODE) {
    row_obey_velocity(w, index);
    return;
  }
  in.command = ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[index];
  in.velocity = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index];
  in.estimate = row_planar(0, 0, 0);
  if (in.mode == ROW_POSITION_MODE) in.estimate = row_estimate_of(w, index);
  in.steering = 0;
  if (in.mover->drive == ROW_CAR) in.steering = ROW_COLUMN(w, double, ROW_STEERING)[index];
  in.dt = dt;
  row_drive_by(w, index, &in);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
