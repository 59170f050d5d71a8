/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The kernels that step closed worlds, in OpenCL C 1.1. They are compiled after ray_walk.h,
 * records.h and the headers row_*.h. A work-group steps one world or a few: dimension 0 has the
 * work-items of a world, dimension 1 the worlds. `first` is the number of a launch's first world,
 * or its place in a list.
 *
 * image: the scene, see row_scene_t. state: the columns of all worlds. scratch: memory of worlds
 * during a step.
 */
row_world_t world_number(__global const ulong* image, __global ulong* state,
                         __global ulong* scratch, const ulong world) {
  return row_world_at((__global const row_byte*)image, (__global row_byte*)state,
                      (__global row_byte*)scratch, world);
}

/* The number or place of the work-item's world. */
uint world_of_item(const uint first) {
  return first + (uint)(get_group_id(0) * get_local_size(1) + get_local_id(1));
}

/* Steps all worlds, or those of a list. Contacts are those of cells. */
__kernel void step_rows(const uint first, __global const uint* list, const uint is_list,
                        __global const ulong* image, __global ulong* state, __global ulong* scratch,
                        const uint steps, const uint unseen) {
  const uint place = world_of_item(first);
  const row_world_t w = world_number(image, state, scratch, is_list ? list[place] : place);
  row_step_cells(&w, steps, unseen);
}

/* The first and the last part of a step with contacts of outlines. The kernels of islands.cl run
 * between them. */
__kernel void begin_outlines(const uint first, __global const uint* list, const uint is_list,
                             __global const ulong* image, __global ulong* state,
                             __global ulong* scratch, const uint unseen) {
  const uint place = world_of_item(first);
  const row_world_t w = world_number(image, state, scratch, is_list ? list[place] : place);
  row_begin_outlines(&w, unseen);
}

__kernel void end_outlines(const uint first, __global const uint* list, const uint is_list,
                           __global const ulong* image, __global ulong* state,
                           __global ulong* scratch) {
  const uint place = world_of_item(first);
  const row_world_t w = world_number(image, state, scratch, is_list ? list[place] : place);
  if (get_global_id(0) == 0 && get_global_id(1) == 0) row_forget_waiting(&w);
  row_end_outlines(&w);
}

/* Resets the worlds of a list, each with given_bytes bytes of its own. */
__kernel void reset_rows(const uint first, __global const ulong* image, __global ulong* state,
                         __global const uint* worlds, __global const uchar* given,
                         const ulong columns, const uint given_bytes) {
  const row_world_t w = world_number(image, state, state, worlds[world_of_item(first)]);
  row_reset(&w, given + (size_t)world_of_item(first) * given_bytes, columns);
}

/* Puts the worlds of a list into states of `starts`, which have start_words words of 8 bytes each:
 * start_of has the number of that of each world. Each has given_bytes bytes of its own. */
__kernel void restore_rows(const uint first, __global const ulong* image, __global ulong* state,
                           __global const uint* worlds, __global const ulong* starts,
                           __global const uint* start_of, const uint start_words,
                           __global const uchar* given, const ulong columns,
                           const uint given_bytes) {
  const uint place = world_of_item(first);
  const row_world_t w = world_number(image, state, state, worlds[place]);
  __global const ulong* const start = starts + (size_t)start_of[place] * start_words;
  row_restore(&w, (__global const row_byte*)start, given + (size_t)place * given_bytes, columns, 0);
}

/* Each work-item gives one robot a command. */
__kernel void give_rows(__global const ulong* image, __global ulong* state,
                        __global const row_given_t* given, const uint count) {
  if (get_global_id(0) < count) {
    const row_given_t one = given[get_global_id(0)];
    const row_world_t w = world_number(image, state, state, one.world);
    row_give(&w, one);
  }
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

/* Kernels of arrays have a work-item for each of the `count` entries of each chosen world: of all
 * worlds, those of a list, or those with a flag. `first` is the number of the first one of this
 * launch, `worlds` that of all. A work-item without a world gets the number NO_WORLD. */
#define NO_WORLD (~(ulong)0)

ulong chosen_world(__global const uint* list, __global const uchar* flags, const uint choice,
                   const uint first, const uint worlds, const uint count) {
  const uint number = first + (uint)get_global_id(0) / count;
  if (number >= worlds || (choice == ROW_FLAGGED_WORLDS && !flags[number])) return NO_WORLD;
  return choice == ROW_LISTED_WORLDS ? list[number] : number;
}

/* Writes entries of worlds to an array, which is `offset` bytes behind `to`. */
__kernel void gather_rows(__global const uint* list, __global const uchar* flags, const uint choice,
                          const uint first, const uint worlds, const uint count,
                          __global const ulong* image, __global ulong* state,
                          __global const row_entry_t* entries, __global const ulong* values,
                          const uint kind, const uint column, const uint elements,
                          const uint of_readings, __global uchar* to, const ulong offset) {
  const ulong world = chosen_world(list, flags, choice, first, worlds, count);
  const row_array_t array = array_of(kind, column, elements, of_readings);
  if (world != NO_WORLD) {
    const row_world_t w = world_number(image, state, state, world);
    row_gather(&w, &array, entries[(uint)get_global_id(0) % count], values, to + offset);
  }
}

/* Gives robots of worlds their commands. */
__kernel void command_rows(__global const uint* list, __global const uchar* flags,
                           const uint choice, const uint first, const uint worlds, const uint count,
                           __global const ulong* image, __global ulong* state,
                           __global const row_entry_t* entries, const uint elements,
                           __global const ulong* from) {
  const ulong world = chosen_world(list, flags, choice, first, worlds, count);
  const row_array_t array = array_of(ROW_COMMANDS, ROW_COMMAND, elements, 0);
  if (world != NO_WORLD) {
    const row_world_t w = world_number(image, state, state, world);
    row_command(&w, &array, entries[(uint)get_global_id(0) % count], from);
  }
}

/* Sets the words of worlds to 0, `count` for each. */
__kernel void clear_rows(__global const uint* list, __global const uchar* flags, const uint choice,
                         const uint first, const uint worlds, const uint count,
                         __global ulong* words) {
  const ulong world = chosen_world(list, flags, choice, first, worlds, count);
  if (world != NO_WORLD) words[world * count + (uint)get_global_id(0) % count] = 0;
}

/* Moves robots of all worlds, see row_place(). */
__kernel void place_rows(const uint first, __global const ulong* image, __global ulong* state,
                         __global ulong* scratch, __global const row_entry_t* entries,
                         const uint count, const uint robots, __global const ulong* poses,
                         __global const uchar* chosen) {
  const row_world_t w = world_number(image, state, scratch, world_of_item(first));
  row_place(&w, entries, count, robots, poses, chosen);
}

/* Resets the worlds that have a flag. They keep their properties, and their seeds, on which nothing
 * else depends. */
__kernel void reset_flagged_rows(const uint first, __global const ulong* image,
                                 __global ulong* state, __global const uchar* flags) {
  const row_world_t w = world_number(image, state, state, world_of_item(first));
  if (flags[w.world]) row_reset_again(&w);
}
