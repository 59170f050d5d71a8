// SPDX-License-Identifier: GPL-2.0-or-later
//
// How far rays get for certain. Those of a robot all begin at about the same place, and meet the
// same emptiness near it: that is looked at once for all of them, and each begins its walk where it
// leaves it.

#ifndef STAGE_SENSING_FREE_BOX_HH
#define STAGE_SENSING_FREE_BOX_HH

#include "grid/grid.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// A box for each direction of travel, in which there is nothing but what the self-mask hides.
struct FreeBoxes {
  /// [goes to smaller y][goes to smaller x]
  grid::CellBox towards[2][2];
};

/// Boxes around the starts of the rays, or around that of the first, up to three regions wide.
/// Empty if there is something in the very tiles that they start in.
FreeBoxes FindFreeBoxes(const RayGroup& rays);
/// The same if there are enough rays for that to pay, else empty ones.
FreeBoxes FindFreeBoxesOfMany(const RayGroup& rays);

}  // namespace Stg::internal::sensing

#endif
