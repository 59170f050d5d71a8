/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The kernels that step closed worlds, in OpenCL C 1.1. They are compiled after ray_walk.h,
 * records.h and the headers row_*.h. A work-group steps a world.
 *
 * image: the scene, see row_scene_t. state: the columns of all worlds. scratch: memory of worlds
 * during a step.
 */
row_world_t world_of_group(__global const ulong* image, __global ulong* state,
                           __global ulong* scratch) {
  row_world_t w;
  w.image = (__global const row_byte*)image;
  w.scene = (__global const row_scene_t*)image;
  w.state = (__global row_byte*)state;
  w.scratch = (__global row_byte*)scratch + get_group_id(0) * w.scene->scratch_bytes;
  w.world = get_group_id(0);
  return w;
}

__kernel void step_rows(__global const ulong* image, __global ulong* state, __global ulong* scratch,
                        const uint steps) {
  const row_world_t w = world_of_group(image, state, scratch);
  row_step(&w, steps);
}

/* Each work-group resets one world: worlds[i], with given_bytes bytes of its own. */
__kernel void reset_rows(__global const ulong* image, __global ulong* state,
                         __global const uint* worlds, __global const uchar* given,
                         const uint columns, const uint given_bytes) {
  row_world_t w = world_of_group(image, state, state);
  w.world = worlds[get_group_id(0)];
  row_reset(&w, given + (size_t)get_group_id(0) * given_bytes, columns);
}
