/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Estimates of poses and their errors: the functions of libstage/motion/odometry.cc. Compiled after
 * row_drive.h.
 */
#ifndef STAGE_KERNELS_ROW_ODOMETRY_H
#define STAGE_KERNELS_ROW_ODOMETRY_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_drive.h"
namespace Stg {
#endif

RAY_FUNCTION row_covariance_t row_no_covariance(void) {
  row_covariance_t none;
  none.xx = none.xy = none.yy = none.xa = none.ya = none.aa = 0;
  return none;
}

/* See motion::Compose(). */
RAY_FUNCTION row_covariance_t row_compose(double heading, row_covariance_t p, row_planar_t motion,
                                          row_covariance_t q) {
  const row_turn_t turn = row_turn(heading);
  const double s = turn.sine, c = turn.cosine;
  const double dx = c * motion.x - s * motion.y, dy = s * motion.x + c * motion.y;
  row_covariance_t sum;
  sum.xx = p.xx - 2 * dy * p.xa + dy * dy * p.aa + c * c * q.xx - 2 * c * s * q.xy + s * s * q.yy;
  sum.yy = p.yy + 2 * dx * p.ya + dx * dx * p.aa + s * s * q.xx + 2 * c * s * q.xy + c * c * q.yy;
  sum.xy = p.xy + dx * p.xa - dy * p.ya - dx * dy * p.aa + c * s * (q.xx - q.yy) +
           (c * c - s * s) * q.xy;
  sum.xa = p.xa - dy * p.aa + c * q.xa - s * q.ya;
  sum.ya = p.ya + dx * p.aa + s * q.xa + c * q.ya;
  sum.aa = p.aa + q.aa;
  return sum;
}

/* See NoisyOdometry::Measure(). */
RAY_FUNCTION row_planar_t row_measure(RAY_GLOBAL row_noisy_odometry_t* odometry, row_planar_t twist,
                                      double dt, row_random_t* random, row_planar_t driven) {
  const double normal_translation = row_normal_error(random);
  const double normal_heading = row_normal_error(random);
  const double per_metre = odometry->translation_per_metre;
  const double per_radian = odometry->translation_per_radian;
  const double heading_per_metre = odometry->heading_per_metre;
  const double heading_per_radian = odometry->heading_per_radian;
  const double speed = sqrt(twist.x * twist.x + twist.y * twist.y);
  const double way = speed * dt, angle = fabs(twist.a) * dt;
  const double spread = sqrt(per_metre * per_metre * way + per_radian * per_radian * angle);
  const double heading_spread = sqrt(heading_per_metre * heading_per_metre * way +
                                     heading_per_radian * heading_per_radian * angle);
  const double x = speed > 0 ? twist.x / speed : 1.0, y = speed > 0 ? twist.y / speed : 0.0;
  const double translation = spread * normal_translation;
  const double heading = heading_spread * normal_heading, variance = spread * spread;
  const row_planar_t error = row_planar(translation * x / dt, translation * y / dt, heading / dt);
  const row_planar_t measured = row_planar(twist.x + error.x, twist.y + error.y, twist.a + error.a);
  row_covariance_t of_motion = row_no_covariance();
  odometry->twist_error[0] = error.x;
  odometry->twist_error[1] = error.y;
  odometry->twist_error[2] = 0;
  odometry->twist_error[3] = error.a;
  of_motion.xx = variance * x * x;
  of_motion.xy = variance * x * y;
  of_motion.yy = variance * y * y;
  of_motion.aa = heading_spread * heading_spread;
  odometry->driven_covariance =
      row_compose(driven.a, odometry->driven_covariance,
                  row_planar(measured.x * dt, measured.y * dt, measured.a * dt), of_motion);
  return measured;
}

/* True if the odometry of a mover with these flags has random errors in this world. See
 * Rows::Stepper::HasNoisyOdometry(). */
RAY_FUNCTION int row_has_noisy_odometry(const row_world_t* w, ray_uint index, ray_uint flags) {
  RAY_GLOBAL const row_noisy_odometry_t* const noise =
      ROW_COLUMN(w, row_noisy_odometry_t, ROW_NOISY_ODOMETRY) + index;
  if ((flags & ROW_HAS_NOISY_ODOMETRY) == 0) return 0;
  return !w->scene->varies_movers || noise->translation_per_metre != 0 ||
         noise->translation_per_radian != 0 || noise->heading_per_radian != 0 ||
         noise->heading_per_metre != 0;
}

/* See Rows::Stepper::StoreSensedPose(). */
RAY_FUNCTION void row_store_sensed_pose(const row_world_t* w, ray_uint index) {
  const ray_uint flags = ROW_PART(w, row_mover_t, ROW_MOVERS)[index].flags;
  ROW_COLUMN(w, row_planar_t, ROW_SENSED)[index] = ROW_COLUMN(w, row_planar_t, ROW_POSE)[index];
  if ((flags & ROW_HAS_ODOMETRY) == 0) return;
  if (row_has_noisy_odometry(w, index, flags)) {
    RAY_GLOBAL row_noisy_odometry_t* const odometry =
        ROW_COLUMN(w, row_noisy_odometry_t, ROW_NOISY_ODOMETRY) + index;
    odometry->covariance =
        row_compose(ROW_COLUMN(w, row_planar_t, ROW_ESTIMATE)[index].a, odometry->covariance,
                    ROW_COLUMN(w, row_planar_t, ROW_DRIVEN)[index], odometry->driven_covariance);
    odometry->driven_covariance = row_no_covariance();
  }
  ROW_COLUMN(w, row_planar_t, ROW_ESTIMATE)[index] = row_estimate_of(w, index);
  ROW_COLUMN(w, row_planar_t, ROW_DRIVEN)[index] = row_planar(0, 0, 0);
}

/* See motion::WheelVelocity(). */
RAY_FUNCTION row_planar_t row_wheel_velocity(row_planar_t made, row_planar_t command, double slip) {
  if (slip == 0) return made;
  return row_planar(made.x + slip * (command.x - made.x), made.y + slip * (command.y - made.y),
                    made.a + slip * (command.a - made.a));
}

/* Adds the motion of a step to the odometry. `made`: the velocity of the move. See
 * Rows::Stepper::NoteMotion(). */
RAY_FUNCTION void row_note_motion(const row_world_t* w, ray_uint index, row_planar_t made) {
  const ray_uint flags = ROW_PART(w, row_mover_t, ROW_MOVERS)[index].flags;
  const double seconds = w->scene->seconds;
  row_planar_t command, wheels, error, measured, before, next;
  if ((flags & ROW_HAS_ODOMETRY) == 0) return;
  command = ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[index];
  wheels = row_wheel_velocity(made, command, row_properties(w, index)->wheel_slip);
  if (row_is_zero(wheels)) return;
  error = ROW_COLUMN(w, row_planar_t, ROW_ERROR)[index];
  measured = row_planar(wheels.x * (1.0 + error.x), wheels.y * (1.0 + error.y),
                        wheels.a * (1.0 + error.a));
  before = ROW_COLUMN(w, row_planar_t, ROW_DRIVEN)[index];
  if (row_has_noisy_odometry(w, index, flags)) {
    row_random_t random = ROW_COLUMN(w, row_random_t, ROW_RANDOM)[index];
    measured = row_measure(ROW_COLUMN(w, row_noisy_odometry_t, ROW_NOISY_ODOMETRY) + index,
                           measured, seconds, &random, before);
    ROW_COLUMN(w, row_random_t, ROW_RANDOM)[index] = random;
  }
  next = row_sum(before, row_planar(measured.x * seconds, measured.y * seconds,
                                    row_normalize(measured.a * seconds)));
  if (row_is_finite_pose(next)) ROW_COLUMN(w, row_planar_t, ROW_DRIVEN)[index] = next;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
