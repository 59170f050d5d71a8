/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Calls of the built-in controllers for the robots of a world: Rows::Stepper::RunControls().
 * Compiled after row_behaviour.h.
 */
#ifndef STAGE_KERNELS_ROW_DRIVEN_H
#define STAGE_KERNELS_ROW_DRIVEN_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_behaviour.h"
namespace Stg {
#endif

RAY_FUNCTION RAY_GLOBAL const row_layout_t* row_layout_of(const row_world_t* w,
                                                          RAY_GLOBAL const row_control_t* control) {
  return (RAY_GLOBAL const row_layout_t*)(ROW_PART(w, row_byte, ROW_LAYOUTS) + control->layout);
}

RAY_FUNCTION RAY_GLOBAL row_look_t* row_looks_of(const row_world_t* w,
                                                 RAY_GLOBAL const row_control_t* control) {
  return ROW_SCRATCH(w, row_look_t, ROW_LOOKS) + control->first_look;
}

/* Looks into a sector, or finds the push of what is in it. */
RAY_FUNCTION void row_do_look(const row_world_t* w, ray_uint number, int finds_push) {
  RAY_GLOBAL const row_control_t* const control =
      ROW_PART(w, row_control_t, ROW_CONTROLS) + ROW_PART(w, ray_uint, ROW_LOOK_OF)[number];
  RAY_GLOBAL row_look_t* const looks = row_looks_of(w, control);
  RAY_GLOBAL const row_disperse_t* const rule = &control->rule.disperse;
  RAY_GLOBAL const row_layout_t* const layout = row_layout_of(w, control);
  const ray_uint index = number - control->first_look;
  if (finds_push)
    row_find_push(layout, index, rule, looks);
  else
    row_look(layout, index, rule->radius, ROW_COLUMN(w, double, ROW_RANGES) + control->first_ray,
             looks);
}

/* All robots, if a controller needs their poses. */
RAY_FUNCTION row_company_t row_company_of(const row_world_t* w, ray_uint own) {
  row_company_t all;
  all.poses = ROW_SCRATCH(w, row_planar_t, ROW_ALL_POSES);
  all.velocities = ROW_SCRATCH(w, row_planar_t, ROW_ALL_VELOCITIES);
  all.count = w->scene->positions;
  all.own = own;
  return all;
}

/* Calls one controller of a robot. */
RAY_FUNCTION void row_call_controller(const row_world_t* w, RAY_GLOBAL const row_control_t* control,
                                      double time, row_planar_t* command) {
  const ray_uint mover = control->mover;
  const int stalled = ROW_COLUMN(w, row_byte, ROW_STALLED)[mover] != 0;
  RAY_GLOBAL const double* const ranges = ROW_COLUMN(w, double, ROW_RANGES) + control->first_ray;
  RAY_GLOBAL double* const memory = ROW_COLUMN(w, double, ROW_MEMORY) + control->memory;
  RAY_GLOBAL const row_layout_t* const layout = row_layout_of(w, control);
  const row_company_t all = row_company_of(w, control->own);
  row_random_t random;
  switch (control->kind) {
    case ROW_GOAL:
      row_go_to_goal(&control->rule.goal, row_known_estimate(w, mover), command);
      break;
    case ROW_WANDER:
      random = ROW_COLUMN(w, row_random_t, ROW_RANDOM)[mover];
      row_wander(&control->rule.wander, ranges, control->rays, memory, &random, command);
      ROW_COLUMN(w, row_random_t, ROW_RANDOM)[mover] = random;
      break;
    case ROW_DISPERSE:
      if (!row_back_off(&control->rule.disperse, stalled, memory, command))
        row_disperse(layout, &control->rule.disperse, row_looks_of(w, control), command);
      break;
    case ROW_PEDESTRIAN:
      row_walk(&control->rule.pedestrian, layout, ranges, &all, time, stalled, memory, command);
      break;
    case ROW_ORCA:
      row_go_reciprocally(&control->rule.orca, layout, ranges, &all, time, memory, command);
      break;
    default:
      row_behave(&control->rule.behaviour, layout, ranges, &all, stalled, memory, command);
  }
}

/* Calls the controllers of a robot in their order. */
RAY_FUNCTION void row_call_controllers(const row_world_t* w, ray_uint index, double time) {
  const row_driven_t driven = ROW_PART(w, row_driven_t, ROW_CONTROLLED)[index];
  RAY_GLOBAL const row_control_t* const controls = ROW_PART(w, row_control_t, ROW_CONTROLS);
  const ray_uint mover = controls[driven.first_control].mover;
  ray_uint i;
  for (i = driven.first_control; i < driven.end_control; i++) {
    row_planar_t command = ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[mover];
    row_call_controller(w, controls + i, time, &command);
    if (row_is_nan(command.x) || row_is_nan(command.y) || row_is_nan(command.a)) continue;
    ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[mover] = command;
    ROW_COLUMN(w, row_byte, ROW_MODE)[mover] = ROW_VELOCITY_MODE;
  }
}

/* Finds the pose of a robot, and its velocity if a controller needs those. */
RAY_FUNCTION void row_gather_robot(const row_world_t* w, ray_uint index) {
  const ray_uint mover = ROW_PART(w, ray_uint, ROW_POSITIONS)[index];
  const int runs = ROW_PART(w, row_mover_t, ROW_MOVERS)[mover].drive != ROW_NO_DRIVE;
  const row_planar_t pose = ROW_COLUMN(w, row_planar_t, runs ? ROW_SENSED : ROW_POSE)[mover];
  ROW_SCRATCH(w, row_planar_t, ROW_ALL_POSES)[index] = pose;
  if (w->scene->needs_velocities) ROW_SCRATCH(w, row_planar_t, ROW_ALL_VELOCITIES)
  [index] = row_global_velocity(pose.a, ROW_COLUMN(w, row_planar_t, ROW_VELOCITY)[mover],
                                !runs || ROW_COLUMN(w, row_byte, ROW_STALLED)[mover] != 0);
}

/* Calls all controllers of a world, if its models are due. It comes to its barriers in any case,
 * because PoCL 3 crashes in kernels with barriers that depend on a condition. */
RAY_FUNCTION void row_run_controls(const row_world_t* w, int is_due, double time) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  const ray_uint positions = is_due ? scene->positions : 0, looks = is_due ? scene->looks : 0;
  const ray_uint driven = is_due ? scene->driven : 0;
  ray_uint i;
  for (i = ROW_ITEM; i < positions; i += ROW_ITEMS) row_gather_robot(w, i);
  for (i = ROW_ITEM; i < looks; i += ROW_ITEMS) row_do_look(w, i, 0);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < looks; i += ROW_ITEMS) row_do_look(w, i, 1);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < driven; i += ROW_ITEMS) row_call_controllers(w, i, time);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
