// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/occupancy.hh"

#include <algorithm>
#include <atomic>
#include <bit>

namespace Stg::internal::grid {

Occupancy::Occupancy() {
  static std::atomic<uint64_t> count{0};
  made_ = ++count;
}

Occupancy::Occupancy(const Occupancy& from) : Occupancy() {
  tile_maps_ = from.tile_maps_;
  tiles_ = from.tiles_;
  changed_tiles_.resize(from.changed_tiles_.size(), 0);
}

void Occupancy::Resize(uint32_t count) {
  tile_maps_.resize(count, 0);
  tiles_.resize(std::size_t{count} * kTilesPerRegion);
  changed_tiles_.resize(count, 0);
}

namespace {

// A region's word is shared by its tiles, which different threads may change.
void SetBit(uint64_t* word, uint32_t bit) {
  std::atomic_ref<uint64_t>(*word).fetch_or(uint64_t{1} << bit, std::memory_order_relaxed);
}
void ClearBit(uint64_t* word, uint32_t bit) {
  std::atomic_ref<uint64_t>(*word).fetch_and(~(uint64_t{1} << bit), std::memory_order_relaxed);
}
bool HasBit(uint64_t* word, uint32_t bit) {
  return std::atomic_ref<uint64_t>(*word).load(std::memory_order_relaxed) >> bit & 1;
}

}  // namespace

void Occupancy::NoteChange(uint32_t tile) {
  if (!tracking_) return;
  uint64_t* const changed = &changed_tiles_[tile / kTilesPerRegion];
  if (!HasBit(changed, tile % kTilesPerRegion)) SetBit(changed, tile % kTilesPerRegion);
}

void Occupancy::Set(uint32_t tile, uint64_t cells) {
  uint64_t& word = tiles_[tile];
  if ((word & cells) == cells) return;
  if (word == 0) SetBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion);
  word |= cells;
  NoteChange(tile);
}

void Occupancy::Clear(uint32_t tile, uint64_t cells) {
  uint64_t& word = tiles_[tile];
  if (!(word & cells)) return;
  word &= ~cells;
  if (word == 0) ClearBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion);
  NoteChange(tile);
}

void Occupancy::TrackChanges(bool on) {
  tracking_ = on;
  ForgetChanges();
}

std::size_t Occupancy::CountChangedTiles() const {
  std::size_t count = 0;
  for (const uint64_t tiles : changed_tiles_)
    count += static_cast<std::size_t>(std::popcount(tiles));
  return count;
}

void Occupancy::ForgetChanges() const {
  std::fill(changed_tiles_.begin(), changed_tiles_.end(), 0);
}

}  // namespace Stg::internal::grid
