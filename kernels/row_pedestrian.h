/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Social forces, the rule of stage/pedestrian. Compiled after row_control.h.
 */
#ifndef STAGE_KERNELS_ROW_PEDESTRIAN_H
#define STAGE_KERNELS_ROW_PEDESTRIAN_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_control.h"
namespace Stg {
#endif

#define ROW_MAX_SPEED 1.3 /* as a multiple of the wanted speed */
#define ROW_SIGHT_LIMIT                                                    \
  -0.17364817766693033 /* cosine of half of a field of view of 200 degrees \
                        */
#define ROW_FAR 10.0   /* repulsion ends at this multiple of its decay */

/* exp(x) for x from -20 to 20 from sums and products alone, so that it has the same bits
 * everywhere; relative error below 1e-8. */
RAY_FUNCTION double row_exponential(double x) {
  const double y = row_constrain(x, -20.0, 20.0) / 1024;
  double power = 1 + y * (1 + y / 2 * (1 + y / 3 * (1 + y / 4 * (1 + y / 5))));
  int i;
  for (i = 0; i < 10; i++) power *= power;
  return power;
}

/* The wanted direction, the force so far, and where the pedestrian is. */
typedef struct {
  row_point_t at, towards, force;
} row_social_t;

/* Adds the repulsion of something in direction (dx, dy), seen from the pedestrian. */
RAY_FUNCTION void row_repel(RAY_GLOBAL const row_walker_t* rule, double dx, double dy, double touch,
                            double strength, double reach, row_social_t* social) {
  const double distance = sqrt(dx * dx + dy * dy);
  double force;
  if (!(distance > 0) || distance > touch + ROW_FAR * reach) return;
  force = strength * row_exponential((touch - distance) / reach);
  if (social->towards.x * dx + social->towards.y * dy < ROW_SIGHT_LIMIT * distance)
    force *= rule->behind;
  social->force.x -= force * (dx / distance);
  social->force.y -= force * (dy / distance);
}

/* ---- what rangers see ---- */

/* True if a point lies on one of the other robots. */
RAY_FUNCTION int row_is_of_robot(const row_company_t* all, double robot_radius, row_point_t point) {
  const double radius = 1.5 * robot_radius;
  ray_uint i;
  for (i = 0; i < all->count; i++) {
    const double dx = all->poses[i].x - point.x, dy = all->poses[i].y - point.y;
    if (i != all->own && dx * dx + dy * dy < radius * radius) return 1;
  }
  return 0;
}

/* True if a ray meets something nearer than its neighbours do. */
RAY_FUNCTION int row_is_nearest_ray(row_eye_t eye, RAY_GLOBAL const double* ranges, ray_uint ray) {
  const double range = ranges[ray];
  return range < eye.cap && !(ray > eye.begin && !(range < ranges[ray - 1])) &&
         !(ray + 1 < eye.end && !(range <= ranges[ray + 1]));
}

/* The point that a ray meets, seen from the robot in global directions. */
RAY_FUNCTION row_point_t row_point_of_ray(row_eye_t eye, double range, row_turn_t direction,
                                          row_turn_t heading) {
  const double x = eye.x + range * direction.cosine;
  const double y = eye.y + range * direction.sine;
  return row_point(x * heading.cosine - y * heading.sine, x * heading.sine + y * heading.cosine);
}

/* Adds the repulsion of the nearest points that a sensor sees, except for those of robots. */
RAY_FUNCTION void row_repel_by_walls(RAY_GLOBAL const row_walker_t* rule,
                                     RAY_GLOBAL const row_layout_t* layout, ray_uint index,
                                     RAY_GLOBAL const double* ranges, const row_company_t* all,
                                     row_turn_t heading, row_social_t* social) {
  const row_eye_t eye = ROW_OF_LAYOUT(layout, row_eye_t, eyes)[index];
  ray_uint i;
  for (i = eye.begin; i < eye.end; i++) {
    row_point_t seen;
    if (!row_is_nearest_ray(eye, ranges, i)) continue;
    seen = row_point_of_ray(eye, ranges[i], ROW_OF_LAYOUT(layout, row_turn_t, turns)[i], heading);
    if (row_is_of_robot(all, rule->radius, row_plus(social->at, seen))) continue;
    row_repel(rule, seen.x, seen.y, rule->radius, rule->wall, rule->wall_reach, social);
  }
}

/* ---- walking ---- */

/* walk: the velocity that the forces have given it, m/s. dt: since they did, s. */
RAY_FUNCTION void row_walk_by(RAY_GLOBAL const row_walker_t* rule, double wanted_speed,
                              const row_social_t* social, double dt, int stalled,
                              RAY_GLOBAL double* walk, row_turn_t heading, row_planar_t* command) {
  double vx = stalled ? 0 : walk[0], vy = stalled ? 0 : walk[1], speed;
  vx += dt * ((social->towards.x * wanted_speed - vx) / rule->time + social->force.x);
  vy += dt * ((social->towards.y * wanted_speed - vy) / rule->time + social->force.y);
  speed = sqrt(vx * vx + vy * vy);
  if (speed > ROW_MAX_SPEED * wanted_speed) {
    vx *= ROW_MAX_SPEED * wanted_speed / speed;
    vy *= ROW_MAX_SPEED * wanted_speed / speed;
  }
  walk[0] = vx;
  walk[1] = vy;
  command->x = vx * heading.cosine + vy * heading.sine;
  command->y = vy * heading.cosine - vx * heading.sine;
  command->a = row_constrain(2 * row_arc_tangent(command->y, command->x), -rule->turn, rule->turn);
}

/* Walks to a goal. See row_walk_by(). */
RAY_FUNCTION void row_walk_to(RAY_GLOBAL const row_walker_t* rule, row_point_t goal, double speed,
                              RAY_GLOBAL const row_layout_t* layout,
                              RAY_GLOBAL const double* ranges, const row_company_t* all, double dt,
                              int stalled, RAY_GLOBAL double* walk, row_planar_t* command) {
  const row_planar_t at = all->poses[all->own];
  const double dx = goal.x - at.x, dy = goal.y - at.y;
  const double distance = sqrt(dx * dx + dy * dy);
  const row_turn_t heading = row_turn(at.a);
  row_social_t social;
  ray_uint i;
  social.at = row_point(at.x, at.y);
  social.towards.x = distance > rule->tolerance ? dx / distance : 0;
  social.towards.y = distance > rule->tolerance ? dy / distance : 0;
  social.force = row_point(0, 0);
  for (i = 0; i < all->count; i++)
    if (i != all->own)
      row_repel(rule, all->poses[i].x - at.x, all->poses[i].y - at.y, 2 * rule->radius,
                rule->repulsion, rule->reach, &social);
  for (i = 0; i < layout->eye_count; i++)
    row_repel_by_walls(rule, layout, i, ranges, all, heading, &social);
  row_walk_by(rule, speed, &social, dt, stalled, walk, heading, command);
}

/* The rule of stage/pedestrian. memory: the velocity of row_walk_by(), and when it was found, s. */
RAY_FUNCTION void row_walk(RAY_GLOBAL const row_pedestrian_t* rule,
                           RAY_GLOBAL const row_layout_t* layout, RAY_GLOBAL const double* ranges,
                           const row_company_t* all, double time, int stalled,
                           RAY_GLOBAL double* memory, row_planar_t* command) {
  row_walk_to(&rule->walker, row_point(rule->x, rule->y), rule->speed, layout, ranges, all,
              time - memory[2], stalled, memory, command);
  memory[2] = time;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
