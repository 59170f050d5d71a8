// SPDX-License-Identifier: GPL-2.0-or-later
//
// The two ray models. Part of <stage.hh>.

#ifndef STAGE_GRID_RAY_MODEL_HH
#define STAGE_GRID_RAY_MODEL_HH

namespace Stg {

/// What the range of a sensor reading is measured to.
enum class RayModel {
  kDefault,  ///< what the world says, and kCell if it says nothing
  kCell,     ///< the cell of the grid that holds the outline that was hit: right to about a cell
  kExact,    ///< the outline itself, whatever the cell size: right to the rounding of doubles
};

}  // namespace Stg

#endif
