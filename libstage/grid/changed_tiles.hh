// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which tiles have changed since somebody last looked, for those who keep a copy of them.

#ifndef STAGE_GRID_CHANGED_TILES_HH
#define STAGE_GRID_CHANGED_TILES_HH

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace Stg::internal::grid {

class ChangedTiles {
 public:
  /// Another copy is to be kept of the same tiles: nothing has changed in them yet.
  ChangedTiles(const ChangedTiles& from) : regions_(from.regions_.size(), 0) {}
  ChangedTiles() = default;
  ChangedTiles(ChangedTiles&&) = default;
  ChangedTiles& operator=(ChangedTiles&&) = default;

  /// While on, tiles that change are remembered until they are forgotten.
  void Track(bool on) {
    tracking_ = on;
    Forget();
  }
  void Resize(std::size_t regions) { regions_.resize(regions, 0); }
  void Forget() { std::fill(regions_.begin(), regions_.end(), 0); }

  /// By slot: region * 64 + tile. Different threads may note tiles of a region at once.
  void Note(uint32_t slot) {
    if (!tracking_) return;
    const std::atomic_ref<uint64_t> region(regions_[slot / 64]);
    const uint64_t tile = uint64_t{1} << slot % 64;
    if (!(region.load(std::memory_order_relaxed) & tile))
      region.fetch_or(tile, std::memory_order_relaxed);
  }

  /// One word for each region: its changed tiles.
  const std::vector<uint64_t>& regions() const { return regions_; }
  /// How many tiles that are.
  std::size_t Count() const {
    std::size_t count = 0;
    for (const uint64_t tiles : regions_) count += static_cast<std::size_t>(std::popcount(tiles));
    return count;
  }

 private:
  std::vector<uint64_t> regions_;
  bool tracking_ = false;
};

}  // namespace Stg::internal::grid

#endif
