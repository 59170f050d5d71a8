// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays that are walked together: of one or several fans, such as a robot's sonars.

#ifndef STAGE_SENSING_RAY_GROUP_HH
#define STAGE_SENSING_RAY_GROUP_HH

#include "sensing/fan.hh"

namespace Stg::internal::sensing {

/// Some rays of a fan of a single leg.
struct FanPart {
  const FanRecord* fan;
  const Direction* directions;  ///< one for each of the rays
  uint32_t count;
  double leg_length;       ///< metres
  const uint32_t* walked;  ///< from its first ray on: see HitLists; null if no device walked them
};

/// What a device says of the part's rays, one after the other: bodies, 0 where it knows none, and
/// first hits. Static, as wide_walk_lanes.hh says.
static inline void TakeOver(const FanPart& part, uint32_t words_of_a_ray, uint32_t* bodies,
                            uint32_t* hits) {
  const uint32_t* words = part.walked;
  for (uint32_t i = 0; i < part.count; i++, words += words_of_a_ray) {
    bodies[i] = words[0];
    hits[i] = words[1];
  }
}

/// Of rays of the exact model a device says nothing but where their hits are.
static inline void ForgetBodies(uint32_t count, uint32_t* bodies) {
  for (uint32_t i = 0; i < count; i++) bodies[i] = 0;
}

/// Rays that have a layer of the grid and a self-mask in common: those of the parts, one after the
/// other.
struct RayGroup {
  static constexpr uint32_t kMost = 256;

  const ray_grid_t* grid;
  const ray_mask_t* mask;
  const FanPart* parts;
  uint32_t part_count;
  uint32_t count;           ///< of rays, at most kMost
  uint32_t words_of_a_ray;  ///< of those that a device walked
  bool exact = false;       ///< of the exact model
};

}  // namespace Stg::internal::sensing

#endif
