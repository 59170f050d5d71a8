// SPDX-License-Identifier: GPL-2.0-or-later
//
// First potential hits of rays: the first occupied cells. Nearly always the bodies in that cell
// decide what a ray hits.
//
// Memory dominates the cost, so the data of several rays are prefetched before they are used, and
// rays are walked in lanes where the processor supports that.

#ifndef STAGE_SENSING_FIRST_HITS_HH
#define STAGE_SENSING_FIRST_HITS_HH

#include <bit>
#include <cstdint>

#include "grid/grid.hh"
#include "sensing/ray_group.hh"
#include "sensing/simd/wide_walk.hh"

namespace Stg::internal::sensing {

class FirstHits {
 public:
  static constexpr uint32_t kAtOnce = RayGroup::kMaxRays;

  explicit FirstHits(const grid::Grid& grid, WideWalk wide_walk = FindWideWalk())
      : grid_(grid), wide_walk_(wide_walk) {}

  /// Takes the hits of a group's rays that a device has walked. Writes their ranges: bit-equal to
  /// MiddleOf() for rays with a potential hit; for exact rays the lengths of their legs.
  void EvaluateDeviceHits(const RayGroup& rays, double* ranges);
  /// Like EvaluateDeviceHits(), but walks the rays itself.
  void Walk(const RayGroup& rays, double* ranges);

  /// First potential hit of ray i of the group, packed as by ray_pack().
  const uint32_t& Packed(uint32_t i) const { return hits_[i]; }
  /// The bodies in the cell of that hit; for exact rays the OutlineList of its tile.
  grid::BodyList Bodies(uint32_t i) const { return lists_[i]; }
  /// MeetOneByOne() for some of these rays, in lanes where that pays.
  void Meet(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) const {
    if (wide_walk_.meet && rays.count >= kMinToMeet)
      wide_walk_.meet(rays, outlines, found);
    else
      MeetOneByOne(rays, outlines, found);
  }
  /// End of the interval of rays that starts at i: rays of one slice with the same bodies.
  uint32_t EndOfInterval(uint32_t i) const {
    uint32_t word = i / 64;
    uint64_t ends = ends_[word] >> i % 64 << i % 64;
    while (ends == 0) ends = ends_[++word];
    return word * 64 + static_cast<uint32_t>(std::countr_zero(ends)) + 1;
  }
  /// Value of Bodies() for rays without a hit.
  static constexpr grid::BodyList kNothing = WideHits::kNothing;

 private:
  /// Fewer rays are faster one by one.
  static constexpr uint32_t kMinForLanes = 4, kMinToMeet = 2;

  bool HitsNothing(uint32_t i) const { return hits_[i] == RAY_NO_HIT; }
  void WalkOneByOne(const RayGroup& rays);
  void EvaluateOneByOne(const RayGroup& rays);
  grid::CellRef CellAt(int32_t x, int32_t y);
  void SetPassage(uint32_t i, const FanRecord& fan, const Displacement& way);
  void SetNoPassage(uint32_t i);
  void FindMiddles(uint32_t count);
  void FindBodies(const RayGroup& rays);
  void WriteRanges(const RayGroup& rays, double* ranges) const;
  void PrefetchBodies(const RayGroup& rays) const;
  void FindEnds(uint32_t count);
  void EndSlices(const RayGroup& rays);

  const grid::Grid& grid_;
  const WideWalk wide_walk_;
  int32_t tile_x_ = 0, tile_y_ = 0;  // tile that was looked up last
  uint32_t slot_ = 0;                // slot of that tile; 0: none yet

  uint32_t hits_[WideHits::kCapacity];
  grid::BodyList lists_[WideHits::kCapacity];
  uint64_t ends_[WideHits::kEndWords];  // bit i: ray i ends an interval of equal bodies
  // Used for rays one by one.
  grid::CellRef cells_[kAtOnce];
  alignas(16) double middles_[kAtOnce];  // results of FindMiddles(), as fractions of the legs
  // Passages through the cells: see Passage in middle.hh.
  alignas(16) double in_x_[kAtOnce], in_y_[kAtOnce], across_[kAtOnce], along_[kAtOnce];
};

}  // namespace Stg::internal::sensing

#endif
