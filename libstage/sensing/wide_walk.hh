// SPDX-License-Identifier: GPL-2.0-or-later
//
// First potential hits of several rays side by side, one in each lane of the processor's vectors.
// The walk is that of kernels/ray_walk.h: it finds the very cells that ray_next() finds.
//
// Other processors than those of the files wide_walk_*.cc walk ray by ray.

#ifndef STAGE_SENSING_WIDE_WALK_HH
#define STAGE_SENSING_WIDE_WALK_HH

#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/outline_rays.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// What stands in the way of each ray of a group.
struct WideHits {
  uint32_t* hits;          ///< as ray_pack() has it, or RAY_NO_HIT; kRoom of them
  grid::BodyList* bodies;  ///< in the cell of the hit, or, of exact rays, the OutlineList of its
                           ///< tile; kNothing if there is no hit; kRoom of them
  double* ranges;          ///< to the middle of that cell; that of the fan if there is no hit
  uint64_t* ends;  ///< bit i: the bodies of ray i + 1 are others than those of ray i; kEndWords,
                   ///< those of the last ray may be anything
  static constexpr uint32_t kRoom = RayGroup::kMost + 16;
  static constexpr uint32_t kEndWords = RayGroup::kMost / 64 + 1;
  static constexpr grid::BodyList kNothing = 0xffffffffu;
};

struct WideWalk {
  const char* name = "none";
  /// Walks the rays. `tables` are the grid's.
  void (*walk)(const RayGroup& rays, const grid::Grid::Tables& tables,
               const WideHits& found) = nullptr;
  /// The same for rays that a device has walked.
  void (*look)(const RayGroup& rays, const grid::Grid::Tables& tables,
               const WideHits& found) = nullptr;
  /// MeetOneByOne().
  void (*meet)(const OutlineRays& rays, const Outlines& outlines, OutlineHits* found) = nullptr;
};

/// Those that the library was made with and this processor can run, the fastest first.
std::vector<WideWalk> WideWalks();
/// The fastest of them, or the one that the environment variable STAGE_LANES named when this was
/// called first. Null pointers if there is none.
const WideWalk& FindWideWalk();

}  // namespace Stg::internal::sensing

#endif
