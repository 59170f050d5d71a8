/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Vectors in the plane and motions: libstage/motion/vector.hh. Compiled after row_math.h.
 */
#ifndef STAGE_KERNELS_ROW_VECTOR_H
#define STAGE_KERNELS_ROW_VECTOR_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_math.h"
namespace Stg {
#endif

RAY_FUNCTION row_point_t row_point(double x, double y) {
  row_point_t p;
  p.x = x;
  p.y = y;
  return p;
}
RAY_FUNCTION row_point_t row_plus(row_point_t a, row_point_t b) {
  return row_point(a.x + b.x, a.y + b.y);
}
RAY_FUNCTION row_point_t row_minus(row_point_t a, row_point_t b) {
  return row_point(a.x - b.x, a.y - b.y);
}
RAY_FUNCTION row_point_t row_opposite(row_point_t a) { return row_point(-a.x, -a.y); }
RAY_FUNCTION row_point_t row_times(double k, row_point_t a) { return row_point(k * a.x, k * a.y); }
RAY_FUNCTION double row_dot(row_point_t a, row_point_t b) { return a.x * b.x + a.y * b.y; }
RAY_FUNCTION double row_cross(row_point_t a, row_point_t b) { return a.x * b.y - a.y * b.x; }
RAY_FUNCTION double row_length(row_point_t a) { return sqrt(row_dot(a, a)); }
RAY_FUNCTION row_point_t row_left(row_point_t a) { return row_point(-a.y, a.x); }
RAY_FUNCTION row_point_t row_turned(row_point_t a, row_turn_t turn) {
  return row_point(turn.cosine * a.x - turn.sine * a.y, turn.sine * a.x + turn.cosine * a.y);
}
RAY_FUNCTION double row_clamp(double a, double low, double high) {
  return row_smaller(row_larger(a, low), high);
}

/* ---- motions: a displacement and a turn, see motion::Motion --------------------------------- */

RAY_FUNCTION row_planar_t row_planar(double x, double y, double a) {
  row_planar_t p;
  p.x = x;
  p.y = y;
  p.a = a;
  return p;
}
RAY_FUNCTION row_point_t row_way(row_planar_t motion) { return row_point(motion.x, motion.y); }
RAY_FUNCTION row_planar_t row_part_of(row_planar_t motion, double part) {
  return row_planar(part * motion.x, part * motion.y, part * motion.a);
}
RAY_FUNCTION int row_are_equal(row_planar_t a, row_planar_t b) {
  return a.x == b.x && a.y == b.y && a.a == b.a;
}
/* See motion::Distance(). */
RAY_FUNCTION double row_distance(row_planar_t a, row_planar_t b, double arm) {
  const double x = a.x - b.x, y = a.y - b.y, turn = arm * (a.a - b.a);
  return sqrt(x * x + y * y + turn * turn);
}
/* The greatest distance by which a motion takes a corner from its place. */
RAY_FUNCTION double row_farthest(row_planar_t motion, double core) {
  return sqrt(motion.x * motion.x + motion.y * motion.y) + row_smaller(fabs(motion.a), 2.0) * core;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
