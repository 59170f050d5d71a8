// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a device would say of a batch, ray by ray.

#ifndef STAGE_TESTS_SUPPORT_HIT_LISTS_HH
#define STAGE_TESTS_SUPPORT_HIT_LISTS_HH

#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/batch.hh"

namespace Stg::test {

/// The first hits of each ray; the lists of fans that a device doesn't walk are nonsense.
inline std::vector<uint32_t> ListHits(const internal::grid::Grid& grid,
                                      const internal::sensing::RayBatch& batch, uint32_t per_ray) {
  using namespace internal::sensing;
  std::vector<uint32_t> lists(size_t{batch.ray_count()} * per_ray, 0x12345678);
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
      uint32_t* list = &lists[size_t{r.first_ray + i} * per_ray];
      for (uint32_t n = 0; n < per_ray; n++) {
        if (!ray_next(&view, &mask, &ray)) {
          list[n] = RAY_NO_HIT;
          break;  // what follows stays what it was
        }
        list[n] = ray_pack(ray.u, ray.v);
      }
    }
  }
  return lists;
}

}  // namespace Stg::test

#endif
