/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The built-in controllers, for World objects, rows and devices; see docs/controllers.md. Compiled
 * after row_access.h. They use only operations that IEEE 754 rounds correctly, so all have the same
 * bits.
 */
#ifndef STAGE_KERNELS_ROW_CONTROL_H
#define STAGE_KERNELS_ROW_CONTROL_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_access.h"
namespace Stg {
#endif

/* ---- wander: the rule of examples/ctrl/support/obstacle_rule.hh --------------------------------
 */

typedef struct {
  double speed, slow, turn; /* m/s straight ahead and while it turns, rad/s */
  double front, stop;       /* m: it turns if things ahead are nearer, and stops if any is */
} row_wander_t;

typedef struct {
  int obstructed, stop;
  double left, right; /* m: the nearest thing on either side */
} row_obstacles_t;

RAY_FUNCTION row_obstacles_t row_look_for_obstacles(const row_wander_t* rule,
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
RAY_FUNCTION void row_wander(const row_wander_t* rule, RAY_GLOBAL const double* ranges,
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

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
