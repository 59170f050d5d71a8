// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a device's copy of the grid lacks, whatever the device. It is one piece of memory of 64-bit
// words: Grid::OnlyBody() of all tiles, two in a word, the one with the even slot in its lower
// half; the region maps; then for each layer room for its tile maps and room for its tiles.

#ifndef STAGE_SENSING_DEVICE_LAYERS_HH
#define STAGE_SENSING_DEVICE_LAYERS_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "sensing/device_batch.hh"

namespace Stg::internal::sensing {

class DeviceLayers {
 public:
  /// Finds room for these layers, each named once: they are the wanted ones below. First of all.
  void MakeRoom(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);
  /// That the memory has to have.
  std::size_t words() const;
  /// The memory was made anew: nothing is in it.
  void Lose();

  /// Where a layer that has room begins.
  DeviceBatch::LayerPlace PlaceOf(grid::LayerIndex index) const;

  /// Whether a wanted layer is new, or much of it has changed: then all words are sent, otherwise
  /// the changed ones.
  bool LacksAll(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) const;
  /// words() of them. Uses up the lists of changes of the bodies and of all layers that have room.
  void WriteAll(const grid::Grid& grid, uint64_t* words);
  std::size_t CountChanges(const grid::Grid& grid,
                           const std::vector<grid::LayerIndex>& wanted) const;
  /// So many words, and the place of each. Uses up the lists of changes of the bodies and of the
  /// wanted layers.
  void WriteChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted,
                    uint64_t* values, uint32_t* places);

 private:
  struct Layer {
    grid::LayerIndex index;
    std::size_t regions;  // that the device knows
    uint64_t made;        // which incarnation of the layer it knows; 0: none
  };
  std::size_t Find(grid::LayerIndex index) const;
  std::size_t FirstWord(std::size_t layer) const;
  static void NoteSent(const grid::Occupancy& cells, Layer* layer);

  std::size_t FirstRegionMap() const;
  template <typename F>
  void ForEachChangedMap(const grid::Grid& grid, F f) const;

  std::size_t room_ = 0;            // regions that a layer has room for
  std::size_t map_room_ = 0;        // region maps that there is room for
  std::vector<Layer> layers_;       // in the order of their places
  uint64_t structure_version_ = 0;  // of the region maps that the device knows
};

}  // namespace Stg::internal::sensing

#endif
