/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The walk of a ray through the occupancy grid. This file is the reference: the host's walk of
 * several rays in lanes (libstage/sensing/simd/wide_walk_lanes.hh) and the recorded walk
 * (libstage/sensing/walk_record.hh) are tested against it.
 *
 * The file is C++ for libstage and OpenCL C 1.1 for devices, so that both run the same code. Every
 * decision compares exact 64-bit integer products. Floating point only guesses where a leap lands;
 * an integer test corrects the guess.
 *
 * Units. A cell is a pair of 32-bit integers. Lengths along a ray are in 16.16 fixed point cells
 * ("Q16"). A ray has a displacement (dx, dy) of at most RAY_LEG_CELLS cells; longer rays are walked
 * by the host as several legs of the same displacement, which join without rounding.
 *
 * Position along a ray. After crossing u cell borders in x and v in y the ray is in the cell (x0 +
 * sx*u, y0 + sy*v). The next border in x lies at the offset ((u + 1) << 16) - ox from the start,
 * where ox is the offset of the start in its cell in the direction of travel. The pair (u, v) is
 * the whole state: a walk can be resumed from it anywhere, even on another processor.
 *
 * Rules. The border in x is crossed next if bx * |dy| < by * |dx|. At a tie (a corner) y goes
 * first. A border exactly at the end of the ray is crossed. The start cell is part of the ray.
 */
#ifndef STAGE_KERNELS_RAY_WALK_H
#define STAGE_KERNELS_RAY_WALK_H

/* Compilers for devices define the first; generic offline compilers define only the second. */
#if defined(__OPENCL_VERSION__) || defined(__OPENCL_C_VERSION__)
#define RAY_IN_OPENCL
#ifdef cles_khr_int64 /* in the embedded profile 64-bit integers are an extension */
#pragma OPENCL EXTENSION cles_khr_int64 : enable
#endif
typedef long ray_long;
typedef ulong ray_ulong;
typedef uint ray_uint;
#define RAY_GLOBAL __global
#define RAY_FUNCTION
/* A large function that is called in several places. Compilers of GPUs copy all others into their
 * callers. */
