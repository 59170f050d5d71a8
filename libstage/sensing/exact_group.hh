// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of the exact model that are traced together: what each of them meets first.
//
// A ray asks the outlines in the tile of its first potential hit. Most rays meet one of them before
// they leave the tile and are settled. The others go on behind the tile in a next round, all of
// them side by side, or one by one if only a few are left.

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
  /// One of the parts of a group.
  struct Part {
    const Fan* fan;
    const Direction* directions;  ///< of its rays
    const SineCosine* turns;      ///< the same
    uint32_t count;
  };

  explicit ExactGroup(const grid::Grid& grid) : grid_(grid), hits_(grid) {}

  /// Traces the rays of a group, whose first potential hits are known. `parts` are those of the
  /// group. `ranges` are those that `first` has written; those of the rays come out.
  void Trace(const RayGroup& rays, const Part* parts, const FirstHits& first, double* ranges,
             TraceCounters* counters);

  /// What a ray of them has met; null if nothing.
  Model* Met(uint32_t ray) const { return met_[ray] ? met_[ray]->model : nullptr; }

 private:
  static constexpr uint32_t kMost = RayGroup::kMost, kRoom = WideHits::kRoom;

  /// Rays that go on behind the tiles of their last hits.
  struct Rest {
    uint32_t count = 0, part_count = 0;
    uint32_t numbers[kMost];  // in the group
    Direction directions[kMost];
    SineCosine turns[kMost];
    uint32_t passed[kRoom];  // these hits
    double shares[kRoom];    // of the leg: no further than that
    Part parts[kMost];
  };
  /// Neighbouring rays of a part that have hits in tiles with the same outlines.
  struct Run {
    const Part& part;
    uint32_t first;          // the first ray of that, in its round
    uint32_t from, end;      // the rays
    const uint32_t* numbers;  // in the group, of rays of the round

    uint32_t count() const { return end - from; }
  };

  void Settle(const Part* parts, uint32_t part_count, const uint32_t* numbers,
              const FirstHits& hits);
  void SettleRun(const Run& run, grid::OutlineList outlines, const FirstHits& hits);
  bool HaveSame(grid::OutlineList a, grid::OutlineList b) const;
  void Gather(const Fan& fan, grid::OutlineList outlines);
  bool Keep(const Run& run);
  void GoOn(const Run& run, uint32_t ray, uint32_t hit);
  void NextRound(const RayGroup& all);
  void GoOnAlone(const RayGroup& all);
  void GoOnAlone(const RayGroup& all, const Part& part, uint32_t ray);

  const grid::Grid& grid_;
  double* ranges_ = nullptr;
  TraceCounters* counters_ = nullptr;
  FirstHits hits_;                    // of the next round
  Rest rests_[2];                     // of this round and of the next one
  Rest* rest_ = &rests_[0];           // who goes on
  const grid::Body* met_[kMost];      // so far
  // Of a run: the outlines of the tile, and where the rays meet which of them.
  std::vector<const grid::Body*> bodies_;
  std::vector<OutlineEdges> edges_;
  double now_[kRoom];
  uint32_t which_[kRoom];
};

}  // namespace Stg::internal::sensing

#endif
