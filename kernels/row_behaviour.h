/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Robots whose behaviour is in their memory, the rule of stage/behaviour, and that of stage/orca.
 * Compiled after row_orca.h.
 */
#ifndef STAGE_KERNELS_ROW_BEHAVIOUR_H
#define STAGE_KERNELS_ROW_BEHAVIOUR_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_orca.h"
namespace Stg {
#endif

/* The kinds of behaviour. A robot with any other number stands. */
enum {
  ROW_STANDS,
  ROW_GOES_ON,       /* with a velocity, which turns with the rate */
  ROW_GOES_STRAIGHT, /* to the goal, and stops there */
  ROW_WALKS,         /* to the goal by social forces */
  ROW_EVADES,        /* by reciprocal collision avoidance on its way to the goal */
  ROW_BEHAVIOURS     /* their number */
};

/* The memory of a robot with stage/behaviour. All but the walk may be written between steps. */
enum {
  ROW_BEHAVIOUR_KIND,
  ROW_BEHAVIOUR_X, /* the goal, m, global */
  ROW_BEHAVIOUR_Y,
  ROW_BEHAVIOUR_SPEED, /* m/s, on the way to the goal */
  ROW_BEHAVIOUR_VX,    /* the velocity of ROW_GOES_ON, m/s, global */
  ROW_BEHAVIOUR_VY,
  ROW_BEHAVIOUR_RATE,   /* its turn, rad/s */
  ROW_BEHAVIOUR_WALK_X, /* the velocity that the rule found last, m/s, global: walks go on from it
                         */
  ROW_BEHAVIOUR_WALK_Y,
  ROW_BEHAVIOUR_SIZE /* number of doubles */
};

/* The kind of behaviour in a memory. */
RAY_FUNCTION int row_behaviour_of(RAY_GLOBAL const double* memory) {
  const double kind = memory[ROW_BEHAVIOUR_KIND];
  if (!(kind >= 0 && kind < (double)ROW_BEHAVIOURS)) return ROW_STANDS;
  return (double)(int)kind == kind ? (int)kind : ROW_STANDS;
}

/* Where a robot will be when its next command begins. It senses before it moves. */
RAY_FUNCTION row_planar_t row_next_pose(const row_company_t* all, double interval) {
  const row_planar_t at = all->poses[all->own], v = all->velocities[all->own];
  return row_planar(at.x + v.x * interval, at.y + v.y * interval, at.a + v.a * interval);
}

/* The velocity, m/s, on a straight way to a goal, which ends there. */
RAY_FUNCTION row_point_t row_straight_to(row_point_t goal, row_planar_t at, double speed,
                                         double tolerance, double interval) {
  const row_point_t way = row_point(goal.x - at.x, goal.y - at.y);
  const double distance = row_length(way);
  if (!(distance > tolerance)) return row_point(0, 0);
  return row_times(row_smaller(speed / distance, 1 / interval), way);
}

/* Commands a global velocity to a robot that turns to it, and to turn with a rate in addition. */
RAY_FUNCTION void row_head_for(row_point_t velocity, double heading, double rate, double most_turn,
                               row_planar_t* command) {
  row_turn_t turn;
  *command = row_planar(0, 0, rate);
  if (velocity.x == 0 && velocity.y == 0) return;
  turn = row_turn(heading);
  command->x = velocity.x * turn.cosine + velocity.y * turn.sine;
  command->y = velocity.y * turn.cosine - velocity.x * turn.sine;
  command->a += row_constrain(2 * row_arc_tangent(command->y, command->x), -most_turn, most_turn);
}

/* The rule of stage/orca. memory: that of row_present_goal(). */
RAY_FUNCTION void row_go_reciprocally(RAY_GLOBAL const row_orca_t* rule,
                                      RAY_GLOBAL const row_layout_t* layout,
                                      RAY_GLOBAL const double* ranges, const row_company_t* all,
                                      double time, RAY_GLOBAL double* memory,
                                      row_planar_t* command) {
  const row_planar_t next = row_next_pose(all, rule->interval);
  const row_point_t goal = row_present_goal(&rule->route, all->poses[all->own], time, memory);
  row_mobility_t body;
  body.speed = rule->speed;
  body.radius = rule->radius;
  body.interval = rule->interval;
  row_head_for(row_evade(&rule->evader, &body, layout, ranges, all,
                         row_straight_to(goal, next, rule->speed, rule->tolerance, rule->interval)),
               next.a, 0, rule->turn, command);
}

/* The present velocity of ROW_GOES_ON. Turns that of the next update. */
RAY_FUNCTION row_point_t row_go_on(RAY_GLOBAL double* memory, double interval) {
  const row_point_t velocity = row_point(memory[ROW_BEHAVIOUR_VX], memory[ROW_BEHAVIOUR_VY]);
  const double angle = memory[ROW_BEHAVIOUR_RATE] * interval;
  if (angle != 0) {
    const row_point_t turned = row_turned(velocity, row_turn(angle));
    memory[ROW_BEHAVIOUR_VX] = turned.x;
    memory[ROW_BEHAVIOUR_VY] = turned.y;
  }
  return velocity;
}

/* The rule of stage/behaviour. */
RAY_FUNCTION void row_behave(RAY_GLOBAL const row_behaviour_t* rule,
                             RAY_GLOBAL const row_layout_t* layout, RAY_GLOBAL const double* ranges,
                             const row_company_t* all, int stalled, RAY_GLOBAL double* memory,
                             row_planar_t* command) {
  RAY_GLOBAL const row_walker_t* const walker = &rule->walker;
  const int kind = row_behaviour_of(memory);
  const double speed = memory[ROW_BEHAVIOUR_SPEED];
  const row_point_t goal = row_point(memory[ROW_BEHAVIOUR_X], memory[ROW_BEHAVIOUR_Y]);
  const row_planar_t next = row_next_pose(all, rule->interval);
  row_point_t velocity = row_point(0, 0);
  row_mobility_t body;
  double rate = 0;
  if (kind == ROW_WALKS) {
    row_walk_to(walker, goal, speed, layout, ranges, all, rule->interval, stalled,
                memory + ROW_BEHAVIOUR_WALK_X, command);
    return;
  }
  if (kind == ROW_GOES_STRAIGHT || kind == ROW_EVADES)
    velocity = row_straight_to(goal, next, speed, walker->tolerance, rule->interval);
  if (kind == ROW_EVADES) {
    body.speed = speed;
    body.radius = walker->radius;
    body.interval = rule->interval;
    velocity = row_evade(&rule->evader, &body, layout, ranges, all, velocity);
  }
  if (kind == ROW_GOES_ON) {
    velocity = row_go_on(memory, rule->interval);
    rate = memory[ROW_BEHAVIOUR_RATE];
  }
  memory[ROW_BEHAVIOUR_WALK_X] = velocity.x;
  memory[ROW_BEHAVIOUR_WALK_Y] = velocity.y;
  row_head_for(velocity, next.a, rate, walker->turn, command);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
