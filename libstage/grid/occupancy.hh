// SPDX-License-Identifier: GPL-2.0-or-later
//
// Which cells are occupied: one bit for each cell, in exactly the layout that the ray walk
// of kernels/ray_walk.h reads. The grid keeps several such layers of the same regions: of
// everything, and of what rangers can see.

#ifndef STAGE_GRID_OCCUPANCY_HH
#define STAGE_GRID_OCCUPANCY_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/changed_tiles.hh"
#include "grid/paged_array.hh"

namespace Stg::internal::grid {

inline constexpr uint32_t kTilesPerRegion = 64, kMapsPerSuper = 4;

class Occupancy {
 public:
  Occupancy();
  /// Another layer, with the same cells.
  Occupancy(const Occupancy& from);
  Occupancy(Occupancy&&) = default;
  Occupancy& operator=(Occupancy&&) = default;
  /// From now on copies share its pages, and it is not changed any more.
  void MakeShareable() { tiles_.MakeShareable(tiles_.size()); }

  /// A number that is different for each layer ever made: tells whether one has been replaced.
  uint64_t made() const { return made_; }

  /// One word for each region: which of its tiles have occupied cells.
  const std::vector<uint64_t>& tile_maps() const { return tile_maps_; }
  /// 64 words for each region: which cells of each tile are occupied.
  std::span<const uint64_t> tiles() const { return {tiles_.data(), tiles_.size()}; }

  /// Of memory.
  std::size_t bytes() const {
    return tile_maps_.capacity() * sizeof(uint64_t) + tiles_.capacity() * sizeof(uint64_t);
  }
  /// Makes room for regions 0 .. count - 1.
  void Resize(uint32_t count);

  // Sets and clears bits of a tile, by its place in tiles(). Different threads may change different
  // tiles at once.
  void Set(uint32_t tile, uint64_t cells);
  void Clear(uint32_t tile, uint64_t cells);

  void TrackChanges(bool on) { changed_.Track(on); }
  const ChangedTiles& changed() const { return changed_; }
  /// Const, as which cells are occupied does not change.
  void ForgetChanges() const { changed_.Forget(); }

 private:
  std::vector<uint64_t> tile_maps_;
  PagedArray<uint64_t> tiles_;
  uint64_t made_;
  mutable ChangedTiles changed_;
};

}  // namespace Stg::internal::grid

#endif
