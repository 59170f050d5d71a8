/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * What a host writes for a device and its kernels read, beside the grid of ray_walk.h. Like that
 * file this one is C++ for libstage and OpenCL C 1.1 for the devices, where it stands behind it:
 * the only place that says how these records are laid out.
 */
#ifndef STAGE_KERNELS_RECORDS_H
#define STAGE_KERNELS_RECORDS_H

#ifndef RAY_IN_OPENCL
#include "kernels/ray_walk.h"
namespace Stg {
#endif

/* A direction relative to a sensor's heading: cosine and sine in Q30. */
typedef struct RAY_ALIGNED(8) {
  int cosine, sine;
} ray_direction_t;

/* A fan: rays that share their start and length. */
typedef struct RAY_ALIGNED(16) {
  int x, y;                 /* start cell */
  ray_uint fraction;        /* of the start in its cell: x | y << 16 */
  ray_uint first_direction; /* of its rays' directions, one behind the other */
  int cosine, sine;         /* heading times length, Q16 cells */
  int mask_x, mask_y;       /* tiles hidden from the rays, see ray_mask_t */
  ray_uint mask_size;       /* width | height << 16, in tiles */
  ray_uint mask_first;      /* of its words */
  ray_uint first_ray;       /* of its rays, among those of the batch */
  ray_uint samples;         /* how many rays */
} ray_fan_record_t;

/* Fans with the same number of rays, in the same layer of the grid. */
typedef struct RAY_ALIGNED(16) {
  ray_uint first_item;       /* of the launch: one for each ray */
  ray_uint fans;             /* how many */
  ray_uint samples;          /* rays of each */
  ray_uint first_fan;        /* of the fans' records */
  ray_uint region_maps;      /* where they begin, among all words */
  ray_uint tile_maps, tiles; /* where those of the layer do */
  ray_uint unused;
} ray_group_record_t;

/* 1.1 has no static assertions. */
typedef char ray_direction_has_8_bytes[sizeof(ray_direction_t) == 8 ? 1 : -1];
typedef char ray_fan_record_has_48_bytes[sizeof(ray_fan_record_t) == 48 ? 1 : -1];
typedef char ray_group_record_has_32_bytes[sizeof(ray_group_record_t) == 32 ? 1 : -1];

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
