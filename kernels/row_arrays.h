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
  if (array->kind == ROW_UNLESS_STALLED && ROW_COLUMN(w, row_byte, ROW_STALLED)[place / 3])
    return 0;
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

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
