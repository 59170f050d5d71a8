/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Contact forces of an island, and the motions that follow from them:
 * libstage/motion/island_forces.cc, which explains them. Compiled after row_island.h.
 */
#ifndef STAGE_KERNELS_ROW_FORCES_H
#define STAGE_KERNELS_ROW_FORCES_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_island.h"
namespace Stg {
#endif

/* See motion::Effort and kConverged. */
#define ROW_PASSES 4
#define ROW_SWEEPS 16
#define ROW_PUSH_SWEEPS 400
#define ROW_EASY_SWEEPS 3 /* of an easy island, at most */
#define ROW_JOINT_ROUNDS 6
#define ROW_CONVERGED 1e-7

RAY_FUNCTION double row_speed(row_planar_t motion, row_point_t n, double arm) {
  return n.x * motion.x + n.y * motion.y + motion.a * arm;
}

/* Adds a force to a body, and what it does to its motion. */
RAY_FUNCTION void row_apply(ROW_ROOM row_solid_t* solid, row_point_t direction, double arm,
                            double amount) {
  solid->force.x += amount * direction.x;
  solid->force.y += amount * direction.y;
  solid->force.a += amount * arm;
  solid->motion.x += amount * solid->mass * direction.x;
  solid->motion.y += amount * solid->mass * direction.y;
  solid->motion.a += amount * solid->inertia * arm;
}

/* See IslandSolver::SolveTwo(). */
RAY_FUNCTION void row_solve_two(const double* k, const double* wanted, double* force) {
  const double determinant = k[0] * k[2] - k[1] * k[1];
  double first, second;
  force[0] = force[1] = 0.0;
  if (wanted[0] <= 0.0 && wanted[1] <= 0.0) return;
  if (determinant > 1e-9 * k[0] * k[2]) {
    first = (k[2] * wanted[0] - k[1] * wanted[1]) / determinant;
    second = (k[0] * wanted[1] - k[1] * wanted[0]) / determinant;
    if (first >= 0.0 && second >= 0.0) {
      force[0] = first;
      force[1] = second;
      return;
    }
  }
  first = wanted[0] / k[0];
  second = wanted[1] / k[2];
  if (first > 0.0 && k[1] * first >= wanted[1])
    force[0] = first;
  else
    force[1] = row_larger(second, 0.0);
}

/* See IslandSolver::SolvePush(). */
RAY_FUNCTION void row_solve_push(const row_solver_t* s, ROW_ROOM row_touch_t* touch) {
  ROW_ROOM row_solid_t* const a = s->solids + touch->a;
  const int forces = touch->kind == ROW_FORCE;
  ROW_ROOM row_solid_t* const b = forces ? s->solids + touch->b : a;
  const row_point_t normal = touch->normal;
  double response[3], wanted[2], force[2];
  ray_uint k;
  force[0] = force[1] = 0.0;
  for (k = 0; k < 3; k++) response[k] = touch->of_a[k] + touch->of_b[k];
  for (k = 0; k < touch->count; k++) {
    wanted[k] = row_speed(a->motion, normal, touch->arm_a[k]) - touch->room[k];
    if (forces) wanted[k] -= row_speed(b->motion, normal, touch->arm_b[k]);
  }
  if (touch->count == 1) {
    force[0] = row_larger(wanted[0] / response[0] + touch->push_a[0], 0.0);
  } else {
    wanted[0] += response[0] * touch->push_a[0] + response[1] * touch->push_a[1];
    wanted[1] += response[1] * touch->push_a[0] + response[2] * touch->push_a[1];
    row_solve_two(response, wanted, force);
  }
  for (k = 0; k < touch->count; k++) {
    const double change = force[k] - touch->push_a[k];
    if (change == 0.0) continue;
    touch->push_a[k] = force[k];
    row_apply(a, normal, touch->arm_a[k], -change);
    if (forces) row_apply(b, normal, touch->arm_b[k], change);
  }
}

/* The forces of a front on a body: at one or two points. */
RAY_FUNCTION void row_solve_front(ROW_ROOM const double* response, ray_uint count,
                                  const double* wanted, double* force) {
  double k[3];
  k[0] = response[0];
  k[1] = response[1];
  k[2] = response[2];
  force[0] = force[1] = 0.0;
  if (count == 1)
    force[0] = row_larger(wanted[0] / k[0], 0.0);
  else
    row_solve_two(k, wanted, force);
}

/* See IslandSolver::SolveSplit(). */
RAY_FUNCTION void row_solve_split(const row_solver_t* s, ROW_ROOM row_touch_t* touch) {
  ROW_ROOM row_solid_t* const a = s->solids + touch->a;
  ROW_ROOM row_solid_t* const b = s->solids + touch->b;
  const row_point_t normal = touch->normal;
  double wanted_a[2], wanted_b[2], force_a[2], force_b[2];
  ray_uint k;
  for (k = 0; k < touch->count; k++) {
    const double own_a = k == 0 ? touch->of_a[0] : touch->of_a[2];
    const double own_b = k == 0 ? touch->of_b[0] : touch->of_b[2];
    const double room = touch->room[k];
    double free_a = row_speed(a->motion, normal, touch->arm_a[k]) + own_a * touch->push_a[k];
    double free_b = row_speed(b->motion, normal, touch->arm_b[k]) - own_b * touch->push_b[k];
    double with_b, front;
    if (touch->count == 2) {
      free_a += touch->of_a[1] * touch->push_a[1 - k];
      free_b -= touch->of_b[1] * touch->push_b[1 - k];
    }
    with_b = free_b + room;
    front = row_clamp(0.5 * room, row_smaller(free_a, with_b), row_larger(free_a, with_b));
    wanted_a[k] = free_a - front;
    wanted_b[k] = front - room - free_b;
  }
  row_solve_front(touch->of_a, touch->count, wanted_a, force_a);
  row_solve_front(touch->of_b, touch->count, wanted_b, force_b);
  for (k = 0; k < touch->count; k++) {
    if (force_a[k] != touch->push_a[k])
      row_apply(a, normal, touch->arm_a[k], touch->push_a[k] - force_a[k]);
    if (force_b[k] != touch->push_b[k])
      row_apply(b, normal, touch->arm_b[k], force_b[k] - touch->push_b[k]);
    touch->push_a[k] = force_a[k];
    touch->push_b[k] = force_b[k];
  }
}

/* Sets a friction force on a body. */
RAY_FUNCTION void row_rub(ROW_ROOM row_solid_t* solid, row_point_t tangent, double arm, double sign,
                          double target, double now) {
  const double change = target - now;
  if (change != 0.0) row_apply(solid, tangent, arm, sign * change);
}

/* See IslandSolver::SolveFriction(). */
RAY_FUNCTION void row_solve_friction(const row_solver_t* s, ROW_ROOM row_touch_t* touch) {
  ROW_ROOM row_solid_t* const a = s->solids + touch->a;
  ROW_ROOM row_solid_t* const b = touch->kind == ROW_FIXED ? a : s->solids + touch->b;
  const row_point_t t = row_left(touch->normal);
  const double limit_a = touch->friction * (touch->push_a[0] + touch->push_a[1]);
  const double limit_b = touch->friction * (touch->push_b[0] + touch->push_b[1]);
  const double own_a = touch->slide_of_a, own_b = touch->slide_of_b;
  const double rub_a = touch->rub_a, rub_b = touch->rub_b;
  double speed_a, speed_b, target_a, target_b = rub_b;
  if (limit_a == 0.0 && limit_b == 0.0 && rub_a == 0.0 && rub_b == 0.0) return;
  speed_a = row_speed(a->motion, t, touch->slide_arm_a);
  speed_b = row_speed(b->motion, t, touch->slide_arm_b);
  if (touch->kind == ROW_FIXED) {
    target_a = row_clamp(rub_a + speed_a / own_a, -limit_a, limit_a);
  } else if (touch->kind == ROW_FORCE) {
    target_a = row_clamp(rub_a + (speed_a - speed_b) / (own_a + own_b), -limit_a, limit_a);
    row_rub(b, t, touch->slide_arm_b, 1.0, target_a, rub_a);
  } else {
    const double free_a = speed_a + own_a * rub_a, free_b = speed_b - own_b * rub_b;
    const double common = row_clamp(0.0, row_smaller(free_a, free_b), row_larger(free_a, free_b));
    target_a = row_clamp((free_a - common) / own_a, -limit_a, limit_a);
    target_b = row_clamp((common - free_b) / own_b, -limit_b, limit_b);
    row_rub(b, t, touch->slide_arm_b, 1.0, target_b, rub_b);
  }
  row_rub(a, t, touch->slide_arm_a, -1.0, target_a, rub_a);
  if (target_a - rub_a != 0.0) touch->rub_a = target_a;
  if (target_b - rub_b != 0.0) touch->rub_b = target_b;
}

RAY_FUNCTION void row_solve_touch(const row_solver_t* s, ROW_ROOM row_touch_t* touch) {
  if (touch->kind == ROW_SPLIT)
    row_solve_split(s, touch);
  else
    row_solve_push(s, touch);
  if (touch->friction > 0.0) row_solve_friction(s, touch);
}

/* See IslandSolver::SolveFloor(). */
RAY_FUNCTION void row_solve_floor(ROW_ROOM row_solid_t* solid) {
  const row_planar_t before = solid->floor, wanted = solid->wanted;
  const double mass = solid->mass, inertia = solid->inertia;
  row_planar_t motion = solid->motion, now;
  const double x = before.x - (motion.x - wanted.x) / mass;
  const double y = before.y - (motion.y - wanted.y) / mass;
  const double torque = before.a - (motion.a - wanted.a) / inertia;
  const double leverage = torque / solid->arm;
  const double force = sqrt(x * x + y * y + leverage * leverage);
  const double part = force > solid->grip ? solid->grip / force : 1.0;
  now = row_planar(part * x, part * y, part * torque);
  motion.x += mass * (now.x - before.x);
  motion.y += mass * (now.y - before.y);
  motion.a += inertia * (now.a - before.a);
  solid->motion = motion;
  solid->floor = now;
}

/* See IslandSolver::SetMasses(). */
RAY_FUNCTION void row_set_masses(row_solver_t* s) {
  const row_planar_t none = row_planar(0, 0, 0);
  ray_uint i;
  s->typical = 1e-30;
  for (i = 0; i < s->members; i++)
    s->typical = row_larger(s->typical, row_distance(s->solids[i].wanted, none, s->solids[i].arm));
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    solid->motion = solid->wanted;
    solid->floor = solid->force = none;
    solid->mass = s->typical / solid->grip;
    solid->inertia = solid->mass / (solid->arm * solid->arm);
  }
}

