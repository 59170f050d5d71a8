// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/tracer.hh"

#include <algorithm>
#include <cmath>
#include <limits>

namespace Stg::internal::sensing {

namespace {

/// Where along its leg the ray is halfway through the cell that it has reached: 0 start, 1 end. The
/// ray as a whole ends at `end`. The outline that was hit lies anywhere in the cell, so its middle
/// is the best guess.
double FractionAtHit(const ray_t& ray, double end = 1.0) {
  const auto border = [](int n, int offset) { return (static_cast<double>(n) * 65536.0) - offset; };
  double in = 0.0, out = end;
  if (ray.adx > 0) {
    in = std::max(in, border(ray.u, ray.ox) / ray.adx);
    out = std::min(out, border(ray.u + 1, ray.ox) / ray.adx);
  }
  if (ray.ady > 0) {
    in = std::max(in, border(ray.v, ray.oy) / ray.ady);
    out = std::min(out, border(ray.v + 1, ray.oy) / ray.ady);
  }
  return 0.5 * (in + out);
}

/// First and last leg, of `legs`, that may touch the occupied box on one axis: those for which
/// [start + k * step, start + (k + 1) * step] meets [low, high]. All in Q16.
void CutLegs(double start, double step, double low, double high, double* first, double* last) {
  if (step == 0) {
    if (start < low || start > high) *last = -1;
    return;
  }
  if (step < 0) {
    start = -start;
    step = -step;
    std::swap(low, high);
    low = -low;
    high = -high;
  }
  *first = std::max(*first, std::floor((low - start) / step) - 1);
  *last = std::min(*last, std::ceil((high - start) / step));
}

}  // namespace

Model* Tracer::Accepted(const Fan& fan, uint32_t region, uint32_t tile, uint32_t bit) const {
  Model* hit = nullptr;
  grid_.AnyAt(region, tile, bit, [&](grid::BodyId id) {
    const grid::Body& body = grid_.body(id);
    if (fan.z_test && (fan.z < body.z_min || fan.z > body.z_max)) return false;
    if (!fan.predicate(body.model, fan.finder, fan.arg)) return false;
    hit = body.model;
    return true;
  });
  return hit;
}

/// Looks at the cells of the ray's list. `finished`: the ray ended; there is nothing behind them.
Model* Tracer::FollowList(const Fan& fan, ray_t* ray, const uint32_t* list, uint32_t listed,
                          bool* finished, TraceCounters* counters) const {
  for (uint32_t i = 0; i < listed; i++) {
    if (list[i] == RAY_NO_HIT) {
      *finished = true;
      return nullptr;
    }
    ray_resume(ray, ray_packed_u(list[i]), ray_packed_v(list[i]));
    const int32_t x = ray->x0 + ray->sx * ray->u, y = ray->y0 + ray->sy * ray->v;
    counters->potential_hits++;
    const uint32_t region = grid_.FindRegion(x, y);
    if (Model* hit = Accepted(fan, region, grid::Grid::TileOf(x, y), grid::Grid::BitOf(x, y)))
      return hit;
  }
  *finished = false;
  return nullptr;
}

RayHit Tracer::Trace(const Fan& fan, const ray_grid_t& view, const Direction& direction,
                     const ray_window_t& window, const uint32_t* list, uint32_t listed,
                     TraceCounters* counters) const {
  counters->rays++;
  const RayHit none{fan.range, nullptr};
  if (fan.nothing) return none;
  const FanRecord& record = fan.record;
  const int32_t dx = ray_rotate_x(record.cosine, record.sine, direction.cosine, direction.sine);
  const int32_t dy = ray_rotate_y(record.cosine, record.sine, direction.cosine, direction.sine);
  if (fan.legs != 1) return TraceLegs(fan, view, dx, dy, window, counters);

  ray_t ray;
  ray_begin(&ray, &view, record.x, record.y, static_cast<int>(record.fraction & 0xffff),
            static_cast<int>(record.fraction >> 16), dx, dy);
  Model* hit = nullptr;
  if (listed != 0) {
    bool finished = false;
    hit = FollowList(fan, &ray, list, listed, &finished, counters);
    if (hit) return {FractionAtHit(ray) * fan.leg_length, hit};
    if (finished) return none;
    counters->resumed++;
  }
  while (ray_next(&view, &window, &ray)) {
    counters->potential_hits++;
    hit = Accepted(fan, ray.region, ray.tile, ray.bit);
    if (hit) return {FractionAtHit(ray) * fan.leg_length, hit};
  }
  return none;
}

RayHit Tracer::TraceLegs(const Fan& fan, const ray_grid_t& view, int32_t dx, int32_t dy,
                         const ray_window_t& window, TraceCounters* counters) const {
  const FanRecord& record = fan.record;
  const int64_t start_x = int64_t{record.x} * 65536 + (record.fraction & 0xffff);
  const int64_t start_y = int64_t{record.y} * 65536 + (record.fraction >> 16);
  double first = 0, last = fan.legs - 1;
  CutLegs(static_cast<double>(start_x), dx, view.min_x * 65536.0, (view.max_x + 1.0) * 65536.0,
          &first, &last);
  CutLegs(static_cast<double>(start_y), dy, view.min_y * 65536.0, (view.max_y + 1.0) * 65536.0,
          &first, &last);

  for (double k = std::max(first, 0.0); k <= last; k += 1.0) {
    const int64_t x = start_x + static_cast<int64_t>(k) * dx;
    const int64_t y = start_y + static_cast<int64_t>(k) * dy;
    ray_t ray;
    ray_begin(&ray, &view, static_cast<int32_t>(x >> 16), static_cast<int32_t>(y >> 16),
              static_cast<int>(x & 0xffff), static_cast<int>(y & 0xffff), dx, dy);
    while (ray_next(&view, &window, &ray)) {
      counters->potential_hits++;
      if (Model* hit = Accepted(fan, ray.region, ray.tile, ray.bit))
        return {(k + FractionAtHit(ray, fan.legs - k)) * fan.leg_length, hit};
    }
  }
  return {fan.range, nullptr};
}

void Tracer::TraceFan(const RayBatch& batch, const Fan& fan, const HitLists& lists, RayHit* hits,
                      TraceCounters* counters) const {
  const Direction* directions = batch.DirectionsOf(fan);
  const ray_window_t window = batch.WindowOf(fan);
  const ray_grid_t view = grid_.View(fan.layer);
  const uint32_t listed = fan.single_leg() ? lists.per_ray : 0;
  for (uint32_t i = 0; i < fan.record.samples; i++) {
    const uint32_t* list = lists.hits + size_t{fan.record.first_ray + i} * lists.per_ray;
    hits[i] = Trace(fan, view, directions[i], window, list, listed, counters);
  }
}

}  // namespace Stg::internal::sensing
