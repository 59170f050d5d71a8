// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rays that are walked together, from one or several fans, such as a robot's sonars.

#ifndef STAGE_SENSING_RAY_GROUP_HH
#define STAGE_SENSING_RAY_GROUP_HH

#include "sensing/fan.hh"

namespace Stg::internal::sensing {

/// A slice of the rays of a fan with a single leg.
struct FanSlice {
  const FanRecord* fan;
  const Direction* directions;  ///< one per ray
  uint32_t count;
  double leg_length;       ///< metres
  const uint32_t* walked;  ///< HitLists data from its first ray on; null if no device walked it
};

/// Copies a device's results for the slice: bodies (0 if unknown) and first hits. Static for the
/// reason given in wide_walk_lanes.hh.
static inline void CopyDeviceHits(const FanSlice& slice, uint32_t words_per_ray, uint32_t* bodies,
                                  uint32_t* hits) {
  const uint32_t* words = slice.walked;
  for (uint32_t i = 0; i < slice.count; i++, words += words_per_ray) {
    bodies[i] = words[0];
    hits[i] = words[1];
  }
}

/// Clears the bodies: for exact rays a device supplies hits only.
static inline void ClearBodies(uint32_t count, uint32_t* bodies) {
  for (uint32_t i = 0; i < count; i++) bodies[i] = 0;
}

/// Rays with a common layer and self-mask: those of all slices, one after the other.
struct RayGroup {
  static constexpr uint32_t kMaxRays = 256;

  const ray_grid_t* grid;
  const ray_mask_t* mask;
  const FanSlice* slices;
  uint32_t slice_count;
  uint32_t count;          ///< number of rays, at most kMaxRays
  uint32_t words_per_ray;  ///< words per ray in `walked`
  bool exact = false;      ///< rays of the exact model
};

}  // namespace Stg::internal::sensing

#endif
