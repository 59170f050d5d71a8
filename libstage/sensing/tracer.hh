// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays to hits: the walk finds cells in which something is, the predicate decides.

#ifndef STAGE_SENSING_TRACER_HH
#define STAGE_SENSING_TRACER_HH

#include "grid/grid.hh"
#include "sensing/batch.hh"
#include "sensing/counters.hh"
#include "sensing/prefilter.hh"

namespace Stg::internal::sensing {

class Tracer {
 public:
  /// The grid must not change meanwhile.
  explicit Tracer(const grid::Grid& grid) : grid_(grid) {}

  /// One ray of a fan, through `view` of the fan's layer. `list`: the ray's potential hits,
  /// `listed` of them (0: none are known).
  RayHit Trace(const Fan& fan, const ray_grid_t& view, const Direction& direction,
               const ray_window_t& window, const uint32_t* list, uint32_t listed,
               TraceCounters* counters) const;

  /// All rays of a fan of the batch, into hits[0 .. samples - 1].
  void TraceFan(const RayBatch& batch, const Fan& fan, const HitLists& lists, RayHit* hits,
                TraceCounters* counters) const;

 private:
  Model* Accepted(const Fan& fan, uint32_t region, uint32_t tile, uint32_t bit) const;
  Model* FollowList(const Fan& fan, ray_t* ray, const uint32_t* list, uint32_t listed,
                    bool* finished, TraceCounters* counters) const;
  RayHit TraceLegs(const Fan& fan, const ray_grid_t& view, int32_t dx, int32_t dy,
                   const ray_window_t& window, TraceCounters* counters) const;

  const grid::Grid& grid_;
};

}  // namespace Stg::internal::sensing

#endif
