// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays to hits: the walk finds cells in which something is, the predicate decides.

#ifndef STAGE_SENSING_TRACER_HH
#define STAGE_SENSING_TRACER_HH

#include <cstddef>

#include "geometry/trigonometry.hh"
#include "grid/grid.hh"
#include "sensing/batch.hh"
#include "sensing/counters.hh"
#include "sensing/prefilter.hh"
#include "sensing/ray_record.hh"

namespace Stg::internal::sensing {

class Tracer {
 public:
  /// The grid must not change meanwhile.
  explicit Tracer(const grid::Grid& grid) : grid_(grid) {}

  /// A ray's direction relative to its fan's heading, for the walk and for the exact model.
  struct Bearing {
    Direction direction;
    SineCosine turn;
  };
  /// What is known beforehand of where a ray may stop.
  struct HitList {
    const uint32_t* hits = nullptr;  ///< as HitLists has them
    uint32_t count = 0;              ///< 0: nothing is known
  };

  /// Where the hits of some rays go.
  struct Room {
    double* ranges;
    Model** models;

    Room Behind(std::size_t rays) const { return {ranges + rays, models + rays}; }
    void Put(std::size_t ray, const RayHit& hit) const {
      ranges[ray] = hit.range;
      models[ray] = hit.model;
    }
  };

  /// One ray of a fan, through `view` of the fan's layer.
  RayHit Trace(const Fan& fan, const ray_grid_t& view, const Bearing& bearing,
               const ray_mask_t& mask, const HitList& list, TraceCounters* counters) const;

  /// The same, with notes of how it came to that: fills in all of *record but `sample`. The hit is
  /// that of Trace(), of which each step is taken here too.
  void Record(const Fan& fan, const Bearing& bearing, const ray_mask_t& mask,
              RayRecord* record) const;

  /// All rays of some fans of the batch: those of the first fan, then those of the next. Fastest if
  /// they are of one robot, so that they look at the same cells.
  void TraceFans(const RayBatch& batch, const Fan* fans, uint32_t count, const HitLists& lists,
                 Room room, TraceCounters* counters) const;

 private:
  struct Walk;
  class Group;
  void TraceOneByOne(const RayBatch& batch, const Fan& fan, const HitLists& lists, Room room,
                     TraceCounters* counters) const;
  static void Begin(ray_t* ray, const Walk& walk, int64_t x, int64_t y);
  template <typename Visit>
  void Follow(const Walk& walk, ray_t* ray, Visit* visit) const;
  static Walk WalkOf(const Fan& fan, const ray_grid_t& view, const Direction& direction,
                     const ray_mask_t& mask, const HitList& list, TraceCounters* counters);
  template <class Taking>
  RayHit TraceCells(const Fan& fan, const Walk& walk, const Taking& notes) const;
  template <class Taking>
  RayHit TraceExact(const Fan& fan, const Walk& walk, const SineCosine& turn,
                    const Taking& notes) const;

  const grid::Grid& grid_;
};

}  // namespace Stg::internal::sensing

#endif
