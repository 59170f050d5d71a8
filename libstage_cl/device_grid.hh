// SPDX-License-Identifier: GPL-2.0-or-later
//
// An OpenCL device's copy of the grid: the directory of regions, the wanted layers and, if wanted,
// the exact outlines. All layers are in one buffer, so that all changes are sent together.

#ifndef STAGE_CL_DEVICE_GRID_HH
#define STAGE_CL_DEVICE_GRID_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "grid/grid.hh"
#include "libstage_cl/buffer.hh"
#include "sensing/device_layers.hh"
#include "sensing/device_outlines.hh"
#include "threads/worker_pool.hh"

namespace Stg::cl {

class DeviceGrid {
 public:
  /// `update` is the kernel update_words.
  DeviceGrid(Memory* memory, const ::cl::Kernel& update, std::size_t work_group);

  /// Updates these layers, each given once. Returns the number of bytes sent.
  std::size_t Send(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);

  /// Updates the exact outlines. Returns the number of bytes sent.
  std::size_t SendOutlines(const grid::Grid& grid, threads::WorkerPool* workers);

  const ::cl::Buffer& directory() const { return directory_.memory(); }
  const ::cl::Buffer& regions() const { return regions_.memory(); }
  const ::cl::Buffer& words() const { return words_.memory(); }
  const sensing::DeviceLayers& layers() const { return layers_; }
  const ::cl::Buffer& outline_words() const { return outline_words_.memory(); }
  const sensing::DeviceOutlines& outlines() const { return outlines_; }

 private:
  std::size_t SendStructure(const grid::Grid& grid);
  std::size_t SendAll(const grid::Grid& grid);
  std::size_t SendChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted);
  template <typename Write>
  std::size_t SendWords(std::size_t count, Buffer* changes, const Buffer& words, Write write);

  Memory& memory_;
  ::cl::Kernel update_;
  std::size_t work_group_;
  Buffer directory_, regions_;  // directory of superregions, and their region tables
  uint64_t structure_version_ = 0;
  sensing::DeviceLayers layers_;
  Buffer words_;  // content of layers_
  Buffer changes_;
  sensing::DeviceOutlines outlines_;
  Buffer outline_words_, outline_changes_;
};

}  // namespace Stg::cl

#endif
