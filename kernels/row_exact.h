/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Rays of the exact model: the functions of sensing/crossing.hh and sensing/exact_visit.hh.
 * Compiled after row_walls.h.
 */
#ifndef STAGE_KERNELS_ROW_EXACT_H
#define STAGE_KERNELS_ROW_EXACT_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_walls.h"
namespace Stg {
#endif

/* See Line and RelativeCorner. */
typedef struct {
  double x, y;
  row_turn_t direction;
} row_line_t;
typedef struct {
  double along, side, error_bound;
} row_relative_corner_t;

RAY_FUNCTION row_line_t row_line_of(row_fan_t fan, row_turn_t unit_vector) {
  row_line_t line;
  line.x = fan.start_x;
  line.y = fan.start_y;
  line.direction.sine =
      fan.heading.sine * unit_vector.cosine + fan.heading.cosine * unit_vector.sine;
  line.direction.cosine =
      fan.heading.cosine * unit_vector.cosine - fan.heading.sine * unit_vector.sine;
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

/* Tests the outlines of a tile. Returns true if one is nearer than the nearest so far, whose body
 * has the number *number. See ExactVisit::TestTile(). */
RAY_FUNCTION int row_test_tile(const row_world_t* w, row_line_t line, ray_uint first,
                               row_ray_t* ray, ray_uint* number) {
  RAY_GLOBAL const row_point_t* const corners = ROW_PART(w, row_point_t, ROW_WALL_CORNERS);
  int nearer = 0;
  while (first != ROW_NONE) {
    const row_fragment_t outline = ROW_PART(w, row_fragment_t, ROW_FRAGMENTS)[first];
    const int has_hit = ray->place != ROW_NOWHERE;
    double along;
    first = outline.next;
    if (row_passes_by(line, outline.x, outline.y, outline.radius, ray->range)) continue;
    along = row_first_crossing(line, corners + outline.first_corner, outline.edges);
    if (has_hit ? !(along < ray->range || (along == ray->range && outline.number < *number))
                : !row_is_within(along, ray->range))
      continue;
    ray->range = along;
    ray->place = 0;
    ray->key = outline.model;
    ray->brightness = outline.brightness;
    *number = outline.number;
    nearer = 1;
  }
  return nearer;
}

/* Traces a ray among what stands. See ExactVisit. */
RAY_FUNCTION void row_trace_walls_exactly(const row_world_t* w, row_view_t view, row_fan_t fan,
                                          row_ray_t* ray) {
  const row_line_t line = row_line_of(fan, ray->unit_vector);
  ray_uint tested = 0, number = 0;
  ray_grid_t grid;
  ray_mask_t no_mask;
  ray_t walk;
  row_begin_walk(w, view, fan, ray->dx, ray->dy, &grid, &no_mask, &walk);
  while (ray_next(&grid, &no_mask, &walk)) {
    const ray_uint slot = walk.region * 64 + walk.tile;
    double fraction;
    if (slot == tested) continue;
    tested = slot;
    if (!row_test_tile(w, line, ROW_AT(w, ray_uint, view.of_tiles)[slot], ray, &number)) continue;
    fraction = row_constrain(ray->range / ray->reach, 0.0, 1.0);
    walk.limit_x = row_border_limit(fraction, walk.adx, walk.limit_x);
    walk.limit_y = row_border_limit(fraction, walk.ady, walk.limit_y);
    if (row_is_past_limits(&walk, walk.u + 1, walk.v) &&
        row_is_past_limits(&walk, walk.u, walk.v + 1))
      return;
  }
}

/* Places the corners of a body in metres. See Rows::Stepper::PlaceCorners(). */
RAY_FUNCTION void row_place_corners(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + index;
  RAY_GLOBAL const row_point_t* const corners =
      ROW_PART(w, row_point_t, ROW_CORNERS) + body->first_corner;
  RAY_GLOBAL row_point_t* const points =
      ROW_SCRATCH(w, row_point_t, ROW_POINTS) + body->first_point;
  row_placed_t frame;
  ray_uint i;
  row_find_place(w, body->mover, &frame);
  row_to_frame(w, body->node, &frame);
  for (i = 0; i < body->corners; i++) {
    const row_point_t p = corners[i];
    points[i].x = frame.x + p.x * frame.turn.cosine - p.y * frame.turn.sine;
    points[i].y = frame.y + p.x * frame.turn.sine + p.y * frame.turn.cosine;
  }
  points[body->corners] = points[0];
}

/* See Rows::Stepper::MeetExactly(). */
RAY_FUNCTION void row_meet_exactly(const row_world_t* w, row_fan_t fan, ray_uint number,
                                   row_planar_t at, row_ray_t* ray) {
  RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + number;
  RAY_GLOBAL const row_point_t* const points =
      ROW_SCRATCH(w, row_point_t, ROW_POINTS) + body->first_point;
  const row_line_t line = row_line_of(fan, ray->unit_vector);
  const int has_hit = ray->place != ROW_NOWHERE;
  double along = row_infinity();
  ray_uint first;
  if (row_passes_by(line, at.x, at.y, body->radius, ray->range)) return;
  for (first = 0; first < body->corners; first += 16) {
    const ray_uint count = body->corners - first < 16 ? body->corners - first : 16;
    along = row_smaller(along, row_first_crossing(line, points + first, (1u << count) - 1));
  }
  if (has_hit ? !(along < ray->range || (along == ray->range && body->model < ray->key))
              : !row_is_within(along, ray->range))
    return;
  ray->range = along;
  ray->place = 0;
  ray->key = body->model;
  ray->brightness = body->brightness;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
