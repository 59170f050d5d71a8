// SPDX-License-Identifier: GPL-2.0-or-later
//
// Occupied cells as a bitmap, in the layout that the ray walk of kernels/ray_walk.h reads. The grid
// keeps several such layers over the same regions: for all bodies, and for those that rangers see.

#ifndef STAGE_GRID_OCCUPANCY_HH
#define STAGE_GRID_OCCUPANCY_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/changed_tiles.hh"
#include "grid/paged_array.hh"

namespace Stg::internal::grid {

inline constexpr uint32_t kTilesPerRegion = 64, kRegionsPerSuper = 256, kMapsPerSuper = 4;

class Occupancy {
 public:
  Occupancy();
  /// Copies the cells into a layer with a new id.
  Occupancy(const Occupancy& from);
  Occupancy(Occupancy&&) = default;
  Occupancy& operator=(Occupancy&&) = default;
  /// Freezes this layer. Later copies share its memory pages until they write to them.
  void Freeze() { tiles_.Freeze(tiles_.size()); }

  /// Unique id of this layer, by which a cache notices that a layer was replaced.
  uint64_t id() const { return id_; }

  /// One word per region: mask of its tiles that have occupied cells.
  const std::vector<uint64_t>& tile_maps() const { return tile_maps_; }
  /// 64 words per region: mask of the occupied cells in each tile.
  std::span<const uint64_t> tiles() const { return {tiles_.data(), tiles_.size()}; }

  /// Memory use in bytes.
  std::size_t bytes() const {
    return tile_maps_.capacity() * sizeof(uint64_t) + tiles_.capacity() * sizeof(uint64_t);
  }
  /// Resizes the arrays for regions 0 .. count - 1.
  void Resize(uint32_t count);

  // Set or clear bits of tiles()[tile]. Threads may change different tiles concurrently.
  void Set(uint32_t tile, uint64_t cells);
  void Clear(uint32_t tile, uint64_t cells);

  void TrackChanges(bool on) { changed_.Track(on); }
  const ChangedTiles& changed() const { return changed_; }
  /// Const, because the cells do not change.
  void ForgetChanges() const { changed_.Forget(); }

 private:
  std::vector<uint64_t> tile_maps_;
  PagedArray<uint64_t> tiles_;
  uint64_t id_;
  mutable ChangedTiles changed_;
};

}  // namespace Stg::internal::grid

#endif
