// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays to hits: the walk finds cells in which something is, the predicate decides.

#ifndef STAGE_SENSING_TRACER_HH
#define STAGE_SENSING_TRACER_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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
  /// What some fans have hit, each with runs of its own.
  struct Hits {
    std::vector<double> ranges;  ///< of all rays, and some room behind them
    std::vector<HitRun> runs;

    /// Calls f(fan, its RayHits) for the fans that these are of.
    template <typename F>
    void ForEachFan(std::span<const Fan> fans, F f) const {
      const double* of_fan = ranges.data();
      const HitRun* run = runs.data();
      for (const Fan& fan : fans) {
        const uint32_t count = fan.record.samples;
        f(fan, RayHits{of_fan, run, count});
        of_fan += count;
        if (count == 0) continue;
        while (run->end < count) run++;
        run++;
      }
    }
  };

  /// One ray of a fan, through `view` of the fan's layer.
  RayHit Trace(const Fan& fan, const ray_grid_t& view, const Bearing& bearing,
               const ray_mask_t& mask, TraceCounters* counters) const;

  /// The same, with notes of how it came to that: fills in all of *record but `sample`. The hit is
  /// that of Trace(), of which each step is taken here too.
  void Record(const Fan& fan, const Bearing& bearing, const ray_mask_t& mask,
              RayRecord* record) const;

  /// All rays of some fans of the batch: those of the first fan, then those of the next. Fastest if
  /// they are of one robot, so that they look at the same cells.
  void TraceFans(const RayBatch& batch, std::span<const Fan> fans, const HitLists& lists,
                 Hits* hits, TraceCounters* counters) const;

 private:
  /// What is known beforehand of where a ray may stop.
  struct HitList {
    const uint32_t* hits = nullptr;  // as HitLists has them
    uint32_t count = 0;              // 0: nothing is known
    uint32_t of_device = 0;          // 1 if it is from one
  };
  struct Walk;
  class Group;
  void TraceOneByOne(const RayBatch& batch, const Fan& fan, double* ranges,
                     std::vector<HitRun>* runs, TraceCounters* counters) const;
  static void Begin(ray_t* ray, const Walk& walk, int64_t x, int64_t y);
  static void BeginAtFirst(ray_t* ray, const Fan& fan, const Walk& walk);
  template <typename Visit>
  void Follow(const Walk& walk, ray_t* ray, Visit* visit) const;
  static Walk WalkOf(const Fan& fan, const ray_grid_t& view, const Direction& direction,
                     const ray_mask_t& mask, const HitList& list, TraceCounters* counters);
  template <class Taking>
  RayHit TraceCells(const Fan& fan, const Walk& walk, const Taking& notes) const;
  template <class Taking>
  RayHit TraceExact(const Fan& fan, const Walk& walk, const SineCosine& turn,
                    const Taking& notes) const;
  RayHit TraceCellsFrom(const Fan& fan, const Walk& walk) const;

  const grid::Grid& grid_;
};

}  // namespace Stg::internal::sensing

#endif
