/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The built-in controllers, for World objects, rows and devices; see docs/controllers.md. Compiled
 * after row_drive.h. They use only operations that IEEE 754 rounds correctly, so all have the same
 * bits.
 */
#ifndef STAGE_KERNELS_ROW_CONTROL_H
#define STAGE_KERNELS_ROW_CONTROL_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_drive.h"
namespace Stg {
#endif

/* ---- records ------------------------------------------------------------------------------ */

enum { ROW_GOAL, ROW_WANDER, ROW_DISPERSE, ROW_PEDESTRIAN, ROW_ORCA, ROW_BEHAVIOUR };

/* Drives to a place, and turns to a heading if that is finite. */
typedef struct {
  double x, y, heading;          /* m, rad, in the frame of the estimate */
  double speed, turn, tolerance; /* m/s, rad/s, m */
} row_goal_t;

typedef struct {
  double speed, slow, turn; /* m/s straight ahead and while it turns, rad/s */
  double front, stop;       /* m: it turns if things ahead are nearer, and stops if any is */
} row_wander_t;

typedef struct {
  double speed, gain, turn, margin, horizon; /* see DisperseRule */
  double radius;                             /* m, of the disc that must stay free */
  double cosines, sines;                     /* of the sectors into which rays look: sums */
} row_disperse_t;

/* How pedestrians walk. Lengths in m, times in s. */
typedef struct {
  double tolerance, time, turn;
  double repulsion, reach; /* of other robots: m/s^2 at touch, and the decay */
  double wall, wall_reach; /* of other things */
  double behind;           /* the weight of what is not in sight */
  double radius;           /* of each robot */
} row_walker_t;

#define ROW_MOST_GOALS 8

/* Goals that a robot goes to in turn. */
typedef struct {
  row_point_t goals[ROW_MOST_GOALS]; /* m, global */
  double count;
  double loop;     /* 1: the first goal follows the last one; 0: the robot stays at the last one */
  double wait;     /* s, at each goal but one where it stays */
  double vicinity; /* m: a goal that another one follows is reached at this distance */
} row_route_t;

/* A group of robots that follow each other in the order of their world, see row_join_group(). */
typedef struct {
  double size, member;         /* number of robots, and of this one, from 1 on */
  double gaze, cohesion, push; /* 1/s, m/s^2, m/s^2 */
  double unused;
} row_group_t;

typedef struct {
  row_route_t route;
  double speed;
  row_walker_t walker;
  row_group_t group;
} row_pedestrian_t;

/* Whom robots evade by reciprocal collision avoidance, see row_orca.h. */
typedef struct {
  double time, wall_time; /* s: they avoid collisions with robots and things for so long */
  double range;           /* m: of others, from centre to centre */
  double most;            /* number of the nearest others and things that count */
} row_evader_t;

typedef struct {
  row_route_t route;
  double speed, tolerance, turn, radius;
  double interval; /* s, between updates */
  row_evader_t evader;
} row_orca_t;

/* Parameters of stage/behaviour. The memory of a robot has the rest, see row_behaviour.h. */
typedef struct {
  row_walker_t walker;
  row_evader_t evader;
  double interval; /* s, between updates */
} row_behaviour_t;

/* Rays are numbered from the first one of a robot on. */

/* A sensor: the rays from `begin` to `end`. */
typedef struct {
  double x, y; /* m, in the robot's frame */
  double cap;  /* m: readings of it and above show nothing */
  ray_uint begin, end;
} row_eye_t;

/* Neighbouring rays of a sensor in one sector. */
typedef struct {
  ray_uint begin, end;
  ray_uint front_begin, front_end; /* those that count for the free path */
  ray_uint eye, unused;
} row_run_t;

/* A sector into which rays look. */
typedef struct {
  ray_uint sector, first_run, end_run, unused;
} row_sector_t;

#define ROW_SECTOR_COUNT 72u
#define ROW_NOT_SEEN 255 /* no ray looks into the sector */

/* How the sensors of a robot look. The parts follow it. */
typedef struct {
  ray_uint eye_count, sector_count;
  ray_uint eyes, sectors, runs;          /* offsets of the parts in bytes */
  ray_uint turns;                        /* row_turn_t by ray, in the robot's frame */
  row_byte sector_map[ROW_SECTOR_COUNT]; /* index of the sector, or ROW_NOT_SEEN */
} row_layout_t;

#define ROW_OF_LAYOUT(layout, type, part) \
  ((RAY_GLOBAL const type*)((RAY_GLOBAL const row_byte*)(layout) + (layout)->part))

/* A robot and one of its controllers. */
typedef struct RAY_ALIGNED(16) {
  ray_uint kind, mover;
  ray_uint memory;    /* index of its first number among those of a world */
  ray_uint own;       /* index among the robots */
  ray_uint first_ray; /* among those of a world */
  ray_uint rays;      /* of the first sensor */
  ray_uint layout;    /* offset in bytes among the layouts */
  ray_uint first_look;
  union {
    row_goal_t goal;
    row_wander_t wander;
    row_disperse_t disperse;
    row_pedestrian_t pedestrian;
    row_orca_t orca;
    row_behaviour_t behaviour;
  } rule;
} row_control_t;

/* A robot with controllers, which are called in order. */
typedef struct {
  ray_uint first_control, end_control;
} row_driven_t;

/* All robots of a world, and the one that is driven. */
typedef struct {
  RAY_GLOBAL const row_planar_t* poses;
  RAY_GLOBAL const row_planar_t* velocities; /* global; null unless they are needed */
  ray_uint count, own;
} row_company_t;

/* The global velocity of a robot. It has that of its frame, unless it stands. */
RAY_FUNCTION row_planar_t row_global_velocity(double heading, row_planar_t velocity, int stands) {
  row_turn_t turn;
  if (stands) return row_planar(0, 0, 0);
  if (velocity.x == 0 && velocity.y == 0) return row_planar(0, 0, velocity.a);
  turn = row_turn(heading);
  return row_planar(velocity.x * turn.cosine - velocity.y * turn.sine,
                    velocity.x * turn.sine + velocity.y * turn.cosine, velocity.a);
}

/* ---- goal --------------------------------------------------------------------------------- */

#define ROW_GOAL_GAIN 2.0    /* rad/s per rad */
#define ROW_GOAL_FACING 0.01 /* rad: close enough to the heading */

RAY_FUNCTION void row_go_to_goal(RAY_GLOBAL const row_goal_t* rule, row_planar_t at,
                                 row_planar_t* command) {
  const double dx = rule->x - at.x, dy = rule->y - at.y;
  const double distance = sqrt(dx * dx + dy * dy);
  const row_turn_t turn = row_turn(at.a);
  double off = 0;
  command->x = command->y = 0;
  if (distance > rule->tolerance) {
    off = row_normalize(row_arc_tangent(dy, dx) - at.a);
    command->x = rule->speed * row_larger(0.0, (dx * turn.cosine + dy * turn.sine) / distance);
  } else if (row_is_finite(rule->heading)) {
    off = row_normalize(rule->heading - at.a);
    if (fabs(off) <= ROW_GOAL_FACING) off = 0;
  }
  command->a = row_constrain(ROW_GOAL_GAIN * off, -rule->turn, rule->turn);
}

/* ---- wander: the rule of examples/ctrl/support/obstacle_rule.hh ---------------------------- */

typedef struct {
  int obstructed, stop;
  double left, right; /* m: the nearest thing on either side */
} row_obstacles_t;

RAY_FUNCTION row_obstacles_t row_look_for_obstacles(RAY_GLOBAL const row_wander_t* rule,
                                                    RAY_GLOBAL const double* ranges,
                                                    ray_uint count) {
  const ray_uint side = count / 3;
  row_obstacles_t seen;
  ray_uint i;
  seen.obstructed = seen.stop = 0;
  seen.left = seen.right = 1e6;
  for (i = 0; i < count; i++) {
    const double range = ranges[i];
    if (i > side && i < count - side && range < rule->front) seen.obstructed = 1;
    if (range < rule->stop) seen.stop = 1;
    if (i > count / 2)
      seen.left = row_smaller(seen.left, range);
    else
      seen.right = row_smaller(seen.right, range);
  }
  return seen;
}

/* *left: updates that are left of the present turn. */
RAY_FUNCTION void row_wander(RAY_GLOBAL const row_wander_t* rule, RAY_GLOBAL const double* ranges,
                             ray_uint count, RAY_GLOBAL double* left, row_random_t* random,
                             row_planar_t* command) {
  const row_obstacles_t seen = row_look_for_obstacles(rule, ranges, count);
  if (!seen.obstructed && !seen.stop && !(*left > 0)) {
    command->x = rule->speed;
    command->a = 0;
    return;
  }
  command->x = seen.stop ? 0 : rule->slow;
  if (*left < 1) {
    *left = 10 + row_choose(random, 10);
    command->a = seen.left < seen.right ? -rule->turn : rule->turn;
  }
  *left -= 1;
}

/* ---- disperse: the rule of examples/ctrl/support/disperse_rule.hh -------------------------- */

#define ROW_SECTOR_WIDTH (2 * ROW_PI / 72) /* rad */
#define ROW_UNLIMITED 1000.0 /* m: nothing is seen in a sector; the free path has no end */
#define ROW_UNSEEN 2000.0    /* no ray looks into the sector */

/* The nearest reading in a sector into which rays look. */
typedef struct {
  double nearest; /* m */
  double free;    /* m: up to where the way is free */
  double push;    /* 1/m^2 */
  ray_uint ray, unused;
} row_look_t;

/* Distance ahead of a point that a ray has hit; no limit beside the way. */
RAY_FUNCTION double row_free_up_to(row_eye_t eye, double range, row_turn_t direction,
                                   double radius) {
  const double ahead = eye.x + range * direction.cosine;
  const double aside = eye.y + range * direction.sine;
  return ahead > 0.0 && aside < radius && aside > -radius ? ahead : ROW_UNLIMITED;
}

/* Finds the nearest reading in sector number `index` of those into which rays look. */
RAY_FUNCTION void row_look(RAY_GLOBAL const row_layout_t* layout, ray_uint index, double radius,
                           RAY_GLOBAL const double* ranges, RAY_GLOBAL row_look_t* looks) {
  const row_sector_t sector = ROW_OF_LAYOUT(layout, row_sector_t, sectors)[index];
  double nearest = ROW_UNLIMITED;
  row_look_t look;
  ray_uint r, i;
  look.free = ROW_UNLIMITED;
  look.push = 0;
  look.ray = look.unused = 0;
  for (r = sector.first_run; r < sector.end_run; r++) {
    const row_run_t run = ROW_OF_LAYOUT(layout, row_run_t, runs)[r];
    const row_eye_t eye = ROW_OF_LAYOUT(layout, row_eye_t, eyes)[run.eye];
    const double most = row_smaller(eye.cap, nearest);
    double least = most;
    for (i = run.begin; i < run.end; i++)
      if (ranges[i] < least) {
        least = ranges[i];
        look.ray = i;
      }
    if (least < most) nearest = least;
    for (i = run.front_begin; i < run.front_end; i++)
      look.free = row_smaller(
          look.free,
          row_free_up_to(eye, ranges[i], ROW_OF_LAYOUT(layout, row_turn_t, turns)[i], radius));
  }
  look.nearest = nearest;
  looks[index] = look;
}

/* The nearest reading in a sector, m. */
RAY_FUNCTION double row_nearest_in(RAY_GLOBAL const row_layout_t* layout,
                                   RAY_GLOBAL const row_look_t* looks, ray_uint sector) {
  const row_byte index = layout->sector_map[sector % ROW_SECTOR_COUNT];
  return index == ROW_NOT_SEEN ? ROW_UNSEEN : looks[index].nearest;
}

/* True if the sector is a local minimum. The first of two equal ones counts. */
RAY_FUNCTION int row_is_nearest(RAY_GLOBAL const row_layout_t* layout,
                                RAY_GLOBAL const row_look_t* looks, ray_uint sector) {
  const double range = row_nearest_in(layout, looks, sector);
  ray_uint i;
  for (i = 1; i <= 5; i++)
    if (!(range < row_nearest_in(layout, looks, sector + ROW_SECTOR_COUNT - i) &&
          range <= row_nearest_in(layout, looks, sector + i)))
      return 0;
  return 1;
}

/* Number of further sectors, in steps to the left or right, in which the thing is about as near. */
RAY_FUNCTION ray_uint row_extent(RAY_GLOBAL const row_layout_t* layout,
                                 RAY_GLOBAL const row_look_t* looks, ray_uint sector,
                                 ray_uint step) {
  const double range = row_nearest_in(layout, looks, sector);
  ray_uint extent = 0, i;
  for (i = 1; i < ROW_SECTOR_COUNT / 2; i++) {
    const double there = row_nearest_in(layout, looks, sector + i * step);
    if (there == ROW_UNSEEN) continue;
    if (!(there < 1.3 * range)) break;
    extent = i;
  }
  return extent;
}

/* True if the thing is wider than two robots like this one. */
RAY_FUNCTION int row_is_wall(RAY_GLOBAL const row_layout_t* layout,
                             RAY_GLOBAL const row_look_t* looks, ray_uint sector, double radius) {
  const ray_uint width = 1 + row_extent(layout, looks, sector, 1) +
                         row_extent(layout, looks, sector, ROW_SECTOR_COUNT - 1);
  return (double)width * ROW_SECTOR_WIDTH * row_nearest_in(layout, looks, sector) > 4 * radius;
}

/* Finds the repulsion of the thing in a sector. All sectors have been looked at. */
RAY_FUNCTION void row_find_push(RAY_GLOBAL const row_layout_t* layout, ray_uint index,
                                RAY_GLOBAL const row_disperse_t* rule,
                                RAY_GLOBAL row_look_t* looks) {
  const ray_uint sector = ROW_OF_LAYOUT(layout, row_sector_t, sectors)[index].sector;
  const double range = looks[index].nearest, horizon = rule->horizon;
  double nearest, distance;
  if (!(range < horizon) || !row_is_nearest(layout, looks, sector)) return;
  nearest = row_larger(range, rule->radius);
  distance = row_is_wall(layout, looks, sector, rule->radius) ? 2 * nearest : nearest;
  looks[index].push = row_larger(0.0, 1 / (distance * distance) - 1 / (horizon * horizon));
}

/* Direction to drive, 1/m^2 in the robot's frame, and the free path. */
typedef struct {
  double x, y, imbalance, free;
} row_urge_t;

RAY_FUNCTION row_urge_t row_find_urge(RAY_GLOBAL const row_layout_t* layout,
                                      RAY_GLOBAL const row_disperse_t* rule,
                                      RAY_GLOBAL row_look_t* looks) {
  double total = 0;
  row_urge_t urge;
  ray_uint i;
  urge.x = urge.y = urge.imbalance = 0;
  urge.free = ROW_UNLIMITED;
  for (i = 0; i < layout->sector_count; i++) {
    const row_look_t look = looks[i];
    urge.free = row_smaller(urge.free, look.free);
    if (look.push == 0) continue;
    total += look.push;
    urge.x -= look.push * ROW_OF_LAYOUT(layout, row_turn_t, turns)[look.ray].cosine;
    urge.y -= look.push * ROW_OF_LAYOUT(layout, row_turn_t, turns)[look.ray].sine;
  }
  if (!(total > 0)) return urge;
  /* Unseen directions repel like the average of the others. */
  urge.x += total / (double)layout->sector_count * rule->cosines;
  urge.y += total / (double)layout->sector_count * rule->sines;
  urge.imbalance = sqrt(urge.x * urge.x + urge.y * urge.y) / total;
  return urge;
}

/* True if a stalled robot backs slightly, every other time. *backing: whether it did. */
RAY_FUNCTION int row_back_off(RAY_GLOBAL const row_disperse_t* rule, int stalled,
                              RAY_GLOBAL double* backing, row_planar_t* command) {
  const int backs = stalled && *backing == 0;
  *backing = backs;
  command->x = backs ? -rule->speed / 4 : 0;
  command->y = command->a = 0;
  return backs;
}

/* The command for what the robot sees. It was zero. */
RAY_FUNCTION void row_disperse(RAY_GLOBAL const row_layout_t* layout,
                               RAY_GLOBAL const row_disperse_t* rule, RAY_GLOBAL row_look_t* looks,
                               row_planar_t* command) {
  const row_urge_t goal = row_find_urge(layout, rule, looks);
  double urge, clearance, facing;
  if (!(goal.imbalance > 0.1)) return;
  urge = row_smaller(1.0, goal.imbalance / 0.3);
  clearance = (goal.free - rule->radius) / (4.0 * rule->radius);
  facing = goal.x / sqrt(goal.x * goal.x + goal.y * goal.y);
  command->x =
      rule->speed * row_larger(0.0, row_smaller(urge, clearance)) * row_larger(0.0, facing);
  command->a =
      row_constrain(rule->gain * urge * row_arc_tangent(goal.y, goal.x), -rule->turn, rule->turn);
}

/* OpenCL C 1.1 has no static assertions. */
typedef char row_control_has_320_bytes[sizeof(row_control_t) == 320 ? 1 : -1];
typedef char row_layout_has_96_bytes[sizeof(row_layout_t) == 96 ? 1 : -1];
typedef char row_eye_has_32_bytes[sizeof(row_eye_t) == 32 ? 1 : -1];
typedef char row_run_has_24_bytes[sizeof(row_run_t) == 24 ? 1 : -1];
typedef char row_look_has_32_bytes[sizeof(row_look_t) == 32 ? 1 : -1];

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
