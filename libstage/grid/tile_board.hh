// SPDX-License-Identifier: GPL-2.0-or-later
//
// Cells of a fixed box as one word for each tile, on which outlines are drawn one after the other.

#ifndef STAGE_GRID_TILE_BOARD_HH
#define STAGE_GRID_TILE_BOARD_HH

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/cell_set.hh"
#include "grid/grid.hh"
#include "grid/outline.hh"
#include "messages/assert.hh"

namespace Stg::internal::grid {

class TileBoard {
 public:
  TileBoard() = default;
  /// A board without occupied cells. The box is in tiles.
  explicit TileBoard(const CellBox& tiles)
      : box_(tiles), width_(static_cast<size_t>(tiles.max_x - tiles.min_x + 1)) {
    words_.resize(width_ * static_cast<size_t>(tiles.max_y - tiles.min_y + 1));
  }

  const CellBox& box() const { return box_; }
  size_t width() const { return width_; }
  /// The cells of each tile, row by row, as in CellSet.
  std::span<const uint64_t> words() const { return words_; }
  void Clear() { std::fill(words_.begin(), words_.end(), 0); }

  void Add(const CellSet& set) {
    words_[Place(set.x << RAY_TILE_SHIFT, set.y << RAY_TILE_SHIFT)] |= set.cells;
  }
  /// Draws the cells of an edge, see ForEachCellOfEdge(), and its last one.
  void DrawEdge(const point_int_t& from, const point_int_t& to) {
    if (from.y == to.y) {
      DrawRow(std::min(from.x, to.x), std::max(from.x, to.x), from.y);
    } else if (from.x == to.x) {
      DrawColumn(from.x, std::min(from.y, to.y), std::max(from.y, to.y));
    } else {
      ForEachCellOfEdge(from, to, [this](int32_t x, int32_t y) { DrawRow(x, x, y); });
      DrawRow(to.x, to.x, to.y);
    }
  }

 private:
  size_t Place(int32_t x, int32_t y) const {
    const int32_t tile_x = x >> RAY_TILE_SHIFT, tile_y = y >> RAY_TILE_SHIFT;
    STAGE_ASSERT(tile_x >= box_.min_x && tile_x <= box_.max_x);
    STAGE_ASSERT(tile_y >= box_.min_y && tile_y <= box_.max_y);
    return static_cast<size_t>(tile_y - box_.min_y) * width_ +
           static_cast<size_t>(tile_x - box_.min_x);
  }
  void DrawRow(int32_t first, int32_t last, int32_t y) {
    constexpr int32_t kLast = (1 << RAY_TILE_SHIFT) - 1;
    uint64_t* word = &words_[Place(first, y)];
    for (int32_t x = first; x <= last; x = (x | kLast) + 1, word++)
      *word |= ((uint64_t{2} << (std::min(last, x | kLast) - x)) - 1) << CellSet::BitOf(x, y);
  }
  void DrawColumn(int32_t x, int32_t first, int32_t last) {
    constexpr int32_t kLast = (1 << RAY_TILE_SHIFT) - 1;
    constexpr uint64_t kColumn = 0x0101010101010101u;  // all rows of a tile
    uint64_t* word = &words_[Place(x, first)];
    for (int32_t y = first; y <= last; y = (y | kLast) + 1, word += width_)
      *word |= (kColumn >> 8 * (kLast - (std::min(last, y | kLast) - y))) << CellSet::BitOf(x, y);
  }

  CellBox box_;
  size_t width_ = 0;
  std::vector<uint64_t> words_;
};

}  // namespace Stg::internal::grid

#endif
