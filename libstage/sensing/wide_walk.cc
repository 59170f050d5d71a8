// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {

#ifdef STAGE_WIDE_WALK

// wide_walk_avx512.cc
void WalkEightLanes(const RayGroup& rays, const grid::Grid::Tables& tables, const WideHits& found);
void LookInEightLanes(const RayGroup& rays, const grid::Grid::Tables& tables,
                      const WideHits& found);

WideWalk FindWideWalk() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("bmi2"))
    return {WalkEightLanes, LookInEightLanes};
  return {};
}

#else

WideWalk FindWideWalk() { return {}; }

#endif

}  // namespace Stg::internal::sensing
