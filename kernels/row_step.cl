/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The kernels that step closed worlds, in OpenCL C 1.1. They are compiled after ray_walk.h,
 * records.h and the headers row_*.h. A work-group steps a world.
 *
 * image: the scene, see row_scene_t. state: the columns of all worlds. scratch: memory of worlds
 * during a step.
 */
row_world_t world_number(__global const ulong* image, __global ulong* state,
                         __global ulong* scratch, const ulong world) {
  row_world_t w;
  w.image = (__global const row_byte*)image;
  w.scene = (__global const row_scene_t*)image;
  w.state = (__global row_byte*)state;
  w.scratch = (__global row_byte*)scratch + world * w.scene->scratch_bytes;
  w.world = world;
  return w;
}

__kernel void step_rows(__global const ulong* image, __global ulong* state, __global ulong* scratch,
                        const uint steps) {
  const row_world_t w = world_number(image, state, scratch, get_group_id(0));
  row_step(&w, steps);
}

/* Steps only the worlds of a list. */
__kernel void step_some_rows(__global const ulong* image, __global ulong* state,
                             __global ulong* scratch, __global const uint* worlds,
                             const uint steps) {
  const row_world_t w = world_number(image, state, scratch, worlds[get_group_id(0)]);
  row_step(&w, steps);
}

/* Each work-group resets one world: worlds[i], with given_bytes bytes of its own. */
__kernel void reset_rows(__global const ulong* image, __global ulong* state,
                         __global const uint* worlds, __global const uchar* given,
                         const uint columns, const uint given_bytes) {
  const row_world_t w = world_number(image, state, state, worlds[get_group_id(0)]);
  row_reset(&w, given + (size_t)get_group_id(0) * given_bytes, columns);
}

row_array_t array_of(const uint kind, const uint column, const uint elements,
                     const uint of_readings) {
  row_array_t array;
  array.kind = kind;
  array.column = column;
  array.elements = elements;
  array.of_readings = of_readings;
  return array;
}

/* Each work-item writes one of `count` entries of one of `worlds` worlds to an array. */
__kernel void gather_rows(__global const ulong* image, __global ulong* state, const uint worlds,
                          __global const row_entry_t* entries, const uint count,
                          __global const ulong* values, const uint kind, const uint column,
                          const uint elements, const uint of_readings, __global uchar* to) {
  const ulong item = get_global_id(0), world = item / count;
  const row_world_t w = world_number(image, state, state, world);
  const row_array_t array = array_of(kind, column, elements, of_readings);
  if (world < worlds) row_gather(&w, &array, entries[item - world * count], values, to);
}

/* The i-th of some worlds. If is_list is 0, all worlds are meant. */
ulong listed_world(__global const uint* list, const uint is_list, const ulong i,
                   const uint worlds) {
  return is_list && i < worlds ? list[i] : i;
}

/* Each work-item gives one of `count` robots of one of `worlds` worlds its command. */
__kernel void command_rows(__global const ulong* image, __global ulong* state,
                           __global const uint* list, const uint is_list, const uint worlds,
                           __global const row_entry_t* entries, const uint count,
                           const uint elements, __global const ulong* from) {
  const ulong item = get_global_id(0), i = item / count;
  const row_world_t w = world_number(image, state, state, listed_world(list, is_list, i, worlds));
  const row_array_t array = array_of(ROW_COMMANDS, ROW_COMMAND, elements, 0);
  if (i < worlds) row_command(&w, &array, entries[item - i * count], from);
}

/* Each work-item sets one of `count` words of one of `worlds` worlds to 0. */
__kernel void clear_rows(__global const uint* list, const uint is_list, const uint worlds,
                         const uint count, __global ulong* words) {
  const ulong item = get_global_id(0), i = item / count;
  if (i < worlds) words[listed_world(list, is_list, i, worlds) * count + (item - i * count)] = 0;
}
