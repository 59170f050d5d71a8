// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/wide_walk.hh"

#include <algorithm>
#include <cstdlib>
#include <cstring>

namespace Stg::internal::sensing {

// Each is in the file wide_walk_*.cc of that name.
#ifdef STAGE_WALK_AVX512
extern const WideWalk kWalkAvx512;
#endif
#ifdef STAGE_WALK_AVX2
extern const WideWalk kWalkAvx2;
#endif
#ifdef STAGE_WALK_NEON
extern const WideWalk kWalkNeon;
#endif

std::vector<WideWalk> WideWalks() {
  std::vector<WideWalk> walks;
#ifdef STAGE_WALK_AVX512
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("bmi2"))
    walks.push_back(kWalkAvx512);
#endif
#ifdef STAGE_WALK_AVX2
  if (__builtin_cpu_supports("avx2")) walks.push_back(kWalkAvx2);
#endif
#ifdef STAGE_WALK_NEON
  walks.push_back(kWalkNeon);
#endif
  return walks;
}

WideWalk FindWideWalk() {
  const std::vector<WideWalk> walks = WideWalks();
  const char* asked_for = std::getenv("STAGE_LANES");
  if (!asked_for) return walks.empty() ? WideWalk{} : walks.front();
  const auto walk = std::find_if(walks.begin(), walks.end(), [&](const WideWalk& known) {
    return std::strcmp(known.name, asked_for) == 0;
  });
  return walk == walks.end() ? WideWalk{} : *walk;
}

}  // namespace Stg::internal::sensing
