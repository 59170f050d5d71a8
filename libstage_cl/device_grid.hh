// SPDX-License-Identifier: GPL-2.0-or-later
//
// An OpenCL device's copy of the grid: the directory of regions, and the layers that somebody
// wants. All layers are in one buffer, so that what has changed in them goes there in one piece.

#ifndef STAGE_CL_DEVICE_GRID_HH
#define STAGE_CL_DEVICE_GRID_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "libstage_cl/buffer.hh"
#include "sensing/device_batch.hh"

namespace Stg::cl {

class DeviceGrid {
 public:
  /// `update`: the kernel update_words.
  DeviceGrid(Memory* memory, const ::cl::Kernel& update, std::size_t work_group);

  /// Brings these layers up to date, each named once. Returns how many bytes that took.
  std::size_t Send(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);

  const ::cl::Buffer& directory() const { return directory_.memory(); }
  const ::cl::Buffer& regions() const { return regions_.memory(); }
  const ::cl::Buffer& words() const { return words_.memory(); }
  /// Where a layer that was sent begins in words().
  using Place = sensing::DeviceBatch::LayerPlace;
  Place PlaceOf(grid::LayerIndex index) const;

 private:
  struct Layer {
    grid::LayerIndex index;
    std::size_t regions;  // that the device knows
    uint64_t made;        // which incarnation of the layer it knows; 0: none
  };
  void SendStructure(const grid::Grid& grid);
  void MakeRoom(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);
  std::size_t Find(grid::LayerIndex index) const;
  static bool NeedsAll(const grid::Occupancy& cells, const Layer& layer);
  void SendAll(const grid::Grid& grid);
  void SendChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);
  static void NoteSent(const grid::Occupancy& cells, Layer* layer);
  void Write(Buffer* target, const void* data, std::size_t bytes);

  Memory& memory_;
  ::cl::Kernel update_;
  std::size_t work_group_;
  Buffer directory_, regions_;  // of superregions; of regions in them
  uint64_t structure_version_ = 0;
  Buffer words_;          // for each layer, its tile maps and then its tiles
  std::size_t room_ = 0;  // regions that a layer has room for there
  Buffer changes_;
  std::vector<Layer> layers_;  // in the order of their places
  std::size_t bytes_sent_ = 0;
};

}  // namespace Stg::cl

#endif
