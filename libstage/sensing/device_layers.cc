// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/device_layers.hh"

#include <algorithm>
#include <bit>
#include <span>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

// Words per region: tile map and tiles of a layer; bodies of its tiles.
constexpr std::size_t kWordsPerRegion = 1 + grid::kTilesPerRegion;
constexpr std::size_t kBodyWordsPerRegion = grid::kTilesPerRegion / 2;

/// The OnlyBody() words of the tiles 2 * word and 2 * word + 1.
uint64_t BodiesOf(const grid::Grid& grid, std::size_t word) {
  const auto slot = static_cast<uint32_t>(2 * word);
  return grid.OnlyBody(slot) | uint64_t{grid.OnlyBody(slot + 1)} << 32;
}

/// Calls f(word) for each word of bodies that has changed.
template <typename F>
void ForEachChangedPair(const grid::Grid& grid, F f) {
  constexpr uint64_t kEvenTiles = 0x5555555555555555u;
  grid.changed_bodies().ForEachRegion([&](std::size_t region, uint64_t tiles) {
    grid::ForEachBit((tiles | tiles >> 1) & kEvenTiles,
                     [&](uint32_t tile) { f(region * kBodyWordsPerRegion + tile / 2); });
  });
}

/// Calls f(region, tiles) for each region with changed tiles. Regions from `known` on are new.
template <typename F>
void ForEachChangedRegion(const grid::Occupancy& cells, std::size_t known, F f) {
  cells.changed().ForEachRegion([&](std::size_t region, uint64_t tiles) {
    if (region < known) f(region, tiles);
  });
  for (std::size_t region = known; region < cells.tile_maps().size(); region++)
    f(region, ~uint64_t{0});
}

std::size_t CountChangesOf(const grid::Occupancy& cells, std::size_t known) {
  std::size_t words = 0;
  ForEachChangedRegion(cells, known, [&](std::size_t, uint64_t tiles) {
    words += 1 + static_cast<std::size_t>(std::popcount(tiles));
  });
  return words;
}

}  // namespace

void DeviceLayers::AllocateLayers(const grid::Grid& grid,
                                  const std::vector<grid::LayerIndex>& wanted) {
  for (const grid::LayerIndex index : wanted)
    if (Find(index) == layers_.size()) layers_.push_back({index, 0, 0});
  if (grid.region_count() <= capacity_ && grid.region_maps().size() <= map_capacity_) return;
  // A multiple of eight, so that each layer, and each row of eight tiles of a region, is aligned to
  // a cache line of the device.
  const auto capacity_for = [](std::size_t count) { return (count + count / 4 + 7) / 8 * 8; };
  capacity_ = capacity_for(grid.region_count());
  map_capacity_ = capacity_for(grid.region_maps().size());
  Invalidate();  // all offsets change
}

std::size_t DeviceLayers::words() const { return FirstWord(layers_.size()); }

std::size_t DeviceLayers::FirstRegionMap() const { return capacity_ * kBodyWordsPerRegion; }

std::size_t DeviceLayers::FirstWord(std::size_t layer) const {
  return FirstRegionMap() + map_capacity_ + layer * capacity_ * kWordsPerRegion;
}

void DeviceLayers::Invalidate() {
  for (Layer& layer : layers_) layer.id = 0;
}

/// Index of the layer, or of the next new one if it is unknown.
std::size_t DeviceLayers::Find(grid::LayerIndex index) const {
  const auto found = std::find_if(layers_.begin(), layers_.end(),
                                  [&](const Layer& layer) { return layer.index == index; });
  return static_cast<std::size_t>(found - layers_.begin());
}

DeviceBatch::LayerPlace DeviceLayers::PlaceOf(grid::LayerIndex index) const {
  STAGE_ASSERT(Find(index) < layers_.size());
  const auto number = [](std::size_t place) { return static_cast<uint32_t>(place); };
  const std::size_t first = FirstWord(Find(index));
  return {number(FirstRegionMap()), number(first), number(first + capacity_)};
}

