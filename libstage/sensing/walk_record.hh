// SPDX-License-Identifier: GPL-2.0-or-later
//
// The walk of a ray, step by step, for pictures and tests. It takes the leaps of ray_next() one at
// a time, by the same functions; sensing itself never comes here.

#ifndef STAGE_SENSING_WALK_RECORD_HH
#define STAGE_SENSING_WALK_RECORD_HH

#include <cstdint>
#include <vector>

#include "kernels/ray_walk.h"

namespace Stg::internal::sensing {

struct WalkStep {
  enum class Kind : uint8_t {
    kCell,    ///< to the next cell, in a tile that holds something
    kTile,    ///< over an empty tile
    kRegion,  ///< over an empty region
    kSuper,   ///< over an empty superregion
    kHit      ///< a potential hit: the cell is occupied. The walk stays there
  };
  Kind kind;
  int32_t x, y;     ///< the cell that the step began in
  double from, to;  ///< shares of the ray's displacement: where it entered, and left for the next
};

/// Walks on to the end of the ray, or `most` steps. `ray` is as ray_begin() leaves it.
void RecordWalk(const ray_grid_t& grid, const ray_mask_t& mask, ray_t ray, std::size_t most,
                std::vector<WalkStep>* steps);

}  // namespace Stg::internal::sensing

namespace Stg {
namespace sensing = internal::sensing;  // for the rooms above: clients see no such header
}

#endif
