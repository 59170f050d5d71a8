// SPDX-License-Identifier: GPL-2.0-or-later
//
// Records the walk of a ray step by step, for pictures and tests. Makes the leaps of ray_next() one
// at a time, with the same functions; sensing itself does not use it.

#ifndef STAGE_SENSING_WALK_RECORD_HH
#define STAGE_SENSING_WALK_RECORD_HH

#include <cstdint>
#include <vector>

#include "kernels/ray_walk.h"

namespace Stg::internal::sensing {

struct WalkStep {
  enum class Kind : uint8_t {
    kCell,    ///< to the next cell, in an occupied tile
    kTile,    ///< over an empty tile
    kRegion,  ///< over an empty region
    kSuper,   ///< over an empty superregion
    kHit      ///< stays in an occupied cell: a potential hit
  };
  Kind kind;
  int32_t x, y;     ///< the cell in which the step begins
  double from, to;  ///< where the ray enters and leaves it, as fractions of its displacement
};

/// Walks to the end of the ray, at most `max_cells` steps. `ray` is as ray_begin() leaves it.
void RecordWalk(const ray_grid_t& grid, const ray_mask_t& mask, ray_t ray, std::size_t max_cells,
                std::vector<WalkStep>* steps);

}  // namespace Stg::internal::sensing

namespace Stg {
namespace sensing = internal::sensing;  // for internal modules: clients do not see this header
}

#endif
