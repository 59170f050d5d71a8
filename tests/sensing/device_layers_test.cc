// SPDX-License-Identifier: GPL-2.0-or-later
//
// A device's copy of the layers, simulated by a vector, equals the grid after every change, whether
// everything was sent or only the changes.

#include "sensing/device_layers.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

#include "support/ray_scene.hh"

namespace Stg::internal::sensing {
namespace {

using grid::LayerIndex;

class Copy {
 public:
  void Update(const grid::Grid& grid, const std::vector<LayerIndex>& wanted) {
    layers.AllocateLayers(grid, wanted);
    if (layers.words() > words.size()) {
      words.assign(layers.words() + layers.words() / 2, 0xbadbadbadbadbadu);
      layers.Invalidate();
    }
    layers.NeedsFullCopy(grid, wanted) ? WriteAll(grid) : WriteChanges(grid, wanted);
  }

  void ExpectEqual(const grid::Grid& grid, const std::vector<LayerIndex>& wanted) const {
    for (const LayerIndex index : wanted) {
      const grid::Occupancy& cells = grid.occupancy(index);
      const DeviceBatch::LayerPlace place = layers.PlaceOf(index);
      EXPECT_EQ(place.tile_maps % 8, 0u) << "in the middle of a cache line";
      EXPECT_EQ(place.tiles % 8, 0u);
      EXPECT_TRUE(std::equal(cells.tile_maps().begin(), cells.tile_maps().end(),
                             words.begin() + place.tile_maps));
      EXPECT_TRUE(
          std::equal(cells.tiles().begin(), cells.tiles().end(), words.begin() + place.tiles));
      EXPECT_EQ(cells.changed().Count(), 0u);
    }
    for (uint32_t slot = 0; slot < grid.region_count() * grid::kTilesPerRegion; slot++)
      EXPECT_EQ(words[slot / 2] >> slot % 2 * 32 & 0xffffffffu, grid.OnlyBody(slot)) << slot;
    EXPECT_EQ(grid.changed_bodies().Count(), 0u);
    const auto& maps = grid.region_maps();
    EXPECT_TRUE(std::equal(maps.begin(), maps.end(),
                           words.begin() + layers.PlaceOf(wanted.front()).region_maps));
  }

  DeviceLayers layers;
  std::vector<uint64_t> words;
  int all = 0, changes = 0;

 private:
  void WriteAll(const grid::Grid& grid) {
    all++;
    layers.WriteAll(grid, words.data());
  }

  void WriteChanges(const grid::Grid& grid, const std::vector<LayerIndex>& wanted) {
    const std::size_t count = layers.CountChanges(grid, wanted);
    if (count > 0) changes++;
    std::vector<uint64_t> values(count);
    std::vector<uint32_t> places(count);
    layers.WriteChanges(grid, wanted, values.data(), places.data());
    for (std::size_t i = 0; i < count; i++) words[places[i]] = values[i];
  }
};

std::vector<LayerIndex> LayersOf(const RayBatch& batch) {
  std::set<LayerIndex> layers;
  for (const Fan& fan : batch.fans())
    if (fan.layer != grid::kNoLayer) layers.insert(fan.layer);
  return {layers.begin(), layers.end()};
}

TEST(DeviceLayers, ACopyFollowsTheGrid) {
  int all = 0, changes = 0;
  for (uint64_t seed = 0; seed < 10; seed++) {
    SCOPED_TRACE(seed);
    ray_scene::RayScene scene(seed);
    scene.grid().TrackChanges(true);
    Copy copy;
    for (int round = 0; round < 60 && !HasFailure(); round++) {
      const std::vector<LayerIndex> wanted = LayersOf(scene.batch());
      copy.Update(scene.grid(), wanted);
      copy.ExpectEqual(scene.grid(), wanted);
      scene.Change();
      scene.MakeBatch();
    }
    all += copy.all;
    changes += copy.changes;
  }
  EXPECT_GT(all, 10);
  EXPECT_GT(changes, 50);
}

}  // namespace
}  // namespace Stg::internal::sensing
