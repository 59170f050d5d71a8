// SPDX-License-Identifier: GPL-2.0-or-later
//
// Traces a group of rays of the exact model and finds what each meets first.
//
// A ray tests the outlines in the tile of its first potential hit. Most rays meet one of them
// before they leave the tile and are finished. Most others meet one in the next tile, which is
// tested too. The rest is traced ray by ray.

#ifndef STAGE_SENSING_EXACT_GROUP_HH
#define STAGE_SENSING_EXACT_GROUP_HH

#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/counters.hh"
#include "sensing/first_hits.hh"
#include "sensing/outline_rays.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

class ExactGroup {
 public:
  /// Per-slice data that the exact model needs in addition to FanSlice.
  struct SliceData {
    const Fan* fan;
    const SineCosine* unit_vectors;  ///< one per ray
  };

  explicit ExactGroup(const grid::Grid& grid) : grid_(grid) {}

  /// Traces a group of rays whose first potential hits are known. `slices` are the slices of the
  /// group. On entry `ranges` holds what `first` wrote, on return the ranges of the rays in metres.
  void Trace(const RayGroup& rays, const SliceData* slices, const FirstHits& first, double* ranges,
             TraceCounters* counters);

  /// The model that a ray of the group hits, or null.
  Model* HitModel(uint32_t ray) const {
    return hit_bodies_[ray] ? hit_bodies_[ray]->model : nullptr;
  }

 private:
  /// Consecutive rays of a slice whose first potential hits are in tiles with the same outlines.
  struct RayInterval {
    const SliceData& slice;
    const Direction* directions;  // of the slice's rays
    uint32_t first;               // index in the group of the slice's first ray
    uint32_t from, end;           // half-open interval of rays in the group

    uint32_t count() const { return end - from; }
  };

  void Resolve(const RayInterval& interval, grid::OutlineList outlines, const FirstHits& first);
  bool HaveSameOutline(grid::OutlineList a, grid::OutlineList b) const;
  void Gather(const Fan& fan, grid::OutlineList outlines);
  void StoreHits(const RayInterval& interval);
  void CompleteRay(const RayInterval& interval, uint32_t ray, uint32_t hit);

  const grid::Grid& grid_;
  const RayGroup* rays_ = nullptr;
  double* ranges_ = nullptr;
  TraceCounters* counters_ = nullptr;
  const grid::Body* hit_bodies_[RayGroup::kMaxRays];  // nearest bodies so far, at the rays' ranges
  // Per interval: the outlines of its tile, and the range and index of each ray's hit.
  std::vector<const grid::Body*> bodies_;
  std::vector<OutlineEdges> edges_;
  double now_[WideHits::kCapacity];
  uint32_t which_[WideHits::kCapacity];
};

}  // namespace Stg::internal::sensing

#endif
