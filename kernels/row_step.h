/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The step of a closed world on a device: Rows::Stepper::Step() with the same operations in the
 * same order, and the reset. Compiled after row_rays.h and row_outlines.h.
 */
#ifndef STAGE_KERNELS_ROW_STEP_H
#define STAGE_KERNELS_ROW_STEP_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_driven.h"
#include "kernels/row_outlines.h"
#include "kernels/row_rays.h"
namespace Stg {
#endif

#define ROW_SECOND 1e6 /* microseconds */

/* See Rows::Stepper::DrawEnergy(). */
RAY_FUNCTION void row_draw_energy(const row_world_t* w) {
  ray_uint i;
  for (i = 0; i < w->scene->consumers; i++) {
    const row_consumer_t consumer = ROW_PART(w, row_consumer_t, ROW_CONSUMERS)[i];
    RAY_GLOBAL double* const stored = ROW_COLUMN(w, double, ROW_STORED) + consumer.pack;
    RAY_GLOBAL row_energy_t* const totals = ROW_COLUMN(w, row_energy_t, ROW_ENERGY);
    const double watts = consumer.mover == ROW_NONE
                             ? consumer.watts
                             : ROW_COLUMN(w, double, ROW_WATTS)[consumer.mover];
    const double before = *stored, wanted = watts * 0.1;
    const int infinite = before < 0 || row_is_infinite(before);
    const double amount = infinite ? wanted : row_smaller(wanted, before);
    if (!(watts > 0) || !(wanted > 0) || row_is_infinite(amount)) continue;
    if (amount > 0 && infinite) totals->input += amount;
    if (amount > 0 && !infinite) {
      const double left = before - row_smaller(before, amount);
      const double change = (left > 0 ? left : 0) - (before > 0 ? before : 0);
      if (change != 0) totals->stored += change;
      *stored = left;
    }
    ROW_COLUMN(w, double, ROW_DISSIPATED)[consumer.pack] += amount;
    if (amount != 0) totals->dissipated += amount;
  }
}

/* Velocities and readings, if the models are due. Nobody sees the readings of an `unseen` update:
 * they are left out, unless the step depends on them. */
RAY_FUNCTION void row_update(const row_world_t* w, int is_due, int unseen, double dt) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  const int casts = is_due && (!unseen || scene->needs_rays);
  const ray_uint movers = is_due ? scene->movers : 0, sensors = casts ? scene->sensors : 0;
  ray_uint i;
  for (i = ROW_ITEM; i < movers; i += ROW_ITEMS) row_drive(w, i, dt);
  for (i = ROW_ITEM; i < sensors; i += ROW_ITEMS) row_place_fan(w, i);
  if (casts && scene->any_exact)
    for (i = ROW_ITEM; i < scene->bodies; i += ROW_ITEMS) row_place_corners(w, i);
  ROW_BARRIER();
  for (i = ROW_ITEM; casts && i < scene->rays; i += ROW_ITEMS) row_cast_ray(w, i);
  ROW_BARRIER();
  if (scene->any_noise)
    for (i = ROW_ITEM; i < sensors; i += ROW_ITEMS) row_add_errors(w, i);
  for (i = ROW_ITEM; i < movers; i += ROW_ITEMS) row_store_sensed_pose(w, i);
}

/* The clock of a world, which is kept during steps. */
typedef struct {
  ray_ulong now, next, last; /* update */
  int is_due;
} row_clock_t;

RAY_FUNCTION row_clock_t row_read_clock(const row_world_t* w) {
  row_clock_t clock;
  clock.now = *ROW_COLUMN(w, ray_ulong, ROW_TIME);
  clock.next = *ROW_COLUMN(w, ray_ulong, ROW_NEXT_UPDATE);
  clock.last = *ROW_COLUMN(w, ray_ulong, ROW_LAST_UPDATE);
  clock.is_due = 0;
  return clock;
}

RAY_FUNCTION void row_write_clock(const row_world_t* w, const row_clock_t* clock, ray_uint steps) {
  if (ROW_ITEM != 0) return;
  *ROW_COLUMN(w, ray_ulong, ROW_TIME) = clock->now;
  *ROW_COLUMN(w, ray_ulong, ROW_NEXT_UPDATE) = clock->next;
  *ROW_COLUMN(w, ray_ulong, ROW_LAST_UPDATE) = clock->last;
  *ROW_COLUMN(w, ray_ulong, ROW_STEPS) += steps;
}

