// SPDX-License-Identifier: GPL-2.0-or-later
//
// The walk of kernels/ray_walk.h for several rays of a fan side by side, one in each lane of the
// processor's vectors, to their first potential hits. It finds the very cells that ray_next()
// finds.
//
// For processors that can fetch from several places at once (gather); others walk ray by ray.

#ifndef STAGE_SENSING_WIDE_WALK_HH
#define STAGE_SENSING_WIDE_WALK_HH

#include <cstdint>

#include "kernels/ray_walk.h"

namespace Stg::internal::sensing {

struct Direction;
struct FanRecord;

/// Rays of a fan of a single leg.
struct WideRays {
  static constexpr uint32_t kMost = 128;

  const ray_grid_t* grid;
  const ray_window_t* window;
  const FanRecord* fan;
  const Direction* directions;  ///< one for each ray
  uint32_t count;               ///< at most kMost
};

/// Where they were stopped first. Plain arrays: what vectors are stored to.
struct WideHits {
  /// As ray_pack() has it; RAY_NO_HIT: nothing is in the way.
  alignas(64) int64_t hits[WideRays::kMost];
  /// The cell's tile, region * 64 + its tile in the region.
  alignas(64) int64_t tiles[WideRays::kMost];
  /// Displacement of each ray, Q16 cells.
  alignas(64) int64_t dx[WideRays::kMost], dy[WideRays::kMost];
};

using WideWalk = void (*)(const WideRays& rays, WideHits* hits);

/// With this many lanes, 8 or 4; nullptr if this processor has none of that width, or this program
/// was made for other processors.
WideWalk FindWideWalk(uint32_t lanes);
/// The widest, or nullptr.
WideWalk FindWidestWalk();

}  // namespace Stg::internal::sensing

#endif
