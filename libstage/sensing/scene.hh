// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the models of a world share: the grid that they are drawn in and the batch of the step.

#ifndef STAGE_SENSING_SCENE_HH
#define STAGE_SENSING_SCENE_HH

#include <cstddef>
#include <cstdint>

#include "grid/grid.hh"
#include "sensing/batch.hh"

namespace Stg::internal::sensing {

struct Scene {
  double cells_per_metre = 50;
  RayModel ray_model = RayModel::kCell;  ///< of sensors that don't say
  bool exact_drawing = false;            ///< bodies are drawn for the exact ray model too
  grid::Grid grid;
  DirectionTables tables;
  RayBatch batch;
  uint64_t body_changes = 0;  ///< counts changes of the shapes of bodies
  uint64_t batch_number = 1;  ///< counts batches: tells what is left over from an earlier one
};

}  // namespace Stg::internal::sensing

#endif
