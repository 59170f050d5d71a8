/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The arithmetic of ranges in both ray models: the functions of sensing/middle.hh and
 * sensing/crossing.hh. Compiled after row_math.h.
 */
#ifndef STAGE_KERNELS_ROW_RANGES_H
#define STAGE_KERNELS_ROW_RANGES_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_math.h"
namespace Stg {
#endif

/* ---- the cell model ----------------------------------------------------------------------- */

RAY_FUNCTION double row_larger_quotient(int a, int across, int b, int along) {
  const int first = along == 0 || (across != 0 && ray_product(a, along) > ray_product(b, across));
  return first ? (double)a / across : (double)b / along;
}

/* A compiler option may define it otherwise, to test that ranges of such a device are not used. */
#ifndef ROW_HALF
#define ROW_HALF 0.5
#endif

/* See MiddleOf(). */
RAY_FUNCTION double row_middle(int in_x, int in_y, int across, int along) {
  double in, out;
  if ((across | along) == 0) return ROW_HALF;
  in = row_larger(0.0, row_larger_quotient(in_x, across, in_y, along));
  out = row_smaller(1.0, -row_larger_quotient(-(in_x + 65536), across, -(in_y + 65536), along));
  return ROW_HALF * (in + out);
}

/* ---- the exact model ---------------------------------------------------------------------- */

/* See Line and RelativeCorner. */
typedef struct {
  double x, y;
  row_turn_t direction;
} row_line_t;
typedef struct {
  double along, side, error_bound;
} row_relative_corner_t;

/* See LineOf(). */
RAY_FUNCTION row_line_t row_line_from(double x, double y, row_turn_t heading,
                                      row_turn_t unit_vector) {
  row_line_t line;
  line.x = x;
  line.y = y;
  line.direction.sine = heading.sine * unit_vector.cosine + heading.cosine * unit_vector.sine;
  line.direction.cosine = heading.cosine * unit_vector.cosine - heading.sine * unit_vector.sine;
  return line;
}

RAY_FUNCTION row_relative_corner_t row_locate(row_line_t line, row_point_t p) {
  const double dx = p.x - line.x, dy = p.y - line.y;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  row_relative_corner_t corner;
  corner.along = line.direction.cosine * dx + line.direction.sine * dy;
  corner.error_bound =
      8 * (1.0 / 4503599627370496.0) * (fabs(p.x) + fabs(p.y) + fabs(line.x) + fabs(line.y));
  corner.side = fabs(side) <= corner.error_bound ? 0.0 : side;
  return corner;
}

/* Distance at which the edge crosses the line; negative behind the start. */
RAY_FUNCTION double row_along(row_relative_corner_t a, row_relative_corner_t b) {
  if (a.side == 0) return b.side == 0 ? row_smaller(a.along, b.along) : a.along;
  if (b.side == 0) return b.along;
  return a.along + (b.along - a.along) * (a.side / (a.side - b.side));
}

RAY_FUNCTION double row_crossing(row_relative_corner_t a, row_relative_corner_t b) {
  double along, bound, across, length;
  if ((a.side > 0 && b.side > 0) || (a.side < 0 && b.side < 0)) return row_infinity();
  along = row_along(a, b);
  if (along >= 0) return along;
  /* It lies behind the start, which may be rounding. */
  bound = row_larger(a.error_bound, b.error_bound);
  across = fabs(a.side - b.side);
  length = across + fabs(a.along - b.along);
  if (across == 0) return row_larger(a.along, b.along) >= -bound ? 0.0 : row_infinity();
  return -along * across <= bound * length ? 0.0 : row_infinity();
}

/* See FirstCrossing(). */
RAY_FUNCTION double row_first_crossing(row_line_t line, RAY_GLOBAL const row_point_t* points,
                                       ray_uint edges) {
  double nearest = row_infinity();
  row_relative_corner_t from, to;
  ray_uint i;
  int is_located = 0;
  for (i = 0; edges != 0; i++, edges >>= 1) {
    if ((edges & 1) == 0) {
      is_located = 0;
      continue;
    }
    from = is_located ? to : row_locate(line, points[i]);
    to = row_locate(line, points[i + 1]);
    is_located = 1;
    nearest = row_smaller(nearest, row_crossing(from, to));
  }
  return nearest;
}

/* See PassesBy(). */
RAY_FUNCTION int row_passes_by(row_line_t line, double x, double y, double radius, double end) {
  const double dx = x - line.x, dy = y - line.y;
  const double along = line.direction.cosine * dx + line.direction.sine * dy;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  const double reach = radius + 1e-9 + 1e-13 * (fabs(x) + fabs(y) + fabs(line.x) + fabs(line.y));
  return fabs(side) > reach || along + reach < 0 || along - reach > end;
}

RAY_FUNCTION int row_is_within(double along, double range) {
  return along <= range && row_is_finite(along);
}

/* Limit for ray_t after this fraction of a leg of `size`. See BorderLimit(). */
RAY_FUNCTION int row_border_limit(double fraction, int size, int limit) {
  const int border = (int)(fraction * size) + 1;
  return border < limit ? border : limit;
}

RAY_FUNCTION int row_is_past_limits(const ray_t* walk, int u, int v) {
  return (u << 16) - walk->ox > walk->limit_x || (v << 16) - walk->oy > walk->limit_y;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