#define RAY_LARGE_FUNCTION __attribute__((noinline))
/* Aligned, so that a device reads a record in few accesses, none across a cache line. */
#define RAY_ALIGNED(bytes) __attribute__((aligned(bytes)))
#else
#include <cstdint>
namespace Stg {
typedef int64_t ray_long;
typedef uint64_t ray_ulong;
typedef uint32_t ray_uint;
#define RAY_GLOBAL
#define RAY_FUNCTION static inline
#define RAY_LARGE_FUNCTION static inline
#define RAY_ALIGNED(bytes)
#endif

#define RAY_LEG_CELLS 16384 /* longest displacement of one walk; its Q16 value fits in 31 bits */
#define RAY_TILE_SHIFT 3    /* a tile: 8 x 8 cells, one bit each in a 64-bit word */
#define RAY_REGION_SHIFT 6  /* a region: 8 x 8 tiles, one bit each in its tile map */
#define RAY_BLOCK_SHIFT 9   /* a block: 8 x 8 regions, one bit each in its region map */
#define RAY_SUPER_SHIFT 10  /* a superregion: 2 x 2 blocks */
#define RAY_NO_HIT 0xffffffffu
#define RAY_LIMIT_BEHIND_START (-131072) /* a limit that lies behind any start */

/* A slot of the directory of superregions: a hash table with linear probing. index 0: free. */
typedef struct RAY_ALIGNED(16) {
  int x, y;
  ray_uint index;
  ray_uint padding;
} ray_super_t;

/* Occupied cells as nested bit maps. Region 0 and superregion 0 stand for "does not exist". */
typedef struct {
  RAY_GLOBAL const ray_super_t* directory;
  RAY_GLOBAL const ray_uint* regions; /* 256 per superregion, row by row */
  /* Four words per superregion, one per block: mask of its regions that are not empty. Shared by
   * all layers, so a marked region may be empty in this layer. */
  RAY_GLOBAL const ray_ulong* region_maps;
  RAY_GLOBAL const ray_ulong* tile_maps; /* one word per region: mask of its occupied tiles */
  RAY_GLOBAL const ray_ulong* tiles;     /* 64 words per region, row by row */
  ray_uint directory_mask;               /* slots - 1; the number of slots is a power of two */
  int min_x, min_y, max_x, max_y;        /* cells outside this box are all empty */
} ray_grid_t;

/* Self-mask, in tiles: cells that hold nothing but the body that carries the sensor. Its rays pass
 * them. An empty self-mask has a width of 0. */
typedef struct {
  RAY_GLOBAL const ray_ulong* tiles; /* row by row */
  int x, y;                          /* tile coordinates of the first tile */
  ray_uint width, height;            /* in tiles */
} ray_mask_t;

typedef struct {
  int x0, y0;           /* start cell */
  int sx, sy;           /* direction of travel, 1 or -1 */
  int ox, oy;           /* 0..65536: offset of the start in its cell, in the direction of travel */
  int adx, ady;         /* |displacement| */
  int limit_x, limit_y; /* last border worth crossing, as an offset */
  float dy_per_dx, dx_per_dy;
  int u, v;           /* borders crossed so far */
  int reported;       /* the current cell was returned already */
  ray_uint region;    /* region of the cell that ray_next() returned */
  ray_uint tile, bit; /* tile in that region, and bit in that tile */
} ray_t;

RAY_FUNCTION ray_long ray_product(int a, int b) { return (ray_long)a * (ray_long)b; }

/* Row-major index of (x, y) in its square of 2^shift by 2^shift. The shift is 3 for a cell in its
 * tile (its bit), a tile in its region or a region in its block; it is 1 for a block and 4 for a
 * region in its superregion. */
RAY_FUNCTION int ray_place(int x, int y, int shift) {
  const int mask = (1 << shift) - 1;
  return (x & mask) | ((y & mask) << shift);
}

#define RAY_HASH_X 0x9e3779b1u
#define RAY_HASH_Y 0x85ebca77u
#define RAY_HASH_SHIFT 15
RAY_FUNCTION ray_uint ray_hash(int x, int y) {
  ray_uint h = (ray_uint)x * RAY_HASH_X ^ (ray_uint)y * RAY_HASH_Y;
  return h ^ (h >> RAY_HASH_SHIFT);
}

/* Index of the superregion (x, y), or 0 if it does not exist. */
RAY_FUNCTION ray_uint ray_find_super(const ray_grid_t* grid, int x, int y) {
  ray_uint slot = ray_hash(x, y) & grid->directory_mask;
  for (;;) {
    const ray_super_t entry = grid->directory[slot];
    if (entry.index == 0 || (entry.x == x && entry.y == y)) return entry.index;
    slot = (slot + 1) & grid->directory_mask;
  }
}

/* Index in region_maps of the map of block (x, y), both in blocks, of a superregion. */
RAY_FUNCTION ray_uint ray_block_map(ray_uint super, int x, int y) {
  return super * 4 + (ray_uint)ray_place(x, y, 1);
}

/* The x coordinate (cosine * c - sine * s) of a rotation, rounded to nearest. (cosine, sine) is a
 * heading times a length in Q16, (c, s) a direction in Q30. */
RAY_FUNCTION int ray_rotate_x(int cosine, int sine, int c, int s) {
  return (int)((ray_product(cosine, c) - ray_product(sine, s) + ((ray_long)1 << 29)) >> 30);
}
RAY_FUNCTION int ray_rotate_y(int cosine, int sine, int c, int s) {
  return (int)((ray_product(sine, c) + ray_product(cosine, s) + ((ray_long)1 << 29)) >> 30);
}

/* Offset of the last border worth crossing on one axis: the end of the ray or of the occupied box,
 * whichever comes first. */
RAY_FUNCTION int ray_limit(int displacement, int offset, int start, int direction, int low,
                           int high) {
  /* Cells to the far side of the box, in 64 bits because the box may be anywhere. */
  const ray_long cells = direction > 0 ? (ray_long)high - start : (ray_long)start - low;
  if (cells < 0) return RAY_LIMIT_BEHIND_START;
  if (cells > RAY_LEG_CELLS) return displacement;
  {
    const int border = ((int)cells << 16) - offset;
    return border < displacement ? border : displacement;
  }
}

/* Prepares a walk by (dx, dy) from the fraction (fx, fy), in Q16, of the cell (x, y). */
RAY_FUNCTION void ray_begin(ray_t* ray, const ray_grid_t* grid, int x, int y, int fx, int fy,
                            int dx, int dy) {
  ray->x0 = x;
  ray->y0 = y;
  ray->sx = dx < 0 ? -1 : 1;
  ray->sy = dy < 0 ? -1 : 1;
  ray->ox = dx < 0 ? 65536 - fx : fx;
  ray->oy = dy < 0 ? 65536 - fy : fy;
  ray->adx = dx < 0 ? -dx : dx;
  ray->ady = dy < 0 ? -dy : dy;
  ray->limit_x = ray_limit(ray->adx, ray->ox, x, ray->sx, grid->min_x, grid->max_x);
  ray->limit_y = ray_limit(ray->ady, ray->oy, y, ray->sy, grid->min_y, grid->max_y);
  ray->dy_per_dx = ray->adx > 0 ? (float)ray->ady / (float)ray->adx : 0.0f;
  ray->dx_per_dy = ray->ady > 0 ? (float)ray->adx / (float)ray->ady : 0.0f;
  ray->u = 0;
  ray->v = 0;
  ray->reported = 0;
  ray->region = 0;
  ray->tile = 0;
  ray->bit = 0;
}

/* The tile's word without cells that the self-mask hides. */
RAY_FUNCTION ray_ulong ray_visible(const ray_mask_t* mask, ray_ulong word, int x, int y) {
  const ray_uint wx = (ray_uint)((x >> RAY_TILE_SHIFT) - mask->x);
  const ray_uint wy = (ray_uint)((y >> RAY_TILE_SHIFT) - mask->y);
  if (wx < mask->width && wy < mask->height) return word & ~mask->tiles[wy * mask->width + wx];
  return word;
}

/* Finds where a leap across the border `to` of one axis lands: the number of borders of the other
 * axis before that border, or up to it if `ties`. At least `from`. `offset` and `across` are the
 * start's offset and |displacement| on the crossed axis, `other_offset` and `along` those on the
 * other axis; slope = along / across. */
RAY_FUNCTION int ray_leap_end(int to, int offset, int across, int other_offset, int along,
                              float slope, int from, int ties) {
  const int at = (to << 16) - offset;
  const ray_long target = ray_product(at, along) + ties;
  int n = ((int)((float)at * slope) + other_offset) >> 16;
  if (n < from) n = from;
  while (ray_product(((n + 1) << 16) - other_offset, across) < target) n++;
  while (n > from && ray_product((n << 16) - other_offset, across) >= target) n--;
  return n;
}

/* Number of cells from a cell to the far side of its square of 2^shift cells, on one axis. */
RAY_FUNCTION int ray_cells_left(int cell, int direction, int shift) {
  const int mask = (1 << shift) - 1;
  return direction > 0 ? mask - (cell & mask) : (cell & mask);
}

/* Compares the next borders: (bx * |dy| - by * |dx|) / 2^bits, rounded down. Negative if the border
 * in x is nearer. */
RAY_FUNCTION int ray_compare(int bx, int ady, int by, int adx, int bits) {
  return (int)((ray_product(bx, ady) - ray_product(by, adx)) >> bits);
}

/* ray_compare() after a step in y, or in x if `in_x` is all ones. `both` is |dx| + |dy|. */
RAY_FUNCTION int ray_step(int e, int adx, ray_uint both, int in_x) {
  return (int)((ray_uint)e - (ray_uint)adx + (both & (ray_uint)in_x));
}

/* Advances to the next occupied cell that the self-mask does not hide. Returns 1 with the cell in
 * (u, v), region, tile and bit, or 0 if the ray ends first.
 *
 * The walk leaps over empty blocks and superregions. It steps from region to region in a block that
 * holds something, from tile to tile in such a region, and from cell to cell in such a tile: each
 * time in one word of 8 x 8 squares. The next border is unpredictable, so steps select by
 * arithmetic; on a CPU a mispredicted branch costs more than the step. in_x is all ones if the
 * border in x is next, else 0. */
RAY_FUNCTION int ray_next(const ray_grid_t* grid, const ray_mask_t* mask, ray_t* ray) {
  const int sx = ray->sx, sy = ray->sy, ox = ray->ox, oy = ray->oy;
  const int adx = ray->adx, ady = ray->ady;
  const int limit_x = ray->limit_x, limit_y = ray->limit_y;
  /* Crossing a border changes the difference of the next borders by 2^16 * ady in x and by
   * -2^16 * adx in y. The low 16 bits never affect its sign, and the rest fits in 32 bits. */
  const ray_uint both = (ray_uint)adx + (ray_uint)ady;
  /* Bit offsets in a word of 8 x 8: a step in y, and the amount that turns it into a step in x. */
  const int to_next_y = sy * 8, to_next_x = sx - to_next_y;
  int u = ray->u, v = ray->v;
  /* Mask of the cell that was returned last; it lies in the first tile that is visited. */
  ray_ulong seen = 0;
  int region_x = 0, region_y = 0, first = 1;
  ray_uint super = 0, region = 0;
  ray_ulong tile_map = 0;

  /* The end of the ray is checked per leap, not per cell. */
  while (!(((u << 16) - ox > limit_x) | ((v << 16) - oy > limit_y))) {
    const int x = ray->x0 + sx * u, y = ray->y0 + sy * v;
    const int rx = x >> RAY_REGION_SHIFT, ry = y >> RAY_REGION_SHIFT;
    int in_x, to_x, to_y; /* next borders to cross, and which comes first */

    if (first | (rx ^ region_x) | (ry ^ region_y)) {
      if (first | (((rx ^ region_x) | (ry ^ region_y)) >> 4))
        super = ray_find_super(grid, x >> RAY_SUPER_SHIFT, y >> RAY_SUPER_SHIFT);
      region = super ? grid->regions[super * 256 + (ray_uint)ray_place(rx, ry, 4)] : 0;
      tile_map = region ? grid->tile_maps[region] : 0;
      region_x = rx;
      region_y = ry;
      if (first && ray->reported) seen = (ray_ulong)1 << ray_place(x, y, 3);
      first = 0;
    }

    /* The word of squares to walk in, and the size of a square. */
    ray_ulong squares = tile_map;
    int shift = RAY_TILE_SHIFT;
    if (tile_map != 0) {
      const int t = ray_place(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT, 3);
      if ((tile_map >> t) & 1) {
        const ray_ulong word =
            ray_visible(mask, grid->tiles[region * 64 + (ray_uint)t], x, y) & ~seen;
        seen = 0;
        if (word != 0) {
          /* Walk from cell to cell, up to the edge of the tile. */
          int left_x = ray_cells_left(x, sx, RAY_TILE_SHIFT);
          int left_y = ray_cells_left(y, sy, RAY_TILE_SHIFT);
          int bit = ray_place(x, y, 3);
          int e = ray_compare(((u + 1) << 16) - ox, ady, ((v + 1) << 16) - oy, adx, 16);
          u += left_x;
          v += left_y;
          while (((word >> bit) & 1) == 0) {
            const int in = e >> 31;
            e = ray_step(e, adx, both, in);
            bit += to_next_y + (in & to_next_x);
            left_x += in;
            left_y -= 1 + in;
            if ((left_x | left_y) < 0) break;
          }
          u -= left_x;
          v -= left_y;
          if ((left_x | left_y) < 0) continue;
          if (((u << 16) - ox > limit_x) | ((v << 16) - oy > limit_y)) return 0;
          ray->u = u;
          ray->v = v;
          ray->reported = 1;
          ray->region = region;
          ray->tile = (ray_uint)t;
          ray->bit = (ray_uint)bit;
          return 1;
        }
      }
    } else {
      squares = super ? grid->region_maps[ray_block_map(super, rx >> 3, ry >> 3)] : 0;
      shift = squares != 0 ? RAY_REGION_SHIFT : super ? RAY_BLOCK_SHIFT : RAY_SUPER_SHIFT;
    }

    to_x = u + 1 + ray_cells_left(x, sx, shift);
    to_y = v + 1 + ray_cells_left(y, sy, shift);
    if (squares == 0) {
      in_x = ray_product((to_x << 16) - ox, ady) < ray_product((to_y << 16) - oy, adx) ? -1 : 0;
    } else {
      /* Walk from square to square, to an occupied one or to the edge of the word. */
      int e = ray_compare((to_x << 16) - ox, ady, (to_y << 16) - oy, adx, 16 + shift);
      int left_x = ray_cells_left(x >> shift, sx, 3), left_y = ray_cells_left(y >> shift, sy, 3);
      int square = ray_place(x >> shift, y >> shift, 3);
      to_x += left_x << shift;
      to_y += left_y << shift;
      do {
        in_x = e >> 31;
        e = ray_step(e, adx, both, in_x);
        left_x += in_x;
        left_y -= 1 + in_x;
        square += to_next_y + (in_x & to_next_x);
      } while (!((left_x | left_y) < 0 || ((squares >> square) & 1)));
      /* The border that was crossed last. */
      to_x -= (left_x - in_x) << shift;
      to_y -= (left_y + 1 + in_x) << shift;
    }

    /* Find the cell that stepping would have reached. At a tie the border in y comes first, so
     * borders in y count before a border in x, but not the other way round. */
    if (in_x) {
      v = ray_leap_end(to_x, ox, adx, oy, ady, ray->dy_per_dx, v, 1);
      u = to_x;
    } else {
      u = ray_leap_end(to_y, oy, ady, ox, adx, ray->dx_per_dy, u, 0);
      v = to_y;
    }
  }
  return 0;
}

/* Restarts the walk behind the cell that was returned (u, v) borders from the start. */
RAY_FUNCTION void ray_resume(ray_t* ray, int u, int v) {
  ray->u = u;
  ray->v = v;
  ray->reported = 1;
}

/* Packs a potential hit into 32 bits. */
RAY_FUNCTION ray_uint ray_pack(int u, int v) { return (ray_uint)u | ((ray_uint)v << 16); }
RAY_FUNCTION int ray_packed_u(ray_uint hit) { return (int)(hit & 0xffffu); }
RAY_FUNCTION int ray_packed_v(ray_uint hit) { return (int)(hit >> 16); }

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
