// SPDX-License-Identifier: GPL-2.0-or-later

#include "libstage_cl/device_grid.hh"

#include <algorithm>
#include <bit>

namespace Stg::cl {

namespace {

// Words of a region: its tile map and its tiles.
constexpr std::size_t kWords = 1 + grid::kTilesPerRegion;

/// Calls f(region, tiles) for regions with changed tiles; those from `known` on are new.
template <typename F>
void ForEachChangedRegion(const grid::Occupancy& cells, std::size_t known, F f) {
  const std::vector<uint64_t>& changed = cells.changed_tiles();
  for (std::size_t region = 0; region < changed.size(); region++) {
    const uint64_t tiles = region < known ? changed[region] : ~uint64_t{0};
    if (tiles != 0) f(region, tiles);
  }
}

std::size_t CountChanges(const grid::Occupancy& cells, std::size_t known) {
  std::size_t words = 0;
  ForEachChangedRegion(cells, known, [&](std::size_t, uint64_t tiles) {
    words += 1 + static_cast<std::size_t>(std::popcount(tiles));
  });
  return words;
}

}  // namespace

DeviceGrid::DeviceGrid(Memory* memory, const ::cl::Kernel& update, std::size_t work_group)
    : memory_(*memory),
      update_(update),
      work_group_(work_group),
      directory_(memory),
      regions_(memory),
      words_(memory),
      changes_(memory) {}

std::size_t DeviceGrid::Send(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) {
  bytes_sent_ = 0;
  SendStructure(grid);
  MakeRoom(grid, wanted);
  if (std::any_of(wanted.begin(), wanted.end(), [&](grid::LayerIndex index) {
        return NeedsAll(grid.occupancy(index), layers_[Find(index)]);
      }))
    SendAll(grid);
  else
    SendChanges(grid, wanted);
  return bytes_sent_;
}

void DeviceGrid::SendStructure(const grid::Grid& grid) {
  if (grid.structure_version() == structure_version_) return;
  structure_version_ = grid.structure_version();
  const auto send = [this](Buffer* buffer, const auto& data) {
    Write(buffer, data.data(), data.size() * sizeof(data[0]));
  };
  send(&directory_, grid.directory());
  send(&regions_, grid.region_tables());
}

void DeviceGrid::Write(Buffer* target, const void* data, std::size_t bytes) {
  target->Write(data, bytes);
  bytes_sent_ += bytes;
}

/// For the layers that are wanted; what was in there is lost if there wasn't enough.
void DeviceGrid::MakeRoom(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) {
  for (const grid::LayerIndex index : wanted)
    if (Find(index) == layers_.size()) layers_.push_back({index, 0, 0});
  bool lost = grid.region_count() > room_;
  if (lost) room_ = grid.region_count() + grid.region_count() / 4;
  lost |= words_.Reserve(layers_.size() * room_ * kWords * sizeof(uint64_t));
  if (lost)
    for (Layer& layer : layers_) layer.made = 0;
}

/// The number of its place; that of the next one if it has none.
std::size_t DeviceGrid::Find(grid::LayerIndex index) const {
  const auto found = std::find_if(layers_.begin(), layers_.end(),
                                  [&](const Layer& layer) { return layer.index == index; });
  return static_cast<std::size_t>(found - layers_.begin());
}

DeviceGrid::Place DeviceGrid::PlaceOf(grid::LayerIndex index) const {
  const std::size_t first = Find(index) * room_ * kWords;
  return {static_cast<uint32_t>(first), static_cast<uint32_t>(first + room_)};
}

/// If it is new or if much of it has changed.
bool DeviceGrid::NeedsAll(const grid::Occupancy& cells, const Layer& layer) {
  return layer.made != cells.made() ||
         CountChanges(cells, layer.regions) * 4 > cells.tiles().size();
}

/// All layers that have a place, wanted now or not.
void DeviceGrid::SendAll(const grid::Grid& grid) {
  const std::size_t bytes = layers_.size() * room_ * kWords * sizeof(uint64_t);
  auto* words = static_cast<uint64_t*>(words_.MapForWriting(bytes));
  const auto put = [&](const std::vector<uint64_t>& from, std::size_t room) {
    std::fill(std::copy(from.begin(), from.end(), words), words + room, 0);
    words += room;
  };
  for (Layer& layer : layers_) {
    const grid::Occupancy& cells = grid.occupancy(layer.index);
    put(cells.tile_maps(), room_);
    put(cells.tiles(), room_ * grid::kTilesPerRegion);
    NoteSent(cells, &layer);
  }
  words_.Unmap();
  bytes_sent_ += bytes;
}

void DeviceGrid::NoteSent(const grid::Occupancy& cells, Layer* layer) {
  layer->regions = cells.tile_maps().size();
  layer->made = cells.made();
  cells.ForgetChanges();
}

/// The words that have changed, and where they belong.
void DeviceGrid::SendChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted) {
  std::size_t count = 0;
  for (const grid::LayerIndex index : wanted)
    count += CountChanges(grid.occupancy(index), layers_[Find(index)].regions);
  if (count == 0) return;
  const std::size_t bytes = count * (sizeof(uint64_t) + sizeof(uint32_t));
  auto* values = static_cast<uint64_t*>(changes_.MapForWriting(bytes));
  auto* places = reinterpret_cast<uint32_t*>(values + count);
  for (const grid::LayerIndex index : wanted) {
    const grid::Occupancy& cells = grid.occupancy(index);
    const Place first = PlaceOf(index);
    Layer& layer = layers_[Find(index)];
    ForEachChangedRegion(cells, layer.regions, [&](std::size_t region, uint64_t tiles) {
      *places++ = first.tile_maps + static_cast<uint32_t>(region);
      *values++ = cells.tile_maps()[region];
      const std::size_t tile = region * grid::kTilesPerRegion;
      grid::ForEachBit(tiles, [&](uint32_t bit) {
        *places++ = first.tiles + static_cast<uint32_t>(tile) + bit;
        *values++ = cells.tiles()[tile + bit];
      });
    });
    NoteSent(cells, &layer);
  }
  changes_.Unmap();
  bytes_sent_ += bytes;
  update_.setArg(0, words_.memory());
  update_.setArg(1, changes_.memory());
  update_.setArg(2, changes_.memory());
  update_.setArg(3, static_cast<cl_uint>(count));
  const std::size_t items = (count + work_group_ - 1) / work_group_ * work_group_;
  memory_.queue.enqueueNDRangeKernel(update_, ::cl::NullRange, ::cl::NDRange(items),
                                     ::cl::NDRange(work_group_));
}

}  // namespace Stg::cl