bool DeviceLayers::NeedsFullCopy(const grid::Grid& grid,
                                 const std::vector<grid::LayerIndex>& wanted) const {
  return std::any_of(wanted.begin(), wanted.end(), [&](grid::LayerIndex index) {
    STAGE_ASSERT(Find(index) < layers_.size());  // after AllocateLayers()
    const grid::Occupancy& cells = grid.occupancy(index);
    const Layer& layer = layers_[Find(index)];
    return layer.id != cells.id() ||
           CountChangesOf(cells, layer.regions) * 4 > cells.tiles().size();
  });
}

void DeviceLayers::WriteAll(const grid::Grid& grid, uint64_t* words) {
  STAGE_ASSERT(grid.region_count() <= capacity_ && grid.region_maps().size() <= map_capacity_);
  const std::size_t known = grid.region_count() * kBodyWordsPerRegion;
  for (std::size_t i = 0; i < known; i++) words[i] = BodiesOf(grid, i);
  std::fill(words + known, words + FirstRegionMap(), 0);
  words += FirstRegionMap();
  grid.ForgetChangedBodies();
  const auto put = [&](std::span<const uint64_t> from, std::size_t capacity) {
    STAGE_ASSERT(from.size() <= capacity);
    std::fill(std::copy(from.begin(), from.end(), words), words + capacity, 0);
    words += capacity;
  };
  put(grid.region_maps(), map_capacity_);
  structure_version_ = grid.structure_version();
  for (Layer& layer : layers_) {
    const grid::Occupancy& cells = grid.occupancy(layer.index);
    put(cells.tile_maps(), capacity_);
    put(cells.tiles(), capacity_ * grid::kTilesPerRegion);
    MarkSent(cells, &layer);
  }
}

void DeviceLayers::MarkSent(const grid::Occupancy& cells, Layer* layer) {
  STAGE_ASSERT(layer->regions <= cells.tile_maps().size() || layer->id != cells.id());
  layer->regions = cells.tile_maps().size();
  layer->id = cells.id();
  cells.ForgetChanges();
}

/// Calls f(map) for the region maps that may have changed. If a region gets its first body or loses
/// its last one, its OnlyBody() changes too. If regions came or went, all maps may have changed.
template <typename F>
void DeviceLayers::ForEachChangedMap(const grid::Grid& grid, F f) const {
  if (grid.structure_version() == structure_version_)
    grid.changed_bodies().ForEachRegion(
        [&](std::size_t region, uint64_t) { f(grid.RegionMapOf(region)); });
  else
    for (std::size_t map = 0; map < grid.region_maps().size(); map++) f(map);
}

std::size_t DeviceLayers::CountChanges(const grid::Grid& grid,
                                       const std::vector<grid::LayerIndex>& wanted) const {
  std::size_t count = 0;
  const auto add_one = [&](std::size_t) { count++; };
  ForEachChangedMap(grid, add_one);
  ForEachChangedPair(grid, add_one);
  for (const grid::LayerIndex index : wanted)
    count += CountChangesOf(grid.occupancy(index), layers_[Find(index)].regions);
  return count;
}

void DeviceLayers::WriteChanges(const grid::Grid& grid, const std::vector<grid::LayerIndex>& wanted,
                                uint64_t* values, uint32_t* places) {
  const auto put = [&](std::size_t place, uint64_t value) {
    STAGE_ASSERT(place < this->words());
    *places++ = static_cast<uint32_t>(place);
    *values++ = value;
  };
  ForEachChangedMap(grid,
                    [&](std::size_t map) { put(FirstRegionMap() + map, grid.region_maps()[map]); });
  structure_version_ = grid.structure_version();
  ForEachChangedPair(grid, [&](std::size_t word) { put(word, BodiesOf(grid, word)); });
  grid.ForgetChangedBodies();
  for (const grid::LayerIndex index : wanted) {
    const grid::Occupancy& cells = grid.occupancy(index);
    const DeviceBatch::LayerPlace first = PlaceOf(index);
    Layer& layer = layers_[Find(index)];
    ForEachChangedRegion(cells, layer.regions, [&](std::size_t region, uint64_t tiles) {
      put(first.tile_maps + region, cells.tile_maps()[region]);
      const std::size_t tile = region * grid::kTilesPerRegion;
      grid::ForEachBit(
          tiles, [&](uint32_t bit) { put(first.tiles + tile + bit, cells.tiles()[tile + bit]); });
    });
    MarkSent(cells, &layer);
  }
}

}  // namespace Stg::internal::sensing
