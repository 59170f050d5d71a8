// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/occupancy.hh"

#include <atomic>

namespace Stg::internal::grid {

Occupancy::Occupancy() {
  static std::atomic<uint64_t> count{0};
  made_ = ++count;
}

void Occupancy::Resize(uint32_t count) {
  tile_maps_.resize(count, 0);
  tiles_.resize(std::size_t{count} * kTilesPerRegion, 0);
  changed_tiles_.resize(count, 0);
}

void Occupancy::NoteChange(uint32_t region, uint32_t tile) {
  if (!tracking_) return;
  if (changed_tiles_[region] == 0) changed_regions_.push_back(region);
  changed_tiles_[region] |= uint64_t{1} << tile;
}

void Occupancy::Set(uint32_t region, uint32_t tile, uint32_t bit) {
  uint64_t& word = tiles_[std::size_t{region} * kTilesPerRegion + tile];
  const uint64_t mask = uint64_t{1} << bit;
  if (word & mask) return;
  word |= mask;
  tile_maps_[region] |= uint64_t{1} << tile;
  NoteChange(region, tile);
}

void Occupancy::Clear(uint32_t region, uint32_t tile, uint32_t bit) {
  uint64_t& word = tiles_[std::size_t{region} * kTilesPerRegion + tile];
  const uint64_t mask = uint64_t{1} << bit;
  if (!(word & mask)) return;
  word &= ~mask;
  if (word == 0) tile_maps_[region] &= ~(uint64_t{1} << tile);
  NoteChange(region, tile);
}

void Occupancy::TrackChanges(bool on) {
  tracking_ = on;
  ForgetChanges();
}

void Occupancy::ForgetChanges() const {
  for (const uint32_t region : changed_regions_) changed_tiles_[region] = 0;
  changed_regions_.clear();
}

}  // namespace Stg::internal::grid
