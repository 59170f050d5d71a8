/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Records that a host writes for a device, in addition to the grid of ray_walk.h. Like that file,
 * this one is C++ for libstage and OpenCL C 1.1 for devices, where it is compiled after ray_walk.h.
 * It alone defines the layout.
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

/* A fan: rays with a common start and length. */
typedef struct RAY_ALIGNED(16) {
  int x, y;                 /* start cell */
  ray_uint fraction;        /* start within its cell: x | y << 16, Q16 */
  ray_uint first_direction; /* index of its first direction; the others follow */
  int cosine, sine;         /* heading times length, Q16 cells */
  int mask_x, mask_y;       /* tiles hidden from the rays, see ray_mask_t */
  ray_uint mask_size;       /* width | height << 16, in tiles */
  ray_uint mask_first;      /* index of the first word of the self-mask */
  ray_uint first_ray;       /* index of its first ray in the batch */
  ray_uint samples;         /* number of rays */
} ray_fan_record_t;

/* Fans with the same number of rays, in the same layer of the grid. */
typedef struct RAY_ALIGNED(16) {
  ray_uint first_item;       /* first work-item; there is one per ray */
  ray_uint fans;             /* number of fans */
  ray_uint samples;          /* rays per fan */
  ray_uint first_fan;        /* index of the first fan record */
  ray_uint region_maps;      /* offset of the region maps in all words */
  ray_uint tile_maps, tiles; /* offsets of the layer's maps and tiles */
  ray_uint layer;            /* its number */
} ray_group_record_t;

/* The further data of a fan that its ranges depend on: see Fan in libstage/sensing/fan.hh. Doubles
 * are given as their bits, because not every device has doubles. */
typedef struct RAY_ALIGNED(16) {
  ray_ulong x, y;         /* start in metres */
  ray_ulong cosine, sine; /* heading */
  ray_ulong range;        /* metres */
  ray_ulong tree;         /* bodies of this tree are passed */
} ray_range_record_t;

/* A body with its exact outline, in 64-bit words: centre and radius of its bounding circle; its
 * tree; its layers; its corners, x and y of each, one more than it has edges. */
#define RAY_BODY_EDGES 8
#define RAY_BODY_TREE 3
#define RAY_BODY_LAYERS 4
#define RAY_BODY_CORNERS 5
#define RAY_BODY_WORDS 24
/* An outline in a tile: body | edges << 32, as in OutlineFragment; the next one in the tile, or 0.
 */
#define RAY_OUTLINE_WORDS 2

/* OpenCL C 1.1 has no static assertions. */
typedef char ray_direction_has_8_bytes[sizeof(ray_direction_t) == 8 ? 1 : -1];
typedef char ray_fan_record_has_48_bytes[sizeof(ray_fan_record_t) == 48 ? 1 : -1];
typedef char ray_range_record_has_48_bytes[sizeof(ray_range_record_t) == 48 ? 1 : -1];
typedef char ray_group_record_has_32_bytes[sizeof(ray_group_record_t) == 32 ? 1 : -1];

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
