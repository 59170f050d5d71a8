// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/wide_walk.hh"

namespace Stg::internal::sensing {

#ifdef STAGE_WIDE_WALKS

void WalkEight(const WideRays& rays, WideHits* hits);  // wide_walk_avx512.cc

WideWalk FindWideWalk(uint32_t lanes) {
  if (lanes == 8 && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("bmi2"))
    return WalkEight;
  return nullptr;
}

#else

WideWalk FindWideWalk(uint32_t) { return nullptr; }

#endif

WideWalk FindWidestWalk() {
  const WideWalk eight = FindWideWalk(8);
  return eight ? eight : FindWideWalk(4);
}

}  // namespace Stg::internal::sensing
