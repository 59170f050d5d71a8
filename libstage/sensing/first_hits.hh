// SPDX-License-Identifier: GPL-2.0-or-later
//
// The first potential hits of rays: cells in which something is. Nearly always the bodies in there
// decide what a ray hits, so that nothing else is to be known of it.
//
// What takes time is memory, so it is first said, for several rays, what will be looked at, and
// then looked at; and several rays are walked side by side where the processor can do that.

#ifndef STAGE_SENSING_FIRST_HITS_HH
#define STAGE_SENSING_FIRST_HITS_HH

#include <bit>
#include <cstdint>

#include "grid/grid.hh"
#include "sensing/ray_group.hh"
#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {

class FirstHits {
 public:
  static constexpr uint32_t kAtOnce = RayGroup::kMost;

  explicit FirstHits(const grid::Grid& grid, WideWalk wide_walk = FindWideWalk())
      : grid_(grid), wide_walk_(wide_walk) {}

  /// Takes the rays of the group, one part after the other, which a device has walked. Writes their
  /// ranges: as MiddleOf() has them for those with a potential hit, to the very bits; for exact
  /// rays the lengths of their legs.
  void Look(const RayGroup& rays, double* ranges);
  /// The same; walks them itself.
  void Walk(const RayGroup& rays, double* ranges);

  /// The first potential hit of ray i of them, as lists have it.
  const uint32_t& Packed(uint32_t i) const { return hits_[i]; }
  /// The bodies in the cell of that; of exact rays the OutlineList of its tile.
  grid::BodyList Bodies(uint32_t i) const { return lists_[i]; }
  /// MeetOneByOne(), for some of these rays.
  void Meet(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) const {
    if (wide_walk_.meet && rays.count >= kFewestToMeet)
      wide_walk_.meet(rays, outlines, found);
    else
      MeetOneByOne(rays, outlines, found);
  }
  /// The first ray behind i with other bodies, or of another part.
  uint32_t EndOfRun(uint32_t i) const {
    uint32_t word = i / 64;
    uint64_t ends = ends_[word] >> i % 64 << i % 64;
    while (ends == 0) ends = ends_[++word];
    return word * 64 + static_cast<uint32_t>(std::countr_zero(ends)) + 1;
  }
  /// Stands for these if there is nothing in the way.
  static constexpr grid::BodyList kNothing = WideHits::kNothing;

 private:
  /// Fewer rays are taken faster one by one.
  static constexpr uint32_t kFewestForLanes = 4, kFewestToMeet = 2;

  bool HitsNothing(uint32_t i) const { return hits_[i] == RAY_NO_HIT; }
  void WalkOneByOne(const RayGroup& rays);
  void LookOneByOne(const RayGroup& rays);
  grid::CellRef CellAt(int32_t x, int32_t y);
  void SetPassage(uint32_t i, const FanRecord& fan, const Displacement& way);
  void SetNoPassage(uint32_t i);
  void FindMiddles(uint32_t count);
  void FindBodies(const RayGroup& rays);
  void WriteRanges(const RayGroup& rays, double* ranges) const;
  void FetchBodies(const RayGroup& rays) const;
  void FindEnds(uint32_t count);
  void EndParts(const RayGroup& rays);

  const grid::Grid& grid_;
  const WideWalk wide_walk_;
  int32_t tile_x_ = 0, tile_y_ = 0;  // that was looked for last
  uint32_t slot_ = 0;                // and where it is; 0: none yet

  uint32_t hits_[WideHits::kRoom];
  grid::BodyList lists_[WideHits::kRoom];
  uint64_t ends_[WideHits::kEndWords];  // of runs of rays with the same bodies
  // Of rays one by one:
  grid::CellRef cells_[kAtOnce];
  alignas(16) double middles_[kAtOnce];  // where along its leg it is halfway through that cell
  // Of the passage through the cell: see Passage in middle.hh.
  alignas(16) double in_x_[kAtOnce], in_y_[kAtOnce], across_[kAtOnce], along_[kAtOnce];
};

}  // namespace Stg::internal::sensing

#endif
