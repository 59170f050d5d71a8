// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of the exact model that are traced together: what each of them meets first.
//
// A ray asks the outlines in the tile of its first potential hit. Most rays meet one of them before
// they leave the tile, and are settled. Most others meet one just behind the tile: they ask the
// next tile too. What is left goes on alone.

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
  /// What else is to be known of a part of a group.
  struct Part {
    const Fan* fan;
    const SineCosine* turns;  ///< one for each of its rays
  };

  explicit ExactGroup(const grid::Grid& grid) : grid_(grid) {}

  /// Traces the rays of a group, whose first potential hits are known. `parts` are those of the
  /// group. `ranges` are those that `first` has written; those of the rays come out.
  void Trace(const RayGroup& rays, const Part* parts, const FirstHits& first, double* ranges,
             TraceCounters* counters);

  /// What a ray of them has met; null if nothing.
  Model* Met(uint32_t ray) const { return met_[ray] ? met_[ray]->model : nullptr; }

 private:
  /// Neighbouring rays of a part that have hits in tiles with the same outlines.
  struct Run {
    const Part& part;
    const Direction* directions;  // of the rays of that
    uint32_t first;               // the first of them, in the group
    uint32_t from, end;           // the rays, in the group

    uint32_t count() const { return end - from; }
  };

  void Settle(const Run& run, grid::OutlineList outlines, const FirstHits& first);
  bool HaveSame(grid::OutlineList a, grid::OutlineList b) const;
  void Gather(const Fan& fan, grid::OutlineList outlines);
  void Keep(const Run& run);
  void GoOn(const Run& run, uint32_t ray, uint32_t hit);

  const grid::Grid& grid_;
  const RayGroup* rays_ = nullptr;
  double* ranges_ = nullptr;
  TraceCounters* counters_ = nullptr;
  const grid::Body* met_[RayGroup::kMost];  // so far, each at the range of the ray
  // Of a run: the outlines of the tile, and where the rays meet which of them.
  std::vector<const grid::Body*> bodies_;
  std::vector<OutlineEdges> edges_;
  double now_[WideHits::kRoom];
  uint32_t which_[WideHits::kRoom];
};

}  // namespace Stg::internal::sensing

#endif
