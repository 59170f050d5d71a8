/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Readings of rangers: rays among what stands and among the outlines of the other movers. See
 * libstage/rows/rays.cc. Compiled after row_exact.h.
 */
#ifndef STAGE_KERNELS_ROW_RAYS_H
#define STAGE_KERNELS_ROW_RAYS_H

#ifndef RAY_IN_OPENCL
#include "kernels/row_exact.h"
namespace Stg {
#endif

/* ---- other movers, cell model --------------------------------------------------------------- */

/* See LandAt(). */
RAY_FUNCTION int row_land_at(int to, int offset, int across, int other_offset, int along,
                             int ties) {
  const float slope = across > 0 ? (float)along / (float)across : 0.0f;
  return ray_leap_end(to, offset, across, other_offset, along, slope, 0, ties);
}

/* Finds the first cell of the outline on the ray. See MeetOutline(). */
RAY_FUNCTION int row_meet_outline(row_box_t box, RAY_GLOBAL const row_byte* bits, ray_uint narrow,
                                  row_fan_t fan, int dx, int dy, int* borders_x, int* borders_y) {
  const int sx = dx < 0 ? -1 : 1, sy = dy < 0 ? -1 : 1;
  const int adx = dx * sx, ady = dy * sy;
  const int fx = (int)(fan.fraction & 0xffff), fy = (int)(fan.fraction >> 16);
  const int ox = dx < 0 ? 65536 - fx : fx, oy = dy < 0 ? 65536 - fy : fy;
  const ray_long near_x =
      sx > 0 ? (ray_long)box.x - fan.x : (ray_long)fan.x - box.x - box.width + 1;
  const ray_long near_y =
      sy > 0 ? (ray_long)box.y - fan.y : (ray_long)fan.y - box.y - box.height + 1;
  const ray_long far_x = near_x + box.width - 1, far_y = near_y + box.height - 1;
  const ray_long first_x = near_x > 0 ? near_x : 0, first_y = near_y > 0 ? near_y : 0;
  ray_long e;
  int u, v;
  if (far_x < 0 || far_y < 0) return 0;
  if (first_x * 65536 - ox > adx || first_y * 65536 - oy > ady) return 0;
  u = (int)first_x;
  v = (int)first_y;
  if (u > 0 || v > 0) {
    /* The later of both borders; at a tie y is crossed first. */
    if (v == 0 || (u > 0 && ray_product((u << 16) - ox, ady) >= ray_product((v << 16) - oy, adx)))
      v = row_land_at(u, ox, adx, oy, ady, 1);
    else
      u = row_land_at(v, oy, ady, ox, adx, 0);
    if (u > far_x || v > far_y) return 0;
  }
  e = ray_product(((u + 1) << 16) - ox, ady) - ray_product(((v + 1) << 16) - oy, adx);
  while (u <= far_x && v <= far_y) {
    const int column = fan.x + sx * u - box.x, row = fan.y + sy * v - box.y;
    if (((u << 16) - ox > adx) | ((v << 16) - oy > ady)) return 0;
    if (((row_word(bits, narrow, row) >> column) & 1) != 0) {
      *borders_x = (u << 16) - ox;
      *borders_y = (v << 16) - oy;
      return u + v + 1;
    }
    if (e < 0) {
      u++;
      e += (ray_long)ady << 16;
    } else {
      v++;
      e -= (ray_long)adx << 16;
    }
  }
  return 0;
}

/* See Rows::Stepper::MeetInCells(). */
RAY_FUNCTION void row_meet_in_cells(const row_world_t* w, row_fan_t fan, ray_uint number,
                                    row_planar_t at, row_ray_t* ray) {
  RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + number;
  const row_box_t box = ROW_COLUMN(w, row_box_t, ROW_BOX)[number];
  /* The body's circle in the frame of the fan, in cells. Single precision suffices to omit rays
   * that pass it. */
  const float cells = (float)w->scene->cells_per_metre;
  const float ax = (float)(at.x - fan.start_x) * cells, ay = (float)(at.y - fan.start_y) * cells;
  const float cosine = (float)fan.heading.cosine, sine = (float)fan.heading.sine;
  const float ahead = cosine * ax + sine * ay, aside = cosine * ay - sine * ax;
  const float margin = (float)body->radius * cells * 1.001f + 3.0f;
  const float c = (float)ray->unit_vector.cosine, s = (float)ray->unit_vector.sine;
  const float off = c * aside - s * ahead;
  ray_ulong stamp, key;
  int place, in_x, in_y;
  if (box.height == 0 || off > margin || off < -margin || c * ahead + s * aside < -margin) return;
  place = row_meet_outline(box, ROW_COLUMN(w, row_byte, ROW_BITS) + body->first_byte,
                           w->scene->narrow, fan, ray->dx, ray->dy, &in_x, &in_y) -
          1;
  if (place < 0) return;
  stamp = ROW_COLUMN(w, ray_ulong, ROW_STAMP)[number];
  key = stamp > 0 ? ROW_MOVED_SINCE_LOADING + stamp : body->loading_stamp;
  if (place > ray->place || (place == ray->place && key > ray->key)) return;
  ray->place = place;
  ray->key = key;
  ray->brightness = body->brightness;
  ray->range =
      row_middle(in_x, in_y, ray->dx < 0 ? -ray->dx : ray->dx, ray->dy < 0 ? -ray->dy : ray->dy) *
      ray->reach;
}

/* ---- phases ------------------------------------------------------------------------------- */

/* Finds the direction of a ray. */
RAY_FUNCTION void row_begin_ray(const row_world_t* w, ray_uint index, row_fan_t fan,
                                ray_uint number, row_ray_t* ray) {
  RAY_GLOBAL const row_sensor_t* const sensor = ROW_PART(w, row_sensor_t, ROW_SENSORS) + index;
  const ray_uint i = sensor->first_direction + number - sensor->first_ray;
  int cosine, sine;
  if (row_turns_noisily(w, sensor, index)) {
    const row_own_ray_t own = ROW_SCRATCH(w, row_own_ray_t, ROW_OWN_RAYS)[number];
    ray->unit_vector = own.unit_vector;
    cosine = own.cosine;
    sine = own.sine;
  } else {
    const ray_direction_t direction = ROW_PART(w, ray_direction_t, ROW_DIRECTIONS)[i];
    ray->unit_vector = ROW_PART(w, row_turn_t, ROW_UNIT_VECTORS)[i];
    cosine = direction.cosine;
    sine = direction.sine;
  }
  ray->dx = ray_rotate_x(fan.cosine, fan.sine, cosine, sine);
  ray->dy = ray_rotate_y(fan.cosine, fan.sine, cosine, sine);
}

/* Traces a ray among the other movers. See Rows::Stepper::TraceRobots(). */
RAY_FUNCTION void row_trace_movers(const row_world_t* w, RAY_GLOBAL const row_sensor_t* sensor,
                                   row_fan_t fan, row_ray_t* ray) {
  RAY_GLOBAL const ray_uint* const others = ROW_PART(w, ray_uint, ROW_OTHERS) + sensor->first_other;
  const double margin = 3 / w->scene->cells_per_metre;
  ray_uint i;
  for (i = 0; i < sensor->others; i++) {
    RAY_GLOBAL const row_body_t* const body = ROW_PART(w, row_body_t, ROW_BODIES) + others[i];
    const row_planar_t at = ROW_COLUMN(w, row_planar_t, ROW_POSE)[body->mover];
    const double dx = at.x - fan.start_x, dy = at.y - fan.start_y;
    const double far = ray->reach + body->radius + margin;
    if (dx * dx + dy * dy > far * far) continue;
    if ((sensor->flags & ROW_EXACT) != 0)
      row_meet_exactly(w, fan, others[i], at, ray);
    else
      row_meet_in_cells(w, fan, others[i], at, ray);
  }
}

/* Takes the reading of one ray. */
RAY_FUNCTION void row_cast_ray(const row_world_t* w, ray_uint number) {
  const ray_uint index = ROW_PART(w, ray_uint, ROW_SENSOR_OF)[number];
  RAY_GLOBAL const row_sensor_t* const sensor = ROW_PART(w, row_sensor_t, ROW_SENSORS) + index;
  const row_fan_t fan = ROW_SCRATCH(w, row_fan_t, ROW_FANS)[index];
  row_ray_t ray;
  ray.reach = ray.range = sensor->reach;
  ray.brightness = 0;
  ray.place = ROW_NOWHERE;
  ray.key = 0;
  if (!fan.nothing) {
    row_begin_ray(w, index, fan, number, &ray);
    if (fan.meets_walls) {
      const row_view_t view = ROW_PART(w, row_view_t, ROW_VIEWS)[sensor->view];
      if ((sensor->flags & ROW_EXACT) != 0)
        row_trace_walls_exactly(w, view, fan, &ray);
      else
        row_trace_walls(w, view, fan, &ray);
    }
    row_trace_movers(w, sensor, fan, &ray);
  }
  ROW_COLUMN(w, double, ROW_RANGES)[number] = ray.range;
  ROW_COLUMN(w, row_byte, ROW_BRIGHTNESS)[number] = (row_byte)ray.brightness;
}

/* The fraction and the deviation of a sensor's noise in this world. See AddRangeErrors(). */
RAY_FUNCTION row_point_t row_noise_of(const row_world_t* w, RAY_GLOBAL const row_sensor_t* sensor,
                                      ray_uint index) {
  row_range_noise_t own;
  if (!w->scene->varies_noise) return row_point(sensor->fraction, sensor->deviation);
  own = ROW_COLUMN(w, row_range_noise_t, ROW_RANGE_NOISE)[index];
  return row_point(row_is_finite(own.fraction) ? own.fraction : 0.0,
                   row_is_finite(own.variance) ? sqrt(row_larger(0.0, own.variance)) : 0.0);
}

/* True if a ray meets the chord to the hit of the ray beside it steeply. See IsSteep(). */
RAY_FUNCTION bool row_is_steep(RAY_GLOBAL const row_sensor_t* sensor, double r, double beside) {
  const double across = beside * sensor->sine;
  const double chord2 = r * r + beside * beside - 2.0 * r * beside * sensor->cosine;
  return across * across < sensor->least_cosine2 * chord2;
}

/* True if a range gets lost. See Measured() in models/noise.cc. */
RAY_FUNCTION bool row_loses(RAY_GLOBAL const row_sensor_t* sensor, double r, double before,
                            double after, row_random_t* random) {
  const double farthest = sensor->max_range;
  const bool any_before = before < farthest, any_after = after < farthest;
  if (sensor->loss > 0 && row_uniform(random) < sensor->loss) return true;
  return sensor->least_cosine2 > 0 && (any_before || any_after) &&
         (!any_before || row_is_steep(sensor, r, before)) &&
         (!any_after || row_is_steep(sensor, r, after));
}

/* Returns the measured value of the range `r`. See Measured(). */
RAY_FUNCTION double row_measured(RAY_GLOBAL const row_sensor_t* sensor, row_point_t noise, double r,
                                 double before, double after, row_random_t* random) {
  const double fraction = noise.x, deviation = noise.y, farthest = sensor->max_range;
  double noisy = r;
  if (!(r < farthest)) return r;
  if (r < sensor->min_range) return (sensor->flags & ROW_BLIND_NEAR) != 0 ? farthest : r;
  if (row_loses(sensor, r, before, after, random)) return farthest;
  if (fraction != 0 || deviation > 0) {
    noisy = r + r * fraction * row_uniform_error(random);
    noisy = noisy + (deviation > 0 ? deviation * row_normal_error(random) : 0.0);
    noisy = row_constrain(noisy, sensor->min_range, farthest);
  }
  if (!(sensor->step > 0)) return noisy;
  return row_smaller(sensor->step * floor(noisy / sensor->step + 0.5), farthest);
}

/* Adds noise and defects to the ranges of a sensor. See AddRangeErrors(). */
RAY_FUNCTION void row_add_errors(const row_world_t* w, ray_uint index) {
  RAY_GLOBAL const row_sensor_t* const sensor = ROW_PART(w, row_sensor_t, ROW_SENSORS) + index;
  RAY_GLOBAL double* const ranges = ROW_COLUMN(w, double, ROW_RANGES) + sensor->first_ray;
  RAY_GLOBAL row_byte* const brightness =
      ROW_COLUMN(w, row_byte, ROW_BRIGHTNESS) + sensor->first_ray;
  const row_point_t noise = row_noise_of(w, sensor, index);
  const bool has_defects = (sensor->flags & ROW_BLIND_NEAR) != 0 || sensor->loss > 0 ||
                           sensor->step > 0 || sensor->least_cosine2 > 0;
  const double farthest = sensor->max_range;
  double before = farthest;
  row_random_t random;
  ray_uint i;
  if ((sensor->flags & ROW_NOISY) == 0 || (noise.x == 0 && !(noise.y > 0) && !has_defects)) return;
  random = ROW_COLUMN(w, row_random_t, ROW_NOISE)[index];
  for (i = 0; i < sensor->rays; i++) {
    const double r = ranges[i];
    ranges[i] = row_measured(sensor, noise, r, before,
                             i + 1 < sensor->rays ? ranges[i + 1] : farthest, &random);
    if (has_defects && !(ranges[i] < farthest)) brightness[i] = 0;
    before = r;
  }
  ROW_COLUMN(w, row_random_t, ROW_NOISE)[index] = random;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
