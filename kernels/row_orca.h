/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Optimal reciprocal collision avoidance: J. van den Berg, S. J. Guy, M. Lin and D. Manocha,
 * "Reciprocal n-body collision avoidance", 2011. Compiled after row_pedestrian.h.
 *
 * Each other robot, and each thing seen, allows a half-plane of velocities. Of those in all
 * half-planes, the nearest to the wanted velocity is chosen; if there are none, the one that
 * violates the half-planes least.
 */
#ifndef STAGE_KERNELS_ROW_ORCA_H
#define STAGE_KERNELS_ROW_ORCA_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_pedestrian.h"
namespace Stg {
#endif

#define ROW_MOST_PLANES 16u
#define ROW_CLEARANCE 0.05   /* m: robots keep this distance from what they evade */
#define ROW_PARALLEL 1e-9    /* sine of the angle below which lines count as parallel */
#define ROW_KEEPS_RIGHT 0.02 /* rad: robots that meet head-on pass each other on the left side */

/* The velocities v with normal * v >= least. */
typedef struct {
  row_point_t normal;
  double least; /* m/s */
  double gap;   /* m: to the robot or thing */
} row_plane_t;

/* The half-planes of the nearest robots and things, the nearest first. */
typedef struct {
  ray_uint count, most;
  row_plane_t plane[ROW_MOST_PLANES];
} row_planes_t;

/* Something that a robot meets, seen from where it will be when its next command begins. */
typedef struct {
  row_point_t way, velocity; /* m; relative to it, m/s: positive if they approach */
  double touch, time;        /* m: they touch at this distance; s: the horizon */
  double share;              /* of the change that avoids the collision */
} row_encounter_t;

/* ---- half-planes -------------------------------------------------------------------------- */

/* The normal of the velocity obstacle where it is nearest to the relative velocity. *excess: how
 * far the velocity is inside, m/s. Returns zero if there is none.
 *
 * The obstacle is a disc, that of collisions exactly after the horizon, and the cone behind it. */
RAY_FUNCTION row_point_t row_way_out(const row_encounter_t* met, double interval, double* excess) {
  const double distance = row_length(met->way);
  const int overlaps = distance <= met->touch;
  const double time = overlaps ? interval : met->time;
  const row_point_t from_disc = row_minus(met->velocity, row_times(1 / time, met->way));
  const double length = row_length(from_disc), ahead = row_dot(from_disc, met->way);
  const double reach = met->touch * length;
  row_point_t unit, normal;
  double sine, cosine;
  *excess = met->touch / time - length;
  if (overlaps || (ahead < 0 && ahead * ahead > reach * reach))
    return length > 0 ? row_times(1 / length, from_disc) : row_point(0, 0);
  unit = row_times(1 / distance, met->way);
  sine = met->touch / distance;
  cosine = sqrt(1 - sine * sine);
  if (!(row_cross(met->way, met->velocity) > 0)) cosine = -cosine;
  normal = row_minus(row_times(cosine, row_left(unit)), row_times(sine, unit));
  *excess = -row_dot(normal, met->velocity);
  return normal;
}

/* Adds the half-plane of what a robot with the velocity `own` meets. */
RAY_FUNCTION void row_add_encounter(row_planes_t* planes, const row_encounter_t* met,
                                    row_point_t own, double interval) {
  ray_uint i = planes->count;
  row_plane_t plane;
  double excess;
  plane.gap = row_length(met->way) - met->touch;
  if (i == planes->most && !(plane.gap < planes->plane[--i].gap)) return;
  plane.normal = row_way_out(met, interval, &excess);
  if (plane.normal.x == 0 && plane.normal.y == 0) return;
  plane.least = row_dot(plane.normal, own) + met->share * excess;
  if (i == planes->count) planes->count++;
  for (; i > 0 && plane.gap < planes->plane[i - 1].gap; i--)
    planes->plane[i] = planes->plane[i - 1];
  planes->plane[i] = plane;
}

/* ---- linear programs ---------------------------------------------------------------------- */

/* Finds the velocity on the border of a half-plane that is nearest to the wanted one, or farthest
 * in its direction, among those that the half-planes before it and the speed allow. Returns 0 if
 * they allow none. */
RAY_FUNCTION int row_slide_along(const row_plane_t* planes, ray_uint index, double speed,
                                 row_point_t wanted, int is_direction, row_point_t* velocity) {
  const row_plane_t border = planes[index];
  const row_point_t along = row_point(border.normal.y, -border.normal.x);
  const row_point_t foot = row_times(border.least, border.normal);
  const double room = speed * speed - border.least * border.least;
  double low, high, place = row_dot(along, wanted);
  ray_uint i;
  if (!(room >= 0)) return 0;
  high = sqrt(room);
  low = -high;
  for (i = 0; i < index; i++) {
    const double slope = row_dot(planes[i].normal, along);
    const double rest = planes[i].least - row_dot(planes[i].normal, foot);
    if (fabs(slope) <= ROW_PARALLEL) {
      if (rest > 0) return 0;
    } else if (slope > 0) {
      low = row_larger(low, rest / slope);
    } else {
      high = row_smaller(high, rest / slope);
    }
  }
  if (low > high) return 0;
  if (is_direction)
    place = place > 0 ? high : low;
  else
    place = row_constrain(place, low, high);
  *velocity = row_plus(foot, row_times(place, along));
  return 1;
}

/* Finds the allowed velocity that is nearest to the wanted one, or farthest in its direction.
 * Returns the index of the first half-plane that leaves none, otherwise their number. */
RAY_FUNCTION ray_uint row_allowed(const row_plane_t* planes, ray_uint count, double speed,
                                  row_point_t wanted, int is_direction, row_point_t* velocity) {
  const double length = row_length(wanted);
  ray_uint i;
  *velocity = is_direction || length > speed ? row_times(speed / length, wanted) : wanted;
  for (i = 0; i < count; i++)
    if (row_dot(planes[i].normal, *velocity) < planes[i].least &&
        !row_slide_along(planes, i, speed, wanted, is_direction, velocity))
      return i;
  return count;
}

/* Finds the velocity whose greatest violation of a half-plane is least. Those before `first` are
 * not violated by *velocity. */
RAY_FUNCTION void row_violate_least(const row_planes_t* planes, ray_uint first, double speed,
                                    row_point_t* velocity) {
  row_plane_t equal[ROW_MOST_PLANES]; /* where others are not violated more than this one */
  double violation = 0;
  ray_uint i, k;
  for (i = first; i < planes->count; i++) {
    const row_plane_t worst = planes->plane[i];
    row_point_t next;
    ray_uint count = 0;
    if (!(worst.least - row_dot(worst.normal, *velocity) > violation)) continue;
    for (k = 0; k < i; k++) {
      const row_point_t normal = row_minus(planes->plane[k].normal, worst.normal);
      const double length = row_length(normal);
      if (length <= ROW_PARALLEL) continue;
      equal[count].normal = row_times(1 / length, normal);
      equal[count].least = (planes->plane[k].least - worst.least) / length;
      count++;
    }
    if (row_allowed(equal, count, speed, worst.normal, 1, &next) == count) *velocity = next;
    violation = worst.least - row_dot(worst.normal, *velocity);
  }
}

/* ---- the rule ----------------------------------------------------------------------------- */

/* The robot itself. */
typedef struct {
  double speed, radius, interval; /* m/s, m, s */
} row_mobility_t;

RAY_FUNCTION void row_evade_robots(RAY_GLOBAL const row_evader_t* rule, const row_mobility_t* body,
                                   const row_company_t* all, row_planes_t* planes) {
  const row_planar_t at = all->poses[all->own], v = all->velocities[all->own];
  const double dt = body->interval;
  row_encounter_t met;
  ray_uint i;
  met.touch = 2 * body->radius + ROW_CLEARANCE;
  met.time = rule->time;
  met.share = 0.5;
  for (i = 0; i < all->count; i++) {
    const row_planar_t other = all->poses[i], its = all->velocities[i];
    if (i == all->own) continue;
    met.velocity = row_point(v.x - its.x, v.y - its.y);
    met.way = row_point(other.x - at.x - met.velocity.x * dt, other.y - at.y - met.velocity.y * dt);
    if (row_dot(met.way, met.way) > rule->range * rule->range) continue;
    row_add_encounter(planes, &met, row_way(v), dt);
  }
}

RAY_FUNCTION void row_evade_things(RAY_GLOBAL const row_evader_t* rule, const row_mobility_t* body,
                                   row_eye_t eye, RAY_GLOBAL const row_turn_t* turns,
                                   RAY_GLOBAL const double* ranges, const row_company_t* all,
                                   row_planes_t* planes) {
  const row_planar_t at = all->poses[all->own], v = all->velocities[all->own];
  const row_turn_t heading = row_turn(at.a);
  row_encounter_t met;
  ray_uint i;
  met.velocity = row_way(v);
  met.touch = body->radius + ROW_CLEARANCE;
  met.time = rule->wall_time;
  met.share = 1;
  for (i = eye.begin; i < eye.end; i++) {
    row_point_t seen;
    if (!row_is_nearest_ray(eye, ranges, i)) continue;
    seen = row_point_of_ray(eye, ranges[i], turns[i], heading);
    met.way = row_minus(seen, row_times(body->interval, met.velocity));
    if (row_dot(met.way, met.way) > rule->range * rule->range ||
        row_is_of_robot(all, body->radius, row_plus(row_point(at.x, at.y), seen)))
      continue;
    row_add_encounter(planes, &met, met.velocity, body->interval);
  }
}

/* The velocity, m/s, that avoids collisions with robots and with what rangers see. */
RAY_FUNCTION row_point_t row_evade(RAY_GLOBAL const row_evader_t* rule, const row_mobility_t* body,
                                   RAY_GLOBAL const row_layout_t* layout,
                                   RAY_GLOBAL const double* ranges, const row_company_t* all,
                                   row_point_t wanted) {
  row_planes_t planes;
  row_point_t velocity;
  ray_uint i, failed;
  planes.count = 0;
  planes.most = (ray_uint)rule->most;
  row_evade_robots(rule, body, all, &planes);
  for (i = 0; i < layout->eye_count; i++)
    row_evade_things(rule, body, ROW_OF_LAYOUT(layout, row_eye_t, eyes)[i],
                     ROW_OF_LAYOUT(layout, row_turn_t, turns), ranges, all, &planes);
  if (planes.count > 0) wanted = row_minus(wanted, row_times(ROW_KEEPS_RIGHT, row_left(wanted)));
  failed = row_allowed(planes.plane, planes.count, body->speed, wanted, 0, &velocity);
  if (failed < planes.count) row_violate_least(&planes, failed, body->speed, &velocity);
  return velocity;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
