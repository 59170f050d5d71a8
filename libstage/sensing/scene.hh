// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the models of a world share: the grid that they are drawn in and the batch of the step.

#ifndef STAGE_SENSING_SCENE_HH
#define STAGE_SENSING_SCENE_HH

#include <cstddef>
#include <cstdint>

#include "geometry/geometry.hh"
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
  FanList fans;  ///< of the model that is updating, if it does so alone; for its memory
  /// The world is being deleted or reset: nothing is seen any more, and no body taken off the grid,
  /// which goes as a whole.
  bool going = false;
  void Go() {
    going = true;
    grid.Hide();
  }
  /// All is gone; another world begins here.
  void Return() {
    going = false;
    grid.Become(grid::Grid());
  }
  uint64_t body_changes = 0;  ///< counts changes of the shapes of bodies
  uint64_t batch_number = 1;  ///< counts batches: tells what is left over from an earlier one

  /// Makes the layers that rangers' fans look for, at heights that nobody looked at so far: those
  /// of the finder in the batch, from the given one on.
  void MakeLayers(uint32_t first_fan, const Model* finder) {
    for (uint32_t i = first_fan; i < batch.fans().size(); i++) {
      const Fan& fan = batch.fans()[i];
      if (fan.finder != finder) return;
      if (fan.layer == grid::kNoLayer)
        batch.SetLayer(i, grid.RangerLayer(fan.z, fan.z_test, fan.exact));
    }
  }
  /// The plane area that anything was ever drawn in.
  bounds3d_t Extent() const {
    const grid::CellBox box = grid.extent();
    bounds3d_t extent;
    if (box.empty()) return extent;
    extent.x = Bounds(box.min_x / cells_per_metre, (box.max_x + 1.0) / cells_per_metre);
    extent.y = Bounds(box.min_y / cells_per_metre, (box.max_y + 1.0) / cells_per_metre);
    return extent;
  }
};

}  // namespace Stg::internal::sensing

#endif
