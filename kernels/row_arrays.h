/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Arrays of what other programs read and write: poses, readings and commands of chosen robots of
 * all worlds. Compiled after row_step.h.
 */
#ifndef STAGE_KERNELS_ROW_ARRAYS_H
#define STAGE_KERNELS_ROW_ARRAYS_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_step.h"
namespace Stg {
#endif

/* The number at a place of a column as a double. `values`: bits of doubles. */
RAY_FUNCTION double row_number_at(const row_world_t* w, const row_array_t* array,
                                  RAY_GLOBAL const ray_ulong* values, ray_uint place) {
  if (array->kind == ROW_SECONDS)
    return (double)ROW_COLUMN(w, ray_ulong, array->column)[place] / ROW_SECOND;
  if (array->kind == ROW_LOOKED_UP)
    return ROW_NUMBER(values[ROW_COLUMN(w, row_byte, array->column)[place]]);
  if (array->kind == ROW_ACTUAL) { /* see RobotView::GetActualVelocity() */
    if (w->scene->outlines && ROW_COLUMN(w, row_byte, ROW_HINDERED)[place / 3])
      return ROW_COLUMN(w, double, ROW_MADE)[place];
    if (ROW_COLUMN(w, row_byte, ROW_STALLED)[place / 3]) return 0;
  }
  return ROW_COLUMN(w, double, array->column)[place];
}

/* Writes an element of a world to an array of all worlds. */
RAY_FUNCTION void row_gather(const row_world_t* w, const row_array_t* array, row_entry_t entry,
                             RAY_GLOBAL const ray_ulong* values, RAY_GLOBAL row_byte* to) {
  const ray_ulong at = w->world * array->elements + entry.element;
  if (array->kind == ROW_FLAGS)
    to[at] = ROW_COLUMN(w, row_byte, array->column)[entry.place] != 0;
  else if (array->of_readings && *ROW_COLUMN(w, ray_ulong, ROW_LAST_UPDATE) == 0)
    ((RAY_GLOBAL double*)to)[at] = ROW_NUMBER((ray_ulong)0x7ff8 << 48);
  else
    ((RAY_GLOBAL double*)to)[at] = row_number_at(w, array, values, entry.place);
}

/* Gives a robot a command of velocity, unless one of its numbers is NaN.
 * `from`: bits of doubles. */
RAY_FUNCTION void row_command(const row_world_t* w, const row_array_t* array, row_entry_t entry,
                              RAY_GLOBAL const ray_ulong* from) {
  RAY_GLOBAL const ray_ulong* const bits = from + 3 * (w->world * array->elements + entry.element);
  row_planar_t command;
  command.x = ROW_NUMBER(bits[0]);
  command.y = ROW_NUMBER(bits[1]);
  command.a = ROW_NUMBER(bits[2]);
  if (row_is_nan(command.x) || row_is_nan(command.y) || row_is_nan(command.a)) return;
  ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[entry.place] = command;
  ROW_COLUMN(w, row_byte, ROW_MODE)[entry.place] = ROW_VELOCITY_MODE;
}

/* Gives a robot a command of any mode. */
RAY_FUNCTION void row_give(const row_world_t* w, row_given_t given) {
  ROW_COLUMN(w, row_planar_t, ROW_COMMAND)[given.mover] = given.command;
  ROW_COLUMN(w, row_byte, ROW_MODE)[given.mover] = (row_byte)given.mode;
}

/* Asks for a mover to be moved to a pose, unless it is there or the pose is not finite. See
 * Rows::Stepper::Place(). */
RAY_FUNCTION void row_ask_for_place(const row_world_t* w, ray_uint mover,
                                    RAY_GLOBAL const ray_ulong* bits) {
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED) + mover;
  const row_planar_t now = ROW_COLUMN(w, row_planar_t, ROW_POSE)[mover];
  const row_planar_t to = row_planar(ROW_NUMBER(bits[0]), ROW_NUMBER(bits[1]), ROW_NUMBER(bits[2]));
  if (to.x == now.x && to.y == now.y && to.a == now.a) return;
  if (!row_is_finite(to.x) || !row_is_finite(to.y) || !row_is_finite(to.a)) return;
  wanted->asked = 1;
  wanted->place.x = to.x;
  wanted->place.y = to.y;
  wanted->place.a = row_normalize(to.a);
  wanted->place.turn = row_turn(wanted->place.a);
}

/* Numbers the rasterizations of the movers that are moved, in the order of the entries, without
 * collision tests. */
RAY_FUNCTION void row_decide_places(const row_world_t* w, RAY_GLOBAL const row_entry_t* entries,
                                    ray_uint count) {
  RAY_GLOBAL row_drawn_t* const drawn = ROW_SCRATCH(w, row_drawn_t, ROW_DRAWN);
  ray_ulong stamps = *ROW_COLUMN(w, ray_ulong, ROW_STAMPS);
  ray_uint i, b;
  for (i = 0; i < w->scene->bodies; i++) drawn[i].stamp = 0;
  for (i = 0; i < count; i++) {
    RAY_GLOBAL const row_mover_t* const mover =
        ROW_PART(w, row_mover_t, ROW_MOVERS) + entries[i].place;
    if (!ROW_SCRATCH(w, row_wanted_t, ROW_WANTED)[entries[i].place].asked) continue;
    for (b = mover->first_body; b < mover->first_body + mover->bodies; b++) {
      if (!drawn[b].moved) continue;
      drawn[b].stamp = ++stamps;
      row_widen_extent(w, drawn[b].box);
    }
  }
  *ROW_COLUMN(w, ray_ulong, ROW_STAMPS) = stamps;
}

/* Moves chosen robots of a world to other poses. `poses`: bits of x, y and heading by robot of all
 * worlds; `chosen`: a flag by robot. */
RAY_FUNCTION void row_place(const row_world_t* w, RAY_GLOBAL const row_entry_t* entries,
                            ray_uint count, ray_uint robots, RAY_GLOBAL const ray_ulong* poses,
                            RAY_GLOBAL const row_byte* chosen) {
  RAY_GLOBAL row_wanted_t* const wanted = ROW_SCRATCH(w, row_wanted_t, ROW_WANTED);
  const ray_ulong first = w->world * robots;
  ray_uint i;
  for (i = ROW_ITEM; i < w->scene->movers; i += ROW_ITEMS) wanted[i].asked = 0;
  ROW_BARRIER();
  for (i = ROW_ITEM; i < count; i += ROW_ITEMS)
    if (chosen[first + entries[i].element])
      row_ask_for_place(w, entries[i].place, poses + 3 * (first + entries[i].element));
  ROW_BARRIER();
  for (i = ROW_ITEM; i < w->scene->bodies; i += ROW_ITEMS) row_draw(w, i);
  ROW_BARRIER();
  if (ROW_ITEM == 0) row_decide_places(w, entries, count);
  ROW_BARRIER();
  for (i = ROW_ITEM; i < w->scene->bodies; i += ROW_ITEMS) row_commit(w, i);
  for (i = ROW_ITEM; i < w->scene->movers; i += ROW_ITEMS)
    if (wanted[i].asked) row_take_place(w, i);
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
