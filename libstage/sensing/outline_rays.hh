// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of the exact model that have come to a tile: where they meet the outlines in there, and
// whether they could meet others before. Mostly they can't.

#ifndef STAGE_SENSING_OUTLINE_RAYS_HH
#define STAGE_SENSING_OUTLINE_RAYS_HH

#include <bit>
#include <cstdint>

#include "sensing/fan.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// Some rays of a fan of a single leg that have potential hits.
struct OutlineRays {
  const Fan* fan;
  const Direction* directions;  ///< one for each of the rays
  const SineCosine* turns;      ///< the same
  const uint32_t* hits;         ///< first potential hits, as ray_pack() has it; with the room
                                ///< behind them of WideHits
  uint32_t count;               ///< at most RayGroup::kMost
};

/// Some edges of an outline: bit i stands for that from corners[i] to corners[i + 1], in metres.
struct OutlineEdges {
  const point_t* corners;
  uint32_t edges;
};
/// Several outlines. No std::span, as wide_walk_lanes.hh says.
struct Outlines {
  const OutlineEdges* edges;
  uint32_t count;
};

/// A bit for each ray; those of rays that there are not may be anything, but the last one is 0.
struct SettledRays {
  uint64_t words[RayGroup::kMost / 64 + 1];

  /// The first ray from this one on that is not settled, or one that there is not.
  uint32_t FirstOther(uint32_t ray) const {
    uint32_t word = ray / 64;
    uint64_t others = ~words[word] >> ray % 64 << ray % 64;
    while (others == 0) others = ~words[++word];
    return word * 64 + static_cast<uint32_t>(std::countr_zero(others));
  }
};

/// What rays meet first of some outlines.
struct OutlineHits {
  double* ranges;   ///< of each ray, metres; infinity if it meets none
  uint32_t* which;  ///< of the outlines; of several at the same place the first; 0 if none
  SettledRays settled;
};

// Ray by ray; in lanes: wide_outlines.hh. Ranges and outlines have room for the last lanes: that of
// WideHits.

/// Finds out what the rays meet, and which are settled then: they meet something within their
/// range, and before that they do not leave the tile of their potential hit.
void MeetOneByOne(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found);

/// Where the leg of a ray ends, seen from a tile that it comes to.
struct LegEnd {
  uint32_t tiles;  ///< further than the tile: 0: in there, 1: in the one behind it, 2: elsewhere
  int32_t x, y;    ///< a cell of the tile where it ends
};
/// Of a ray of a fan of a single leg that has a hit in the tile and goes no further than this share
/// of the leg.
LegEnd FindLegEnd(const FanRecord& fan, const Direction& direction, uint32_t hit, double share);

}  // namespace Stg::internal::sensing

#endif
