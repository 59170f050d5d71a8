// SPDX-License-Identifier: GPL-2.0-or-later
//
// For x86-64 processors with AVX2. Must not be called on others.

#ifdef STAGE_WALK_AVX2

#include "sensing/simd/eight_lanes.hh"
#include "sensing/simd/four_lanes.hh"
#include "sensing/simd/wide_walk_lanes.hh"

namespace Stg::internal::sensing {

extern const WideWalk kWalkAvx2;
const WideWalk kWalkAvx2{"avx2", WalkInLanes<FourLanes, EightLanes>, EvaluateInLanes<FourLanes>,
                         MeetInLanes<FourLanes>};

}  // namespace Stg::internal::sensing

#endif
