// SPDX-License-Identifier: GPL-2.0-or-later
//
// How far rays get for certain. Those of a robot all begin at about the same place, and meet the
// same emptiness near it: that is looked at once for all of them, and each begins its walk where it
// leaves it.

#ifndef STAGE_SENSING_FREE_BOX_HH
#define STAGE_SENSING_FREE_BOX_HH

#include <cstdint>

#include "kernels/ray_walk.h"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// Cells from (min_x, min_y) to (max_x, max_y), both included.
struct FreeBox {
  int32_t min_x = 0, min_y = 0;
  int32_t max_x = -1, max_y = -1;  ///< less than min: no cell
};

/// A box for each direction of travel, in which there is nothing but what the window hides.
struct FreeBoxes {
  /// [goes to smaller y][goes to smaller x]
  FreeBox towards[2][2];
};

/// Boxes around the starts of the rays, or around that of the first, up to three regions wide.
/// Without cells if there is something in the very tiles that they start in.
FreeBoxes FindFreeBoxes(const RayGroup& rays);

}  // namespace Stg::internal::sensing

#endif
