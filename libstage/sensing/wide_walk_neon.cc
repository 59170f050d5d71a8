// SPDX-License-Identifier: GPL-2.0-or-later
//
// For 64-bit Arm processors, all of which have NEON.

#ifdef STAGE_WALK_NEON

#include "sensing/eight_lanes.hh"
#include "sensing/four_lanes.hh"
#include "sensing/wide_walk_lanes.hh"

namespace Stg::internal::sensing {

extern const WideWalk kWalkNeon;
const WideWalk kWalkNeon{"neon", WalkInLanes<FourLanes, EightLanes>, LookInLanes<FourLanes>,
                         MeetInLanes<FourLanes>};

}  // namespace Stg::internal::sensing

#endif
