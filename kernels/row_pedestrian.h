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
#define ROW_SIGHT_LIMIT                                                        \
  -0.17364817766693033     /* cosine of half of a field of view of 200 degrees \
                            */
#define ROW_FAR 10.0       /* repulsion ends at this multiple of its decay */
#define ROW_ELBOW_ROOM 0.8 /* m: members of a group that are nearer step aside */

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

/* ---- routes ---- */

enum { ROW_ROUTE_INDEX, ROW_ROUTE_LEAVES, ROW_ROUTE_SIZE /* number of doubles */ };

/* Finds the present goal. memory: its index, and the time at which the robot leaves a goal where it
 * waits, s; 0 if it does not wait. */
RAY_FUNCTION row_point_t row_present_goal(RAY_GLOBAL const row_route_t* route, row_planar_t at,
                                          double time, RAY_GLOBAL double* memory) {
  const ray_uint count = (ray_uint)route->count;
  ray_uint index = (ray_uint)row_constrain(memory[ROW_ROUTE_INDEX], 0, route->count - 1);
  const row_point_t goal = route->goals[index];
  const row_point_t way = row_point(goal.x - at.x, goal.y - at.y);
  if (index + 1 == count && !(route->loop > 0)) return goal;
  if (!(memory[ROW_ROUTE_LEAVES] > 0)) {
    if (!(row_length(way) <= route->vicinity)) return goal;
    memory[ROW_ROUTE_LEAVES] = time + route->wait;
  }
  if (time < memory[ROW_ROUTE_LEAVES]) return goal;
  memory[ROW_ROUTE_LEAVES] = 0;
  index = index + 1 == count ? 0 : index + 1;
  memory[ROW_ROUTE_INDEX] = (double)index;
  return route->goals[index];
}

/* ---- groups ---- */

/* Adds the forces that keep a group together. They are those of M. Moussaid, N. Perozo, S. Garnier,
 * D. Helbing and G. Theraulaz, "The walking behaviour of pedestrian social groups and its impact on
 * crowd dynamics", PLoS ONE 5(4), e10047, 2010.
 *
 * A robot slows down by the angle by which the middle of the others is outside of its field of view
 * of 180 degrees. It is attracted by the middle of the group if that is far, and gives way to
 * others that are close. walk: its velocity, m/s. */
RAY_FUNCTION void row_join_group(RAY_GLOBAL const row_group_t* group, const row_company_t* all,
                                 row_point_t walk, row_social_t* social) {
  const ray_uint size = (ray_uint)group->size, first = all->own + 1 - (ray_uint)group->member;
  row_point_t sum = row_point(0, 0);
  double others = 0, turn, distance;
  ray_uint k;
  for (k = 0; k < size; k++) {
    const ray_uint i = first + k;
    row_point_t way;
    if (i == all->own || i >= all->count) continue;
    way = row_minus(row_point(all->poses[i].x, all->poses[i].y), social->at);
    distance = row_length(way);
    sum = row_plus(sum, way);
    others += 1;
    if (distance > 0 && distance < ROW_ELBOW_ROOM)
      social->force = row_minus(social->force, row_times(group->push / distance, way));
  }
  distance = row_length(sum) / (others + 1);
  if (!(distance > 0)) return;
  if (distance > others / 2)
    social->force = row_plus(social->force, row_times(group->cohesion / row_length(sum), sum));
  turn = fabs(row_arc_tangent(row_cross(walk, sum), row_dot(walk, sum))) - ROW_PI / 2;
  if (turn > 0) social->force = row_minus(social->force, row_times(group->gaze * turn, walk));
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

/* The direction to a goal, and the forces of robots and of what rangers see. */
RAY_FUNCTION row_social_t row_social_forces(RAY_GLOBAL const row_walker_t* rule, row_point_t goal,
                                            RAY_GLOBAL const row_layout_t* layout,
                                            RAY_GLOBAL const double* ranges,
                                            const row_company_t* all, row_turn_t heading) {
  const row_planar_t at = all->poses[all->own];
  const double dx = goal.x - at.x, dy = goal.y - at.y;
  const double distance = sqrt(dx * dx + dy * dy);
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
  return social;
}

/* Walks to a goal. See row_walk_by(). */
RAY_FUNCTION void row_walk_to(RAY_GLOBAL const row_walker_t* rule, row_point_t goal, double speed,
                              RAY_GLOBAL const row_layout_t* layout,
                              RAY_GLOBAL const double* ranges, const row_company_t* all, double dt,
                              int stalled, RAY_GLOBAL double* walk, row_planar_t* command) {
  const row_turn_t heading = row_turn(all->poses[all->own].a);
  const row_social_t social = row_social_forces(rule, goal, layout, ranges, all, heading);
  row_walk_by(rule, speed, &social, dt, stalled, walk, heading, command);
}

/* The memory of a robot with stage/pedestrian. */
enum {
  ROW_PEDESTRIAN_WALK,     /* the velocity of row_walk_by() */
  ROW_PEDESTRIAN_TIME = 2, /* when it was found, s */
  ROW_PEDESTRIAN_ROUTE,
  ROW_PEDESTRIAN_SIZE = ROW_PEDESTRIAN_ROUTE + ROW_ROUTE_SIZE /* number of doubles */
};

/* The rule of stage/pedestrian. */
RAY_FUNCTION void row_walk(RAY_GLOBAL const row_pedestrian_t* rule,
                           RAY_GLOBAL const row_layout_t* layout, RAY_GLOBAL const double* ranges,
                           const row_company_t* all, double time, int stalled,
                           RAY_GLOBAL double* memory, row_planar_t* command) {
  const row_planar_t at = all->poses[all->own];
  const row_turn_t heading = row_turn(at.a);
  const row_point_t goal = row_present_goal(&rule->route, at, time, memory + ROW_PEDESTRIAN_ROUTE);
  row_social_t social = row_social_forces(&rule->walker, goal, layout, ranges, all, heading);
  if (rule->group.size > 1)
    row_join_group(&rule->group, all, row_point(memory[0], memory[1]), &social);
  row_walk_by(&rule->walker, rule->speed, &social, time - memory[ROW_PEDESTRIAN_TIME], stalled,
              memory + ROW_PEDESTRIAN_WALK, heading, command);
  memory[ROW_PEDESTRIAN_TIME] = time;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
