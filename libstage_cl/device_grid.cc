// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/device_grid.hh"

#include "messages/assert.hh"

namespace Stg::cl {

DeviceGrid::DeviceGrid(Memory* memory, const ::cl::Kernel& update, std::size_t work_group)
    : memory_(*memory),
      update_(update),
      work_group_(work_group),
      directory_(memory),
      regions_(memory),
      words_(memory),
      changes_(memory),
      outline_words_(memory),
      outline_changes_(memory) {}

std::size_t DeviceGrid::Send(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) {
  const std::size_t structure = SendStructure(grid);
  layers_.AllocateLayers(grid, wanted);
  if (words_.Reserve(layers_.words() * sizeof(uint64_t))) layers_.Invalidate();
  return structure +
         (layers_.NeedsFullCopy(grid, wanted) ? SendAll(grid) : SendChanges(grid, wanted));
}

std::size_t DeviceGrid::SendStructure(const grid::Grid& grid) {
  if (grid.structure_version() == structure_version_) return 0;
  structure_version_ = grid.structure_version();
  const auto send = [](Buffer* buffer, const auto& data) {
    const std::size_t bytes = data.size() * sizeof(data[0]);
    buffer->Write(data.data(), bytes);
    return bytes;
  };
  return send(&directory_, grid.directory()) + send(&regions_, grid.region_tables());
}

std::size_t DeviceGrid::SendAll(const grid::Grid& grid) {
  const std::size_t bytes = layers_.words() * sizeof(uint64_t);
  STAGE_ASSERT(structure_version_ == grid.structure_version());
  layers_.WriteAll(grid, static_cast<uint64_t*>(words_.MapForWriting(bytes)));
  words_.Unmap();
  return bytes;
}

std::size_t DeviceGrid::SendChanges(const grid::Grid& grid,
                                    const std::vector<grid::LayerIndex>& wanted) {
  return SendWords(layers_.CountChanges(grid, wanted), &changes_, words_,
                   [&](uint64_t* values, uint32_t* places) {
                     layers_.WriteChanges(grid, wanted, values, places);
                   });
}

std::size_t DeviceGrid::SendOutlines(const grid::Grid& grid, threads::WorkerPool* workers) {
  outlines_.Allocate(grid);
  const std::size_t bytes = outlines_.words() * sizeof(uint64_t);
  if (outline_words_.Reserve(bytes)) outlines_.Invalidate();
  if (outlines_.NeedsFullCopy(grid)) {
    outlines_.WriteAll(grid, static_cast<uint64_t*>(outline_words_.MapForWriting(bytes)), workers);
    outline_words_.Unmap();
    return bytes;
  }
  return SendWords(
      outlines_.FindChanges(grid, workers), &outline_changes_, outline_words_,
      [&](uint64_t* values, uint32_t* places) { outlines_.WriteChanges(values, places); });
}

/// Sends `count` changed words and their indices, which write() writes.
template <typename Write>
std::size_t DeviceGrid::SendWords(std::size_t count, Buffer* changes, const Buffer& words,
                                  Write write) {
  if (count == 0) return 0;
  const std::size_t bytes = count * (sizeof(uint64_t) + sizeof(uint32_t));
  auto* values = static_cast<uint64_t*>(changes->MapForWriting(bytes));
  write(values, reinterpret_cast<uint32_t*>(values + count));
  changes->Unmap();
  update_.setArg(0, words.memory());
  update_.setArg(1, changes->memory());
  update_.setArg(2, changes->memory());
  update_.setArg(3, static_cast<cl_uint>(count));
  const std::size_t items = (count + work_group_ - 1) / work_group_ * work_group_;
  memory_.queue.enqueueNDRangeKernel(update_, ::cl::NullRange, ::cl::NDRange(items),
                                     ::cl::NDRange(work_group_));
  return bytes;
}

}  // namespace Stg::cl
