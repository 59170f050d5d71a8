// SPDX-License-Identifier: GPL-2.0-or-later
//
// Free space around the starts of rays. All rays of a robot start at about the same place in the
// same empty surroundings, which are examined once: each ray starts where it leaves them.

#ifndef STAGE_SENSING_FREE_BOX_HH
#define STAGE_SENSING_FREE_BOX_HH

#include "grid/grid.hh"
#include "sensing/ray_group.hh"

namespace Stg::internal::sensing {

/// Per direction of travel, a box that holds nothing but what the self-mask hides.
struct FreeBoxes {
  /// [dy < 0][dx < 0]
  grid::CellBox towards[2][2];
};

/// Boxes around the starts of all rays, or around the first, up to three regions wide. Empty if the
/// start tiles are occupied.
FreeBoxes FindFreeBoxes(const RayGroup& rays);
/// Like FindFreeBoxes(), but returns empty boxes if there are too few rays for it to pay.
FreeBoxes FindFreeBoxesIfWorthwhile(const RayGroup& rays);

}  // namespace Stg::internal::sensing

#endif