/* The part of a step before the moves. Nobody looks at readings before `left` further steps. */
RAY_FUNCTION void row_begin_step(const row_world_t* w, row_clock_t* clock, ray_ulong left) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  double dt;
  clock->now += scene->step;
  clock->is_due = clock->next <= clock->now;
  dt = (double)(clock->now - clock->last) / ROW_SECOND;
  if (clock->is_due) {
    clock->last = clock->now;
    clock->next = scene->interval > 1 ? (clock->now / scene->interval + 1) * scene->interval
                                      : clock->now + scene->interval;
  }
  row_update(w, clock->is_due, (clock->next - clock->now - 1) / scene->step < left, dt);
}

/* The part of a step after the moves. */
RAY_FUNCTION void row_end_step(const row_world_t* w, const row_clock_t* clock) {
  ROW_BARRIER();
  row_run_controls(w, clock->is_due, (double)clock->now / ROW_SECOND);
  if (ROW_ITEM == 0) row_draw_energy(w);
  ROW_BARRIER();
}

/* Makes steps of a world with contacts of cells. Nobody looks at readings in between, nor before
 * `unseen` further steps. */
RAY_FUNCTION void row_step_cells(const row_world_t* w, ray_uint steps, ray_uint unseen) {
  row_clock_t clock = row_read_clock(w);
  ray_uint i;
  for (i = 0; i < steps; i++) {
    row_begin_step(w, &clock, (ray_ulong)unseen + (steps - 1 - i));
    row_move(w);
    row_end_step(w, &clock);
  }
  row_write_clock(w, &clock, steps);
}

/* Makes the first part of a step of a world with contacts of outlines. Nobody looks at readings
 * before `unseen` further steps. */
RAY_FUNCTION void row_begin_outlines(const row_world_t* w, ray_uint unseen) {
  row_clock_t clock = row_read_clock(w);
  row_begin_step(w, &clock, unseen);
  row_write_clock(w, &clock, 0);
  row_begin_moves(w);
}

/* Makes the rest of the step, after all islands have been solved. */
RAY_FUNCTION void row_end_outlines(const row_world_t* w) {
  row_clock_t clock = row_read_clock(w);
  clock.is_due = clock.last == clock.now;
  row_end_moves(w);
  row_end_step(w, &clock);
  row_write_clock(w, &clock, 1);
}

/* Copies bytes, in the largest words that fit. */
RAY_FUNCTION void row_copy(RAY_GLOBAL const row_byte* from, RAY_GLOBAL row_byte* to,
                           ray_ulong bytes) {
  const ray_ulong odd = (ray_ulong)from | (ray_ulong)to | bytes;
  ray_ulong i;
  if ((odd & 7) == 0)
    for (i = ROW_ITEM; i < bytes / 8; i += ROW_ITEMS)
      ((RAY_GLOBAL ray_ulong*)to)[i] = ((RAY_GLOBAL const ray_ulong*)from)[i];
  else if ((odd & 3) == 0)
    for (i = ROW_ITEM; i < bytes / 4; i += ROW_ITEMS)
      ((RAY_GLOBAL ray_uint*)to)[i] = ((RAY_GLOBAL const ray_uint*)from)[i];
  else
    for (i = ROW_ITEM; i < bytes; i += ROW_ITEMS) to[i] = from[i];
}

/* Puts a world into a state, except for the columns with a bit in `kept`. `start` has the columns
 * of one world at row_scene_t::starts, and `given`, one after the other, those with a bit in
 * `columns`, which replace them. */
RAY_FUNCTION void row_restore(const row_world_t* w, RAY_GLOBAL const row_byte* start,
                              RAY_GLOBAL const row_byte* given, ray_ulong columns, ray_ulong kept) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  ray_uint column;
  for (column = 0; column < ROW_COLUMNS; column++) {
    const int is_given = ((columns >> column) & 1) != 0;
    RAY_GLOBAL const row_byte* const from = is_given ? given : start + scene->starts[column];
    RAY_GLOBAL row_byte* const to =
        w->state + scene->columns[column] + w->world * scene->row_bytes[column];
    if (((kept >> column) & 1) == 0) row_copy(from, to, scene->row_bytes[column]);
    if (is_given) given += scene->row_bytes[column];
  }
}

/* Resets a world to its state after loading. `given` and `columns`: what depends on its seed, see
 * row_restore(). */
RAY_FUNCTION void row_reset(const row_world_t* w, RAY_GLOBAL const row_byte* given,
                            ray_ulong columns) {
  row_restore(w, ROW_PART(w, row_byte, ROW_START), given, columns, 0);
}

/* Resets a world to its state after loading, with its seed and properties. */
RAY_FUNCTION void row_reset_again(const row_world_t* w) {
  RAY_GLOBAL const row_byte* const start = ROW_PART(w, row_byte, ROW_START);
  row_restore(w, start, start, 0, w->scene->kept);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
