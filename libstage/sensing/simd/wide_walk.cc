// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/simd/wide_walk.hh"

#include <cstdlib>
#include <cstring>
#include <string>

#include "messages/report.hh"

namespace Stg::internal::sensing {

// Each is defined in the file wide_walk_*.cc of the same name.
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

namespace {

WideWalk ChooseWideWalk() {
  const std::vector<WideWalk> walks = WideWalks();
  const char* name = std::getenv("STAGE_LANES");
  if (!name) return walks.empty() ? WideWalk{} : walks.front();
  std::string known;
  for (const WideWalk& walk : walks) {
    if (std::strcmp(walk.name, name) == 0) return walk;
    known += std::string(walk.name) + ", ";
  }
  const WideWalk none;
  if (std::strcmp(none.name, name) != 0)
    messages::Warn("STAGE_LANES: found \"" + messages::Shortened(name) + "\", expected " + known +
                   "or none; walking ray by ray");
  return none;
}

}  // namespace

const WideWalk& FindWideWalk() {
  static const WideWalk walk = ChooseWideWalk();
  return walk;
}

}  // namespace Stg::internal::sensing
