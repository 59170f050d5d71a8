/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * The fans of a world's rangers, and rays of the cell model among what stands. See
 * libstage/rows/rays.cc. Compiled after row_move.h and row_ranges.h.
 */
#ifndef STAGE_KERNELS_ROW_WALLS_H
#define STAGE_KERNELS_ROW_WALLS_H

#ifndef RAY_IN_OPENCL
#include "kernels/records.h"
#include "kernels/row_move.h"
#include "kernels/row_ranges.h"
namespace Stg {
#endif

#define ROW_NOWHERE 0x7fffffff /* borders up to a hit, if there is none */
#define ROW_Q16 65536.0
#define ROW_Q30 1073741824.0
/* Movers that have moved come after everything that has not. */
#define ROW_MOVED_SINCE_LOADING ((ray_ulong)1 << 62)

/* A ray and the nearest hit so far. */
typedef struct {
  row_turn_t unit_vector;
  int dx, dy; /* displacement, Q16 cells */
  double reach;
  double range;
  ray_uint brightness;
  int place;     /* number of borders up to the hit */
  ray_ulong key; /* which of several bodies in a cell, or at one range, is hit first */
} row_ray_t;

/* ---- fans --------------------------------------------------------------------------------- */

/* See SplitCell(). */
RAY_FUNCTION int row_split(double coordinate, int* cell, ray_uint* fraction) {
  if (!row_floor_is_within(coordinate, ROW_MAX_CELL)) return 0;
  *cell = row_floor(coordinate);
  *fraction = (ray_uint)((coordinate - *cell) * ROW_Q16);
  if (*fraction > 65535) *fraction = 65535;
  return 1;
}

/* Largest error of the headings of a sensor's rays in this world, rad. */
RAY_FUNCTION double row_turn_noise(const row_world_t* w, RAY_GLOBAL const row_sensor_t* sensor,
                                   ray_uint index) {
  if (!w->scene->varies_noise) return sensor->turn_noise;
  return sensor->increment * ROW_COLUMN(w, row_range_noise_t, ROW_RANGE_NOISE)[index].angle * 0.5;
}

/* True if a sensor draws the directions of its rays in this world. See RangeNoise::TurnsRays(). */
RAY_FUNCTION int row_turns_noisily(const row_world_t* w, RAY_GLOBAL const row_sensor_t* sensor,
                                   ray_uint index) {
  double angle;
  if ((sensor->flags & ROW_TURNS_NOISILY) == 0) return 0;
  if (!w->scene->varies_noise) return 1;
  angle = ROW_COLUMN(w, row_range_noise_t, ROW_RANGE_NOISE)[index].angle;
  return angle != 0 && sensor->increment != 0 && row_is_finite(angle);
}

/* Draws the directions of a sensor that turns noisily. See Rows::Stepper::DirectionsOf(). */
RAY_FUNCTION void row_draw_directions(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_sensor_t* const sensor = ROW_PART(w, row_sensor_t, ROW_SENSORS) + index;
  RAY_GLOBAL row_own_ray_t* const own =
      ROW_SCRATCH(w, row_own_ray_t, ROW_OWN_RAYS) + sensor->first_ray;
  RAY_GLOBAL const double* const bearings = ROW_PART(w, double, ROW_BEARINGS) + sensor->first_ray;
  const double turn_noise = row_turn_noise(w, sensor, index);
  row_random_t random = ROW_COLUMN(w, row_random_t, ROW_NOISE)[index];
  ray_uint i;
  for (i = 0; i < sensor->rays; i++) {
    const double bearing = bearings[i] + turn_noise * row_uniform_error(&random);
    const row_turn_t turn = row_turn(row_is_finite(bearing) ? bearing : 0.0);
    own[i].unit_vector = turn;
    own[i].cosine = row_rounded(turn.cosine * ROW_Q30);
    own[i].sine = row_rounded(turn.sine * ROW_Q30);
  }
  ROW_COLUMN(w, row_random_t, ROW_NOISE)[index] = random;
}

/* Places the fan of a sensor. See Rows::Stepper::PlaceFan() and MoveFan(). */
RAY_FUNCTION void row_place_fan(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_sensor_t* const sensor = ROW_PART(w, row_sensor_t, ROW_SENSORS) + index;
  RAY_GLOBAL row_fan_t* const to = ROW_SCRATCH(w, row_fan_t, ROW_FANS) + index;
  const double scale = w->scene->cells_per_metre;
  row_placed_t origin;
  row_fan_t fan;
  ray_uint fx = 0, fy = 0;
  if (row_turns_noisily(w, sensor, index)) row_draw_directions(w, index);
  to->nothing = 1;
  if (!(sensor->reach > 0)) return;
  row_find_place(w, sensor->mover, &origin);
  row_to_frame(w, sensor->node, &origin);
  if (!row_split(origin.x * scale, &fan.x, &fx) || !row_split(origin.y * scale, &fan.y, &fy))
    return;
  fan.start_x = origin.x;
  fan.start_y = origin.y;
  fan.nothing = 0;
  fan.heading = origin.turn;
  fan.fraction = fx | fy << 16;
  fan.cosine = row_rounded(origin.turn.cosine * sensor->leg_cells * ROW_Q16);
  fan.sine = row_rounded(origin.turn.sine * sensor->leg_cells * ROW_Q16);
  /* The margin is for rounding and for outlines beside their cells. */
  fan.meets_walls = row_is_clear(w, sensor->seen, fan.x, fan.y, (int)sensor->leg_cells + 3) ? 0 : 1;
  fan.unused = 0;
  *to = fan;
}

/* ---- what stands -------------------------------------------------------------------------- */

RAY_FUNCTION void row_begin_walk(const row_world_t* w, row_view_t view, row_fan_t fan, int dx,
                                 int dy, ray_grid_t* grid, ray_mask_t* no_mask, ray_t* walk) {
  RAY_GLOBAL const row_scene_t* const scene = w->scene;
  grid->directory = ROW_PART(w, ray_super_t, ROW_DIRECTORY);
  grid->regions = ROW_PART(w, ray_uint, ROW_REGIONS);
  grid->region_maps = ROW_PART(w, ray_ulong, ROW_REGION_MAPS);
  grid->tile_maps = ROW_AT(w, ray_ulong, view.tile_maps);
  grid->tiles = ROW_AT(w, ray_ulong, view.tiles);
  grid->directory_mask = scene->directory_mask;
  grid->min_x = scene->min_x;
  grid->min_y = scene->min_y;
  grid->max_x = scene->max_x;
  grid->max_y = scene->max_y;
  no_mask->tiles = grid->tiles;
  no_mask->x = no_mask->y = 0;
  no_mask->width = no_mask->height = 0;
  ray_begin(walk, grid, fan.x, fan.y, (int)(fan.fraction & 0xffff), (int)(fan.fraction >> 16), dx,
            dy);
}

/* Traces a ray of the cell model among what stands. */
RAY_FUNCTION void row_trace_walls(const row_world_t* w, row_view_t view, row_fan_t fan,
                                  row_ray_t* ray) {
  ray_grid_t grid;
  ray_mask_t no_mask;
  ray_t walk;
  row_wall_t wall;
  ray_uint of;
  row_begin_walk(w, view, fan, ray->dx, ray->dy, &grid, &no_mask, &walk);
  if (!ray_next(&grid, &no_mask, &walk)) return;
  of = ROW_AT(w, ray_uint, view.of_tiles)[walk.region * 64 + walk.tile];
  if ((of & ROW_SEVERAL) != 0)
    of = ROW_AT(w, ray_uint, view.lists)[(of & ~ROW_SEVERAL) * 64 + walk.bit];
  wall = ROW_PART(w, row_wall_t, ROW_WALLS)[of];
  ray->place = walk.u + walk.v;
  ray->key = wall.key;
  ray->brightness = wall.brightness;
  ray->range = row_middle((walk.u << 16) - walk.ox, (walk.v << 16) - walk.oy, walk.adx, walk.ady) *
               ray->reach;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
