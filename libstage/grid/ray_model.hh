// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a ray meets. Part of <stage.hh>.

#ifndef STAGE_GRID_RAY_MODEL_HH
#define STAGE_GRID_RAY_MODEL_HH

namespace Stg {

/// To what the range of a sensor reading goes.
enum class RayModel {
  kDefault,  ///< what the world says, and kCell if it says nothing
  kCell,     ///< the cell of the grid that holds the outline that was hit: right to about a cell
  kExact,    ///< the outline itself, whatever the cell size: right to the rounding of doubles
};

}  // namespace Stg

#endif
