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

RAY_FUNCTION row_line_t row_line_of(row_fan_t fan, row_turn_t unit_vector) {
  return row_line_from(fan.start_x, fan.start_y, fan.heading, unit_vector);
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
