// SPDX-License-Identifier: GPL-2.0-or-later
//
// Simulates the hit lists of a device for a batch, ray by ray, and traces the batch with them.

#ifndef STAGE_TESTS_SUPPORT_HIT_LISTS_HH
#define STAGE_TESTS_SUPPORT_HIT_LISTS_HH

#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/batch.hh"
#include "sensing/tracer.hh"

namespace Stg::test {

/// The words of HitLists with the first `per_ray` hits of each ray, and the body of the first hit
/// unless is_unknown() returns true. Words of fans that a device doesn't walk are garbage.
template <typename F>
std::vector<uint32_t> ListHits(const internal::grid::Grid& grid,
                               const internal::sensing::RayBatch& batch, uint32_t per_ray,
                               F is_unknown) {
  using namespace internal::sensing;
  const size_t stride = 1 + per_ray;
  std::vector<uint32_t> words(static_cast<size_t>(batch.ray_count()) * stride, 0x12345678);
  for (const Fan& fan : batch.fans()) {
    if (!fan.single_leg()) continue;
    const FanRecord& r = fan.record;
    const ray_grid_t view = grid.View(fan.layer);
    const ray_mask_t mask = batch.SelfMaskOf(fan);
    for (uint32_t i = 0; i < r.samples; i++) {
      const Direction d = batch.DirectionsOf(fan)[i];
      ray_t ray;
      ray_begin(&ray, &view, r.x, r.y, static_cast<int>(r.fraction & 0xffff),
                static_cast<int>(r.fraction >> 16),
                ray_rotate_x(r.cosine, r.sine, d.cosine, d.sine),
                ray_rotate_y(r.cosine, r.sine, d.cosine, d.sine));
      uint32_t* const body = &words[(r.first_ray + i) * stride];
      uint32_t* const list = body + 1;
      for (uint32_t n = 0; n < per_ray; n++) {
        if (!ray_next(&view, &mask, &ray)) {
          list[n] = RAY_NO_HIT;
          break;  // words past the end of a list stay garbage
        }
        list[n] = ray_pack(ray.u, ray.v);
        if (n == 0) {
          const uint32_t slot = ray.region * internal::grid::kTilesPerRegion + ray.tile;
          *body = is_unknown() ? 0 : grid.OnlyBody(slot);
        }
      }
    }
  }
  return words;
}

inline std::vector<uint32_t> ListHits(const internal::grid::Grid& grid,
                                      const internal::sensing::RayBatch& batch, uint32_t per_ray) {
  return ListHits(grid, batch, per_ray, [] { return false; });
}

/// The hits of all rays of a batch; `at_once` fans are traced at a time.
inline std::vector<internal::sensing::RayHit> TraceBatch(
    const internal::grid::Grid& grid, const internal::sensing::RayBatch& batch,
    const internal::sensing::HitLists& lists, uint32_t at_once,
    internal::sensing::TraceCounters* counters) {
  using namespace internal::sensing;
  std::vector<RayHit> hits;
  Tracer::Hits found;
  for (size_t i = 0; i < batch.fans().size(); i += at_once) {
    const size_t count = std::min<size_t>(at_once, batch.fans().size() - i);
    const std::span<const Fan> fans = batch.fans().subspan(i, count);
    Tracer(grid).TraceFans(batch, fans, lists, &found, counters);
    found.ForEachFan(fans, [&](const Fan&, const RayHits& of_fan) {
      for (uint32_t ray = 0, run = 0; ray < of_fan.count; ray++) {
        if (ray == of_fan.intervals[run].end) run++;
        hits.push_back({of_fan.ranges[ray], of_fan.intervals[run].model});
      }
    });
  }
  return hits;
}

}  // namespace Stg::test

#endif
