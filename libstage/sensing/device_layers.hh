// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tracks what a device's copy of the grid lacks, for any device. The copy is one buffer of 64-bit
// words: Grid::OnlyBody() of all tiles, two per word with the even slot in the lower half; the
// region maps; then per layer its tile maps and its tiles, each with spare capacity.

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
  /// Allocates offsets for the wanted layers, each given once. Call it first.
  void AllocateLayers(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);
  /// Required size of the buffer in words.
  std::size_t words() const;
  /// Call when the buffer was reallocated: its content is lost.
  void Invalidate();

  /// Offsets of a layer that AllocateLayers() has seen.
  DeviceBatch::LayerPlace PlaceOf(grid::LayerIndex index) const;

  /// True if a wanted layer is new or has many changes: then send all words, else only changes.
  bool NeedsFullCopy(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) const;
  /// Writes all words(). Resets the changes of bodies and of all known layers.
  void WriteAll(const grid::Grid& grid, uint64_t* words);
  std::size_t CountChanges(const grid::Grid& grid,
                           const std::vector<grid::LayerIndex>& wanted) const;
  /// Writes CountChanges() values and offsets. Resets the changes of bodies and wanted layers.
  void WriteChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted,
                    uint64_t* values, uint32_t* places);

 private:
  struct Layer {
    grid::LayerIndex index;
    std::size_t regions;  // regions that the device has
    uint64_t id;          // Occupancy::id() of the device's copy; 0: none
  };
  std::size_t Find(grid::LayerIndex index) const;
  std::size_t FirstWord(std::size_t layer) const;
  static void MarkSent(const grid::Occupancy& cells, Layer* layer);

  std::size_t FirstRegionMap() const;
  template <typename F>
  void ForEachChangedMap(const grid::Grid& grid, F f) const;

  std::size_t capacity_ = 0;        // capacity of each layer in regions
  std::size_t map_capacity_ = 0;    // capacity in region maps
  std::vector<Layer> layers_;       // in the order of their offsets
  uint64_t structure_version_ = 0;  // of the region maps that the device has
};

}  // namespace Stg::internal::sensing

#endif
