/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The prefilter's kernels, in OpenCL C 1.1. ray_walk.h stands before this text when it is compiled.
 */

/* Walks the rays of `fan_count` fans with `samples` rays each, one work-item for a ray.
 *
 * fans: three int4 for each fan, the FanRecord of libstage/sensing/fan.hh.
 * hits: per_ray words for each ray of the batch, see HitLists in libstage/sensing/prefilter.hh. */
__kernel void walk_fans(__global const ray_super_t* directory, const uint directory_mask,
                        __global const uint* regions, __global const ulong* tile_maps,
                        __global const ulong* tiles, const int4 box, __global const int4* fans,
                        const uint first_fan, const uint fan_count, const uint samples,
                        __global const int2* directions, __global const ulong* windows,
                        const uint per_ray, __global uint* hits) {
  const uint item = (uint)get_global_id(0);
  const uint fan = item / samples;
  const uint sample = item - fan * samples;
  if (fan >= fan_count) return;

  const int4 start = fans[3 * (first_fan + fan)];       /* x, y, fraction, first direction */
  const int4 heading = fans[3 * (first_fan + fan) + 1]; /* cosine, sine, window x, window y */
  const int4 rest =
      fans[3 * (first_fan + fan) + 2]; /* window size, first word, first ray, samples */
  const int2 direction = directions[(uint)start.w + sample];

  ray_grid_t grid;
  grid.directory = directory;
  grid.directory_mask = directory_mask;
  grid.regions = regions;
  grid.tile_maps = tile_maps;
  grid.tiles = tiles;
  grid.min_x = box.x;
  grid.min_y = box.y;
  grid.max_x = box.z;
  grid.max_y = box.w;

  ray_window_t window;
  window.tiles = windows + (uint)rest.y;
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

/* Brings changed words up to date: words[places[i]] = values[i]. */
__kernel void update_words(__global ulong* words, __global const uint* places,
                           __global const ulong* values, const uint count) {
  const uint i = (uint)get_global_id(0);
  if (i < count) words[places[i]] = values[i];
}
