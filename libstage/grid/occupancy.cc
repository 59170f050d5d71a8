// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/occupancy.hh"

#include <algorithm>
#include <atomic>
#include <bit>

#include "messages/assert.hh"

namespace Stg::internal::grid {

Occupancy::Occupancy() {
  static std::atomic<uint64_t> count{0};
  id_ = ++count;
}

Occupancy::Occupancy(const Occupancy& from) : Occupancy() {
  tile_maps_ = from.tile_maps_;
  tiles_ = from.tiles_;
  changed_.Resize(tile_maps_.size());
}

void Occupancy::Resize(uint32_t count) {
  STAGE_ASSERT(count >= tile_maps_.size());  // regions are reused but never removed
  tile_maps_.resize(count, 0);
  tiles_.resize(std::size_t{count} * kTilesPerRegion);
  changed_.Resize(count);
}

namespace {

// Atomic, because different threads may change tiles that share the region's word.
void SetBit(uint64_t* word, uint32_t bit) {
  std::atomic_ref<uint64_t>(*word).fetch_or(uint64_t{1} << bit, std::memory_order_relaxed);
}
[[maybe_unused]] bool HasBit(uint64_t* word, uint32_t bit) {
  return std::atomic_ref<uint64_t>(*word).load(std::memory_order_relaxed) >> bit & 1;
}
void ClearBit(uint64_t* word, uint32_t bit) {
  std::atomic_ref<uint64_t>(*word).fetch_and(~(uint64_t{1} << bit), std::memory_order_relaxed);
}

}  // namespace

void Occupancy::Set(uint32_t tile, uint64_t cells) {
  STAGE_ASSERT(tile < tiles_.size());
  uint64_t& word = tiles_[tile];
  STAGE_ASSERT(HasBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion) == (word != 0));
  if ((word & cells) == cells) return;
  if (word == 0) SetBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion);
  word |= cells;
  changed_.Note(tile);
}

void Occupancy::Clear(uint32_t tile, uint64_t cells) {
  STAGE_ASSERT(tile < tiles_.size());
  uint64_t& word = tiles_[tile];
  STAGE_ASSERT(HasBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion) == (word != 0));
  if (!(word & cells)) return;
  word &= ~cells;
  if (word == 0) ClearBit(&tile_maps_[tile / kTilesPerRegion], tile % kTilesPerRegion);
  changed_.Note(tile);
}

}  // namespace Stg::internal::grid
