// SPDX-License-Identifier: GPL-2.0-or-later
//
// The first potential hits of rays: cells in which something is. Nearly always the bodies in there
// decide what a ray hits, so that nothing else is to be known of it.
//
// What takes time is memory, so it is first said, for several rays, what will be looked at, and
// then looked at; and several rays are walked side by side where the processor can do that.

#ifndef STAGE_SENSING_FIRST_HITS_HH
#define STAGE_SENSING_FIRST_HITS_HH

#include "grid/grid.hh"
#include "sensing/ray_group.hh"
#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {

class FirstHits {
 public:
  static constexpr uint32_t kAtOnce = RayGroup::kMost;

  explicit FirstHits(const grid::Grid& grid, WideWalk wide_walk = FindWideWalk())
      : grid_(grid), wide_walk_(wide_walk) {}

  /// Takes the rays of the group, one part after the other. A device has walked them: lists[i] is
  /// where the list of the first ray of part i begins, of per_ray hits for each ray.
  void Look(const RayGroup& rays, const uint32_t* const* lists, uint32_t per_ray);
  /// The same; walks them itself.
  void Walk(const RayGroup& rays);

  /// The first potential hit of ray i of them, as lists have it.
  const uint32_t& Packed(uint32_t i) const { return hits_[i]; }
  /// The bodies in the cell of that.
  grid::BodyList Bodies(uint32_t i) const { return lists_[i]; }
  /// Stands for these if there is nothing in the way.
  static constexpr grid::BodyList kNothing = WideHits::kNothing;
  /// How many of `count` rays from i on have a potential hit.
  uint32_t CountHits(uint32_t i, uint32_t count) const;
  /// Where along its leg the ray is halfway through that cell: the very bits of MiddleOf(). At its
  /// end, which is 1, if there is nothing in the way.
  double Middle(uint32_t i) const { return middles_[i]; }

 private:
  bool HitsNothing(uint32_t i) const { return hits_[i] == RAY_NO_HIT; }
  struct Step {
    int dx, dy;  // Q16 cells
  };
  static Step StepTo(const FanRecord& fan, const Direction& direction);
  void WalkOneByOne(const RayGroup& rays);
  void LookOneByOne(const RayGroup& rays);
  void SideBySide(const RayGroup& rays, decltype(WideWalk::walk) how);
  grid::CellRef CellAt(int32_t x, int32_t y);
  void SetPassage(uint32_t i, const FanRecord& fan, Step step);
  void SetNoPassage(uint32_t i);
  void FindMiddles(uint32_t count);
  void FindBodies(uint32_t count);
  void FetchBodies(uint32_t count) const;

  const grid::Grid& grid_;
  const WideWalk wide_walk_;
  int32_t tile_x_ = 0, tile_y_ = 0;  // that was looked for last
  uint32_t slot_ = 0;                // and where it is; 0: none yet

  uint32_t hits_[kAtOnce];
  grid::CellRef cells_[kAtOnce];
  grid::BodyList lists_[kAtOnce];
  alignas(16) double middles_[kAtOnce];
  // Of the passage through the cell: see Passage in middle.hh.
  alignas(16) double in_x_[kAtOnce], in_y_[kAtOnce], across_[kAtOnce], along_[kAtOnce];
};

}  // namespace Stg::internal::sensing

#endif
