/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * How much of their motions two pieces can make before they come too near: the second part of
 * libstage/motion/separation.cc. Compiled after row_separation.h.
 */
#ifndef STAGE_KERNELS_ROW_SAFE_PART_H
#define STAGE_KERNELS_ROW_SAFE_PART_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_separation.h"
namespace Stg {
#endif

#define ROW_MOST_MOVED_CORNERS 32u

/* See motion::Moving. */
typedef struct {
  row_hull_t hull;
  double core;
  row_point_t center;
  row_planar_t motion;
} row_moving_t;

/* See Front. */
typedef struct {
  const row_hull_t* hull;
  row_point_t normal, velocity, center;
  double spin, curve, line;
  /* By corner, if there are few: where it is along the normal, and how fast. As copies in
   * row_core_t. */
  int is_small;
  double at[ROW_FEW_CORNERS], speed[ROW_FEW_CORNERS];
} row_front_t;

/* The room at one front, or between two. */
typedef struct {
  row_front_t first, second;
  int both;
  double edge;
} row_fronts_t;

/* See Advance. */
typedef struct {
  const row_moving_t *a, *b;
  row_separation_t strip;
  double hard, rest;
} row_advance_t;

/* Where a corner is along the normal, and how fast. */
RAY_FUNCTION double row_at(const row_front_t* front, ray_uint corner) {
  return row_dot(front->normal, front->hull->corners[corner]);
}
RAY_FUNCTION double row_speed_of(const row_front_t* front, ray_uint corner) {
  const row_point_t arm = row_minus(front->hull->corners[corner], front->center);
  return row_dot(front->normal, front->velocity) + front->spin * row_cross(arm, front->normal);
}

/* Prepares a front whose other members are set. */
RAY_FUNCTION void row_note_corners(row_front_t* front) {
  ray_uint i;
  front->is_small = front->hull->count <= ROW_FEW_CORNERS;
  if (!front->is_small) return;
  for (i = 0; i < ROW_FEW_CORNERS; i++) {
    const ray_uint corner = i < front->hull->count ? i : 0;
    front->at[i] = row_at(front, corner);
    front->speed[i] = row_speed_of(front, corner);
  }
}

RAY_FUNCTION double row_room_of(const row_front_t* front, double t) {
  double least = 1e300;
  ray_uint i;
  if (front->is_small)
    for (i = 0; i < ROW_FEW_CORNERS; i++)
      least = row_smaller(least, front->at[i] + t * front->speed[i]);
  else
    for (i = 0; i < front->hull->count; i++)
      least = row_smaller(least, row_at(front, i) + t * row_speed_of(front, i));
  return least - front->line - 0.5 * front->curve * t * t;
}

RAY_FUNCTION double row_room(const row_fronts_t* fronts, double t) {
  const double first = row_room_of(&fronts->first, t);
  return fronts->both ? first + row_room_of(&fronts->second, t) - fronts->edge : first;
}

/* See LastTimeWithRoom(). */
RAY_LARGE_FUNCTION double row_last_time_with_room(const row_fronts_t* fronts, double rest,
                                                  double room_now) {
  double low = 0.0, high = rest, at_low = room_now, at_high = row_room(fronts, rest);
  int i;
  if (at_high >= 0.0) return rest;
  for (i = 0; i < 5 && low == 0.0; i++) {
    const double t = 0.5 * high, at = row_room(fronts, t);
    if (at >= 0.0) {
      low = t;
      at_low = at;
    } else {
      high = t;
      at_high = at;
    }
  }
  for (i = 0; i < 2 && at_low > 0.0; i++) {
    const double t = low + 0.999 * (high - low) * at_low / (at_low - at_high);
    const double at = row_room(fronts, t);
    if (at < 0.0) break;
    low = t;
    at_low = at;
  }
  return low;
}

RAY_FUNCTION row_front_t row_front_in_world(const row_moving_t* piece, row_point_t normal) {
  row_front_t front;
  front.hull = &piece->hull;
  front.normal = normal;
  front.velocity = row_way(piece->motion);
  front.center = piece->center;
  front.spin = piece->motion.a;
  front.curve = piece->core * piece->motion.a * piece->motion.a;
  front.line = 0.0;
  row_note_corners(&front);
  return front;
}

/* See Advance::InWorld(). */
RAY_FUNCTION double row_part_in_world(const row_advance_t* advance) {
  row_fronts_t fronts;
  fronts.first = row_front_in_world(advance->a, row_opposite(advance->strip.normal));
  fronts.second = row_front_in_world(advance->b, advance->strip.normal);
  fronts.both = 1;
  fronts.edge = advance->hard + advance->a->hull.radius + advance->b->hull.radius;
  return row_last_time_with_room(&fronts, advance->rest, advance->strip.gap - advance->hard);
}

/* See Advance::With(). */
RAY_FUNCTION double row_part_with(const row_advance_t* advance, const row_moving_t* host,
                                  const row_moving_t* guest, row_point_t normal, ray_uint corner) {
  const row_point_t v = row_minus(row_way(guest->motion), row_way(host->motion));
  const row_point_t r = row_minus(guest->center, host->center);
  const double speed = row_length(v), w = fabs(host->motion.a);
  const double difference = guest->motion.a - host->motion.a;
  row_fronts_t fronts;
  fronts.first.hull = &guest->hull;
  fronts.first.normal = normal;
  fronts.first.velocity = row_minus(v, row_times(host->motion.a, row_left(r)));
  fronts.first.center = guest->center;
  fronts.first.spin = difference;
  fronts.first.curve =
      w * w * (row_length(r) + speed) + 2.0 * w * speed + guest->core * difference * difference;
  fronts.first.line = row_dot(normal, host->hull.corners[corner]) + advance->hard +
                      advance->a->hull.radius + advance->b->hull.radius;
  row_note_corners(&fronts.first);
  fronts.second = fronts.first;
  fronts.both = 0;
  fronts.edge = 0.0;
  return row_last_time_with_room(&fronts, advance->rest, advance->strip.gap - advance->hard);
}

/* See Advance::Part(). */
RAY_FUNCTION double row_part_of_advance(const row_advance_t* advance) {
  const row_separation_t strip = advance->strip;
  double part = row_part_in_world(advance);
  if (part < advance->rest && advance->a->motion.a != 0.0)
    part = row_larger(part, row_part_with(advance, advance->a, advance->b, strip.normal, strip.a));
  if (part < advance->rest && advance->b->motion.a != 0.0)
    part = row_larger(
        part, row_part_with(advance, advance->b, advance->a, row_opposite(strip.normal), strip.b));
  return part;
}

RAY_FUNCTION double row_gap_to_keep(double gap) {
  return gap < 0.0 ? gap - 1e-12 : row_smaller(ROW_HARD, gap);
}

/* See SafePartOfDiscs(). */
RAY_FUNCTION double row_safe_part_of_discs(const row_moving_t* a, const row_moving_t* b) {
  const row_point_t p = row_minus(b->hull.corners[0], a->hull.corners[0]);
  const row_point_t v = row_minus(row_way(b->motion), row_way(a->motion));
  const double radii = a->hull.radius + b->hull.radius;
  const double least = radii + row_gap_to_keep(row_length(p) - radii);
  const double approach = -row_dot(p, v), square = row_dot(v, v);
  double room, discriminant, t;
  if (approach <= 0.0) return 1.0;
  room = row_dot(p, p) - least * least;
  if (room <= 0.0) return 0.0;
  discriminant = approach * approach - square * room;
  if (discriminant <= 0.0) return 1.0;
  t = room / (approach + sqrt(discriminant));
  return t < 1.0 ? (1.0 - 1e-12) * t : 1.0;
}

/* Moves a piece, whose corners then are at `to`. False if they are too many. */
RAY_LARGE_FUNCTION int row_move_corners(double part, row_moving_t* piece,
                                        ROW_ROOM row_point_t* to) {
  const row_planar_t motion = piece->motion;
  row_point_t center;
  row_turn_t turn;
  ray_uint i;
  if (piece->hull.count > ROW_MOST_MOVED_CORNERS) return 0;
  turn = row_turn(part * motion.a);
  center = row_plus(piece->center, row_times(part, row_way(motion)));
  for (i = 0; i < piece->hull.count; i++)
    to[i] = row_plus(center, row_turned(row_minus(piece->hull.corners[i], piece->center), turn));
  piece->center = center;
  piece->hull.corners = to;
  return 1;
}

RAY_FUNCTION int row_goes_straight(const row_moving_t* piece) {
  return piece->hull.count == 1 && (piece->core == 0.0 || piece->motion.a == 0.0);
}

/* See motion::SafePart(). `moved`: memory for the corners of both pieces, `most` for each. */
RAY_LARGE_FUNCTION double row_safe_part(row_moving_t a, row_moving_t b, row_point_t normal,
                                        ROW_ROOM row_point_t* moved, ray_uint most) {
  const row_point_t v = row_minus(row_way(a.motion), row_way(b.motion));
  const double spin = fabs(a.motion.a) * a.core + fabs(b.motion.a) * b.core;
  double made = 0.0, guessed;
  int i;
  if (row_goes_straight(&a) && row_goes_straight(&b)) return row_safe_part_of_discs(&a, &b);
  guessed = row_gap_across(&a.hull, &b.hull, normal);
  if (guessed >= ROW_HARD && guessed - ROW_HARD >= row_dot(normal, v) + spin) return 1.0;
  for (i = 0; i < 4; i++) {
    row_advance_t advance;
    double part;
    advance.a = &a;
    advance.b = &b;
    advance.strip = row_separate(&a.hull, &b.hull, normal);
    advance.rest = 1.0 - made;
    advance.hard = row_gap_to_keep(advance.strip.gap);
    if (advance.strip.gap - advance.hard >=
        advance.rest * (row_dot(advance.strip.normal, v) + spin))
      return 1.0;
    part = row_part_of_advance(&advance);
    if (part >= advance.rest) return 1.0;
    if (part < 1e-3) break;
    made += part;
    normal = advance.strip.normal;
    if (i + 1 == 4 || !row_move_corners(part, &a, moved) ||
        !row_move_corners(part, &b, moved + most))
      break;
  }
  return made;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
