// SPDX-License-Identifier: GPL-2.0-or-later
//
// The two ray models. Part of <stage.hh>.

#ifndef STAGE_GRID_RAY_MODEL_HH
#define STAGE_GRID_RAY_MODEL_HH

namespace Stg {

/// The place that a sensor's range is measured to.
enum class RayModel {
  kDefault,  ///< the world's setting, or kCell if it has none
  kCell,     ///< the cell that the hit outline lies in: accurate to about a cell
  kExact,    ///< the outline itself, whatever the cell size: accurate to the rounding of doubles
};

}  // namespace Stg

#endif
