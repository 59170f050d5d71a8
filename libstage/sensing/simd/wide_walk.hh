// SPDX-License-Identifier: GPL-2.0-or-later
//
// First potential hits of several rays in lock-step, one per lane of the processor's vectors. The
// walk is that of kernels/ray_walk.h and finds the same cells as ray_next().
//
// Processors without one of the files wide_walk_*.cc walk ray by ray.

#ifndef STAGE_SENSING_SIMD_WIDE_WALK_HH
#define STAGE_SENSING_SIMD_WIDE_WALK_HH

#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/outline_rays.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// Output arrays: the first potential hits of a group's rays.
struct WideHits {
  uint32_t* hits;          ///< kCapacity elements: as by ray_pack(), or RAY_NO_HIT
  grid::BodyList* bodies;  ///< kCapacity elements: bodies in the cell of the hit; for exact rays
                           ///< the OutlineList of its tile; kNothing without a hit
  double* ranges;          ///< to the middle of that cell; the fan's range without a hit
  uint64_t* ends;  ///< kEndWords words: bit i is set if rays i and i + 1 have different bodies; the
                   ///< last ray's bit is unspecified
  static constexpr uint32_t kCapacity = RayGroup::kMaxRays + 16;
  static constexpr uint32_t kEndWords = RayGroup::kMaxRays / 64 + 1;
  static constexpr grid::BodyList kNothing = 0xffffffffu;
};

struct WideWalk {
  const char* name = "none";
  /// Walks the rays. `tables` are those of the grid.
  void (*walk)(const RayGroup& rays, const grid::Grid::Tables& tables,
               const WideHits& found) = nullptr;
  /// Fills in the rest for rays that a device has walked.
  void (*evaluate)(const RayGroup& rays, const grid::Grid::Tables& tables,
                   const WideHits& found) = nullptr;
  /// MeetOneByOne() in lanes.
  void (*meet)(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) = nullptr;
};

/// The variants in this build that the processor supports, fastest first.
std::vector<WideWalk> WideWalks();
/// The fastest variant, or the one named by the environment variable STAGE_LANES at the first call.
/// Has null pointers if there is none.
const WideWalk& FindWideWalk();

}  // namespace Stg::internal::sensing

#endif
