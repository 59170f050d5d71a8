// SPDX-License-Identifier: GPL-2.0-or-later
//
// State that the models of a world share: the grid and the batch of the step.

#ifndef STAGE_SENSING_SCENE_HH
#define STAGE_SENSING_SCENE_HH

#include <cstddef>
#include <cstdint>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "messages/assert.hh"
#include "sensing/batch.hh"

namespace Stg::internal::sensing {

struct Scene {
  double cells_per_metre = 50;
  RayModel ray_model = RayModel::kCell;  ///< for sensors that do not set it
  bool exact_rasterization = false;      ///< bodies have an exact rasterization too
  grid::Grid grid;
  DirectionTables tables;
  RayBatch batch;
  FanList fans;  ///< scratch of a model that updates alone
  /// True while the world is deleted or reset: rays see nothing, and bodies are not removed one by
  /// one, because the grid is dropped as a whole.
  bool tearing_down = false;
  void BeginTeardown() {
    tearing_down = true;
    grid.Hide();
  }
  /// Clears the grid for a new world.
  void Return() {
    STAGE_ASSERT(tearing_down);
    tearing_down = false;
    grid.AssignCopy(grid::Grid());
  }
  uint64_t body_changes = 0;  ///< number of changes of body shapes
  uint64_t batch_number = 1;  ///< number of batches: identifies data left over from earlier ones

  /// Makes the missing layers of the finder's consecutive fans in the batch, from first_fan on.
  void MakeLayers(uint32_t first_fan, const Model* finder) {
    for (uint32_t i = first_fan; i < batch.fans().size(); i++) {
      const Fan& fan = batch.fans()[i];
      if (fan.finder != finder) return;
      if (fan.layer == grid::kNoLayer)
        batch.SetLayer(i, grid.RangerLayer(fan.z, fan.z_test, fan.exact));
    }
  }
  /// Bounding box in metres of everything that was ever rasterized.
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
