/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The prefilter's kernels, in OpenCL C 1.1. They are compiled after ray_walk.h and records.h.
 */

/* The only body in the tile of the hit, or 0: see DeviceLayers in
 * libstage/sensing/device_layers.hh. */
uint only_body(__global const ulong* words, const ray_t* ray) {
  const uint slot = ray->region * 64 + ray->tile;
  return (uint)(words[slot / 2] >> (slot % 2 * 32));
}

/* The ray of a work-item. */
typedef struct {
  ray_grid_t grid;
  ray_mask_t mask;
  ray_t ray;
  uint fan, direction; /* indices of its records */
  uint number;         /* in the batch */
  uint layer;
} item_ray_t;

/* Begins the ray of this work-item. Returns 0 if there is none.
 *
 * words: bodies in tiles and region maps, then tile maps and tiles of each layer. */
int begin_item(__global const ray_super_t* directory, const uint directory_mask,
               __global const uint* regions, __global const ulong* words, const int4 box,
               __global const ray_group_record_t* groups, const uint first_group,
               const uint end_group, __global const ray_fan_record_t* fans,
               __global const ray_direction_t* directions, __global const ulong* masks,
               const uint first_mask, item_ray_t* of_item) {
  const uint item = (uint)get_global_id(0);
  uint g = first_group;
  while (g + 1 < end_group && item >= groups[g + 1].first_item) g++;
  const ray_group_record_t group = groups[g];
  const uint ray_of_group = item - group.first_item;
  const uint number = ray_of_group / group.samples;
  const uint sample = ray_of_group - number * group.samples;
  if (number >= group.fans) return 0;

  const ray_fan_record_t fan = fans[group.first_fan + number];
  of_item->fan = group.first_fan + number;
  of_item->direction = fan.first_direction + sample;
  of_item->number = fan.first_ray + sample;
  of_item->layer = group.layer;
  const ray_direction_t direction = directions[of_item->direction];

  ray_grid_t* const grid = &of_item->grid;
  grid->directory = directory;
  grid->directory_mask = directory_mask;
  grid->regions = regions;
  grid->region_maps = words + group.region_maps;
  grid->tile_maps = words + group.tile_maps;
  grid->tiles = words + group.tiles;
  grid->min_x = box.x;
  grid->min_y = box.y;
  grid->max_x = box.z;
  grid->max_y = box.w;

  ray_mask_t* const mask = &of_item->mask;
  mask->tiles = masks + first_mask + fan.mask_first;
  mask->x = fan.mask_x;
  mask->y = fan.mask_y;
  mask->width = fan.mask_size & 0xffffu;
  mask->height = fan.mask_size >> 16;

  ray_begin(&of_item->ray, grid, fan.x, fan.y, (int)(fan.fraction & 0xffffu),
            (int)(fan.fraction >> 16),
            ray_rotate_x(fan.cosine, fan.sine, direction.cosine, direction.sine),
            ray_rotate_y(fan.cosine, fan.sine, direction.cosine, direction.sine));
  return 1;
}

/* Walks the rays of some groups of fans, one work-item per ray. */
__kernel void walk_fans(__global const ray_super_t* directory, const uint directory_mask,
                        __global const uint* regions, __global const ulong* words, const int4 box,
                        __global const ray_group_record_t* groups, const uint first_group,
                        const uint end_group, __global const ray_fan_record_t* fans,
                        __global const ray_direction_t* directions, __global const ulong* masks,
                        const uint first_mask, const uint per_ray, __global uint* hits) {
  item_ray_t item;
  if (!begin_item(directory, directory_mask, regions, words, box, groups, first_group, end_group,
                  fans, directions, masks, first_mask, &item))
    return;
  __global uint* row = hits + (size_t)item.number * (1 + per_ray);
  for (uint i = 0; i < per_ray; i++) {
    if (!ray_next(&item.grid, &item.mask, &item.ray)) {
      row[1 + i] = RAY_NO_HIT;
      return;
    }
    row[1 + i] = ray_pack(item.ray.u, item.ray.v);
    if (i == 0) row[0] = only_body(words, &item.ray);
  }
}

/* Updates changed words. `changes` and `places` are the same memory: `count` values, then their
 * indices in `words`. */
__kernel void update_words(__global ulong* words, __global const ulong* changes,
                           __global const uint* places, const uint count) {
  const uint i = (uint)get_global_id(0);
  if (i < count) words[places[2 * count + i]] = changes[i];
}
