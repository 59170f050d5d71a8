// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays of the exact model that have reached a tile: where they meet its outlines, and whether they
// could meet others before. Mostly they cannot.

#ifndef STAGE_SENSING_OUTLINE_RAYS_HH
#define STAGE_SENSING_OUTLINE_RAYS_HH

#include <bit>
#include <cstdint>

#include "sensing/fan.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// Some rays, with potential hits, of a fan with a single leg.
struct OutlineRays {
  const Fan* fan;
  const Direction* directions;     ///< one per ray
  const SineCosine* unit_vectors;  ///< one per ray
  const uint32_t* hits;            ///< first potential hits, as by ray_pack(), padded like WideHits
  uint32_t count;                  ///< at most RayGroup::kMaxRays
};

/// Edges of an outline: bit i selects the edge from corners[i] to corners[i + 1], in metres.
struct OutlineEdges {
  const point_t* corners;
  uint32_t edges;
};
/// Several outlines; not a std::span, see wide_walk_lanes.hh.
struct Outlines {
  const OutlineEdges* edges;
  uint32_t count;
};

/// One bit per ray. Bits past the last ray are unspecified, but the very last is 0 (sentinel).
struct ResolvedRays {
  uint64_t words[RayGroup::kMaxRays / 64 + 1];

  /// The first unsettled ray from `ray` on, or an index past the last ray.
  uint32_t FirstOther(uint32_t ray) const {
    uint32_t word = ray / 64;
    uint64_t others = ~words[word] >> ray % 64 << ray % 64;
    while (others == 0) others = ~words[++word];
    return word * 64 + static_cast<uint32_t>(std::countr_zero(others));
  }
};

/// First hits of rays among some outlines.
struct OutlineHits {
  double* ranges;   ///< per ray, metres; infinity if it meets none
  uint32_t* which;  ///< per ray: index of the outline, the smallest at equal range; 0 if none
  ResolvedRays resolved;
};

// Ray by ray; wide_outlines.hh does it in lanes. Ranges and outlines are padded like WideHits.

/// Finds what the rays meet and which of them are settled: those that meet something within their
/// range before they leave the tile of their potential hit.
void MeetOneByOne(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found);

/// The end of a ray's leg, seen from a tile on its way.
struct LegEnd {
  uint32_t tiles;  ///< where the leg ends: 0 in this tile, 1 in the next one, 2 further away
  int32_t x, y;    ///< a cell of the tile in which it ends
};
/// For a ray of a single leg with a hit in the tile, which ends after this fraction of the leg.
LegEnd FindLegEnd(const FanRecord& fan, const Direction& direction, uint32_t hit,
                  double leg_fraction);

}  // namespace Stg::internal::sensing

#endif
