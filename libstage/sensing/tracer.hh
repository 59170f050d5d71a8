// SPDX-License-Identifier: GPL-2.0-or-later
//
// Traces rays: the walk finds occupied cells, the predicate decides whether the ray stops.

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
  /// The grid must outlive the tracer and not change meanwhile.
  explicit Tracer(const grid::Grid& grid) : grid_(grid) {}

  /// Direction of a ray relative to its fan's heading: for the walk, and for the exact model.
  struct RayDirection {
    Direction fixed_point;
    SineCosine unit_vector;
  };
  /// The results of some fans, with separate runs per fan.
  struct Hits {
    std::vector<double> ranges;  ///< of all rays, plus padding
    std::vector<HitInterval> intervals;

    /// Calls f(fan, RayHits of the fan) for each of these fans.
    template <typename F>
    void ForEachFan(std::span<const Fan> fans, F f) const {
      const double* of_fan = ranges.data();
      const HitInterval* interval = intervals.data();
      for (const Fan& fan : fans) {
        const uint32_t count = fan.record.samples;
        f(fan, RayHits{of_fan, interval, count});
        of_fan += count;
        if (count == 0) continue;
        while (interval->end < count) interval++;
        interval++;
      }
    }
  };

  /// Traces one ray of a fan; `view` is that of the fan's layer.
  RayHit Trace(const Fan& fan, const ray_grid_t& view, const RayDirection& direction,
               const ray_mask_t& mask, TraceCounters* counters) const;

  /// Like Trace(), and fills in all of *record but `sample`. Executes the same steps as Trace(), so
  /// the hit is the same.
  void Record(const Fan& fan, const RayDirection& direction, const ray_mask_t& mask,
              RayRecord* record) const;

  /// Traces all rays of consecutive fans of the batch, in order. Fastest for fans of one robot,
  /// which read the same cells.
  void TraceFans(const RayBatch& batch, std::span<const Fan> fans, const HitLists& lists,
                 Hits* hits, TraceCounters* counters) const;

 private:
  /// Potential hits that are known before the walk.
  struct HitList {
    const uint32_t* hits = nullptr;  // as in HitLists
    uint32_t count = 0;              // 0: nothing is known
    uint32_t of_device = 0;          // 1 if the list is from a device
  };
  struct Walk;
  class Group;
  void TraceOneByOne(const RayBatch& batch, const Fan& fan, double* ranges,
                     std::vector<HitInterval>* intervals, TraceCounters* counters) const;
  static void Begin(ray_t* ray, const Walk& walk, int64_t x, int64_t y);
  static void BeginAtFirst(ray_t* ray, const Fan& fan, const Walk& walk);
  template <typename Visit>
  void Follow(const Walk& walk, ray_t* ray, Visit* visit) const;
  static Walk WalkOf(const Fan& fan, const ray_grid_t& view, const Direction& direction,
                     const ray_mask_t& mask, const HitList& list, TraceCounters* counters);
  template <class Recorder>
  RayHit TraceCells(const Fan& fan, const Walk& walk, const Recorder& recorder) const;
  template <class Recorder>
  RayHit TraceExact(const Fan& fan, const Walk& walk, const SineCosine& unit_vector,
                    const Recorder& recorder) const;
  RayHit TraceCellsFrom(const Fan& fan, const Walk& walk) const;

  const grid::Grid& grid_;
};

}  // namespace Stg::internal::sensing

#endif