/* The change of a motion since it was noted last, which is noted now. */
RAY_FUNCTION double row_note_change(ROW_ROOM row_solid_t* solid) {
  const double change = row_distance(solid->motion, solid->before, solid->arm);
  solid->before = solid->motion;
  return change;
}

/* See IslandSolver::Sweep(). */
RAY_FUNCTION double row_sweep(row_solver_t* s, int number) {
  ROW_ROOM row_touch_t* const touches = s->touches;
  double change = 0.0;
  ray_uint i;
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    solid->before = solid->motion;
    if ((solid->flags & ROW_PUSHES) == 0 || number == 0) continue;
    solid->motion.x += solid->mass * (solid->force.x + solid->floor.x);
    solid->motion.y += solid->mass * (solid->force.y + solid->floor.y);
    solid->motion.a += solid->inertia * (solid->force.a + solid->floor.a);
    change = row_larger(change, row_note_change(solid));
  }
  for (i = 0; i < s->touch_count; i++)
    row_solve_touch(s, touches + (number % 2 == 0 ? i : s->touch_count - 1 - i));
  for (i = 0; i < s->members; i++) {
    ROW_ROOM row_solid_t* const solid = s->solids + i;
    change = row_larger(change, row_note_change(solid));
    if ((solid->flags & ROW_PUSHES) == 0) continue;
    row_solve_floor(solid);
    change = row_larger(change, row_note_change(solid));
  }
  return change;
}

/* See IslandSolver::SolveForces(). False if the island is to be easy and needs more sweeps. */
RAY_FUNCTION int row_solve_forces(row_solver_t* s, int easy) {
  int most = ROW_SWEEPS, sweep;
  ray_uint i;
  if (s->touch_count == 0) return 1;
  for (i = 0; i < s->touch_count; i++)
    if (s->touches[i].kind == ROW_FORCE) most = ROW_PUSH_SWEEPS;
  if (easy) most = ROW_EASY_SWEEPS;
  for (sweep = 0; sweep < most; sweep++)
    if (row_sweep(s, sweep) < ROW_CONVERGED) return 1;
  return !easy;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
