// SPDX-License-Identifier: GPL-2.0-or-later
//
// The rasterization of a body as bit masks per tile, so that all cells of a tile are handled at
// once.

#ifndef STAGE_GRID_CELL_SET_HH
#define STAGE_GRID_CELL_SET_HH

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "kernels/ray_walk.h"

namespace Stg::internal::grid {

/// A set of cells in one tile of 8 x 8 cells.
struct CellSet {
  int32_t x = 0, y = 0;  ///< coordinates of the tile, in tiles
  uint32_t slot = 0;     ///< index in the grid: region * 64 + tile; 0: the region does not exist
  uint32_t edges = 0;    ///< exact rasterization: bit i: edge i of the body is near the tile
  uint64_t cells = 0;    ///< mask of cells, see BitOf()

  /// Bit of a cell in its tile.
  static uint32_t BitOf(int32_t x, int32_t y) { return static_cast<uint32_t>(ray_place(x, y, 3)); }
  bool SameTile(const CellSet& o) const { return x == o.x && y == o.y; }
  /// Sort order of cell sets: by row, then by column.
  bool ComesBefore(const CellSet& o) const { return y == o.y ? x < o.x : y < o.y; }
};

/// Calls f(index) for each set bit.
template <typename F>
void ForEachBit(uint64_t bits, F f) {
  for (; bits != 0; bits &= bits - 1) f(static_cast<uint32_t>(std::countr_zero(bits)));
}

std::size_t CountCells(std::span<const CellSet> sets);

/// True if the cell sets are sorted and name each tile once.
bool AreSorted(std::span<const CellSet> sets);

/// Appends cells to a list as cell sets, sorted by tile with each tile once. Earlier elements of
/// the list are left alone.
class CellSetBuilder {
 public:
  explicit CellSetBuilder(std::vector<CellSet>* sets) : sets_(*sets), first_(sets->size()) {}
  /// Adds a cell, in any order and repeatedly. Consecutive cells of one tile are fastest.
  void Add(int32_t x, int32_t y) {
    GoTo(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT);
    last_.cells |= uint64_t{1} << CellSet::BitOf(x, y);
  }
  /// Adds the cells `first`..`last` of a row. `edges` is the mask of edges near them.
  void AddRow(int32_t y, int32_t first, int32_t last, uint32_t edges) {
    constexpr int32_t kLast = (1 << RAY_TILE_SHIFT) - 1;
    for (int32_t x = first; x <= last; x = (x | kLast) + 1) {
      GoTo(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT);
      const int32_t more = std::min(last, x | kLast) - x;
      last_.cells |= ((uint64_t{2} << more) - 1) << CellSet::BitOf(x, y);
      last_.edges |= edges;
    }
  }
  /// Sorts and merges the cell sets. Call after the last cell.
  void Finish();

 private:
  void GoTo(int32_t tile_x, int32_t tile_y) {
    if (last_.x == tile_x && last_.y == tile_y) return;
    AppendLast();
    last_ = {.x = tile_x, .y = tile_y};
  }
  void AppendLast() {
    if (last_.cells != 0) sets_.push_back(last_);
  }

  std::vector<CellSet>& sets_;
  std::size_t first_;
  CellSet last_;  // set under construction; empty if it has no cells
};

}  // namespace Stg::internal::grid

#endif
