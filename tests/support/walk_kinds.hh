// SPDX-License-Identifier: GPL-2.0-or-later
//
// All implementations of the vectorized walk that this machine can run.

#ifndef STAGE_TESTS_SUPPORT_WALK_KINDS_HH
#define STAGE_TESTS_SUPPORT_WALK_KINDS_HH

#include <vector>

#include "sensing/simd/wide_walk.hh"
#include "sensing/simd/wide_walk_lanes.hh"
#include "support/portable_lanes.hh"

namespace Stg::test {

template <int kLanes>
sensing::WideWalk PortableWalk(const char* name) {
  using Lanes = PortableLanes<kLanes>;
  sensing::WideWalk walk{name, sensing::WalkInLanes<Lanes, PortableNarrowLanes<kLanes>>,
                         sensing::EvaluateInLanes<Lanes>};
  if constexpr (64 % kLanes == 0) walk.meet = sensing::MeetInLanes<Lanes>;
  return walk;
}

/// The implementations for this processor, and portable ones with several numbers of lanes.
inline std::vector<sensing::WideWalk> WalkKinds() {
  std::vector<sensing::WideWalk> kinds = sensing::WideWalks();
  kinds.push_back(PortableWalk<8>("portable8"));
  kinds.push_back(PortableWalk<4>("portable4"));
  kinds.push_back(PortableWalk<3>("portable3"));  // does not support outlines
  kinds.push_back(PortableWalk<1>("portable1"));
  return kinds;
}

}  // namespace Stg::test

#endif
