// SPDX-License-Identifier: GPL-2.0-or-later
//
// The set of tiles that changed since the last Forget(), for code that keeps a copy of the tiles.

#ifndef STAGE_GRID_CHANGED_TILES_HH
#define STAGE_GRID_CHANGED_TILES_HH

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "messages/assert.hh"

namespace Stg::internal::grid {

class ChangedTiles {
 public:
  /// A copy starts with no changed tiles: it tracks changes for another consumer.
  ChangedTiles(const ChangedTiles& from) { Resize(from.regions_.size()); }
  ChangedTiles() = default;
  ChangedTiles(ChangedTiles&&) = default;
  ChangedTiles& operator=(ChangedTiles&&) = default;

  /// Starts or stops recording, and clears the set.
  void Track(bool on) {
    tracking_ = on;
    Forget();
  }
  void Resize(std::size_t regions) {
    marked_.resize((regions + 63) / 64, 0);
    regions_.resize(regions, 0);
  }
  void Forget() {
    ForEachRegion([this](std::size_t region, uint64_t) { regions_[region] = 0; });
    std::fill(marked_.begin(), marked_.end(), 0);
  }

  /// Adds a tile, with slot = region * 64 + tile. Several threads may call it for the same region.
  void Note(uint32_t slot) {
    if (!tracking_) return;
    const uint32_t region = slot / 64;
    STAGE_ASSERT(region < regions_.size());
    if (Set(&regions_[region], slot % 64) == 0) Set(&marked_[region / 64], region % 64);
  }

  /// Calls f(region, 64-bit mask of changed tiles) for each region with changed tiles.
  template <typename F>
  void ForEachRegion(F f) const {
    for (std::size_t i = 0; i < marked_.size(); i++)
      for (uint64_t left = marked_[i]; left != 0; left &= left - 1) {
        const std::size_t region = i * 64 + static_cast<std::size_t>(std::countr_zero(left));
        f(region, regions_[region]);
      }
  }
  /// Number of changed tiles.
  std::size_t Count() const {
    std::size_t count = 0;
    ForEachRegion([&](std::size_t, uint64_t tiles) {
      count += static_cast<std::size_t>(std::popcount(tiles));
    });
    return count;
  }

 private:
  /// Sets the bit and returns the previous word.
  static uint64_t Set(uint64_t* word, uint32_t bit) {
    const std::atomic_ref<uint64_t> shared(*word);
    const uint64_t seen = shared.load(std::memory_order_relaxed), mark = uint64_t{1} << bit;
    return seen & mark ? seen : shared.fetch_or(mark, std::memory_order_relaxed);
  }

  std::vector<uint64_t> regions_;  // per region: mask of changed tiles
  std::vector<uint64_t> marked_;   // one bit per region whose mask is not 0, because only about a
                                   // thousand of a million regions change in a step
  bool tracking_ = false;
};

}  // namespace Stg::internal::grid

#endif
