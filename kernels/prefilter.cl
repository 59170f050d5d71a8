/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The prefilter's kernels, in OpenCL C 1.1. ray_walk.h stands before this text when it is compiled.
 */

/* Walks the rays of some groups of fans, one work-item for a ray. A group's fans have the same
 * number of rays, in the same layer of the grid.
 *
 * words: the tile maps and the tiles of all layers.
 * batch, in int4: two for each group (its first work-item, fans, rays of each, place of its first
 *   fan in batch; where its tile maps and its tiles begin in words, 0, 0); three for each fan, the
 *   FanRecord of libstage/sensing/fan.hh.
 * windows: those of the fans, from first_window on.
 * hits: per_ray words for each ray of the batch, see HitLists in libstage/sensing/prefilter.hh. */
__kernel void walk_fans(__global const ray_super_t* directory, const uint directory_mask,
                        __global const uint* regions, __global const ulong* words, const int4 box,
                        __global const int4* batch, const uint first_group, const uint end_group,
                        __global const int2* directions, __global const ulong* windows,
                        const uint first_window, const uint per_ray, __global uint* hits) {
  const uint item = (uint)get_global_id(0);
  uint g = first_group;
  while (g + 1 < end_group && item >= (uint)batch[2 * (g + 1)].x) g++;
  const int4 group = batch[2 * g], layer = batch[2 * g + 1];
  const uint ray_of_group = item - (uint)group.x;
  const uint fan = ray_of_group / (uint)group.z;
  const uint sample = ray_of_group - fan * (uint)group.z;
  if (fan >= (uint)group.y) return;

  const uint place = (uint)group.w + 3 * fan;
  const int4 start = batch[place];       /* x, y, fraction, first direction */
  const int4 heading = batch[place + 1]; /* cosine, sine, window x, window y */
  const int4 rest = batch[place + 2];    /* window size, first word, first ray, samples */
  const int2 direction = directions[(uint)start.w + sample];

  ray_grid_t grid;
  grid.directory = directory;
  grid.directory_mask = directory_mask;
  grid.regions = regions;
  grid.tile_maps = words + (uint)layer.x;
  grid.tiles = words + (uint)layer.y;
  grid.min_x = box.x;
  grid.min_y = box.y;
  grid.max_x = box.z;
  grid.max_y = box.w;

  ray_window_t window;
  window.tiles = windows + first_window + (uint)rest.y;
  window.x = heading.z;
  window.y = heading.w;
  window.width = (uint)rest.x & 0xffffu;
  window.height = (uint)rest.x >> 16;

  ray_t ray;
  ray_begin(&ray, &grid, start.x, start.y, (int)((uint)start.z & 0xffffu),
            (int)((uint)start.z >> 16),
            ray_rotate_x(heading.x, heading.y, direction.x, direction.y),
            ray_rotate_y(heading.x, heading.y, direction.x, direction.y));

  __global uint* list = hits + (size_t)((uint)rest.z + sample) * per_ray;
  for (uint i = 0; i < per_ray; i++) {
    if (!ray_next(&grid, &window, &ray)) {
      list[i] = RAY_NO_HIT;
      return;
    }
    list[i] = ray_pack(ray.u, ray.v);
  }
}

/* Brings changed words up to date. `changes` and `places` are the same memory: `count` values, and
 * behind them their places in words. */
__kernel void update_words(__global ulong* words, __global const ulong* changes,
                           __global const uint* places, const uint count) {
  const uint i = (uint)get_global_id(0);
  if (i < count) words[places[2 * count + i]] = changes[i];
}
