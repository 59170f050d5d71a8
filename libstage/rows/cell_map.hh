// SPDX-License-Identifier: GPL-2.0-or-later
//
// The cells of everything that stands, as a dense bitmap, with the distance of each tile to the
// nearest occupied one.

#ifndef STAGE_ROWS_CELL_MAP_HH
#define STAGE_ROWS_CELL_MAP_HH

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/grid.hh"
#include "messages/assert.hh"
#include "rows/outline_bits.hh"

namespace Stg::rows {

class CellMap {
 public:
  /// Largest number of cells of a map, and of tiles of a map without cells.
  static constexpr int64_t kMaxCells = int64_t{1} << 30, kMaxTiles = int64_t{1} << 26;

  /// Makes a map of these cells. If not `with_cells`, only distances can be asked. False if the box
  /// around the cells is too large.
  bool Make(std::span<const internal::grid::CellSet> cells, bool with_cells);

  /// Makes a map whose box contains `tiles`, too, and may have cells there that come and go.
  bool MakeChangeable(const internal::grid::CellBox& tiles,
                      std::span<const internal::grid::CellSet> cells, bool with_cells);
  /// The cells of a tile in the box. The map has cells.
  uint64_t Tile(int32_t x, int32_t y) const;
  /// Sets the cells of a tile in the box, by its coordinates. MeasureDistances() must follow.
  void SetTile(int32_t x, int32_t y, uint64_t cells);
  /// By tile of the box, row by row: 0 if it has cells, any other number if not. Once all are set,
  /// MeasureDistances() must follow.
  std::span<uint8_t> distances() { return distances_; }
  /// Measures the distances of tiles without cells. All others are 0.
  void MeasureDistances();

  /// True if surely no occupied cell is within `cells` columns and rows of the cell.
  bool IsClear(int32_t x, int32_t y, int32_t cells) const {
    if (width_ == 0) return true;
    return (int64_t{DistanceOf(x >> 3, y >> 3)} - 1) * 8 >= cells;
  }
  /// True if the outline has an occupied cell. The map has cells.
  template <class Word>
  bool Meets(const OutlineBox& box, const Word* rows) const;

  /// All that a copy on a device needs.
  struct Content {
    int32_t x, y, width, height;         ///< box, in tiles
    std::span<const uint8_t> distances;  ///< by tile
    std::span<const uint64_t> bits;      ///< rows of cells, `words` words each
    int64_t words;
  };
  Content content() const { return {x_, y_, width_, height_, distances_, bits_, words_}; }

 private:
  bool MakeBox(int64_t min_x, int64_t min_y, int64_t max_x, int64_t max_y, bool with_cells);
  void AddCells(std::span<const internal::grid::CellSet> cells, bool with_cells);
  size_t PlaceOf(int32_t tile_x, int32_t tile_y) const {
    STAGE_ASSERT(tile_x >= x_ && tile_x < x_ + width_ && tile_y >= y_ && tile_y < y_ + height_);
    return static_cast<size_t>(tile_y - y_) * static_cast<size_t>(width_) +
           static_cast<size_t>(tile_x - x_);
  }
  /// A lower bound of the distance in tiles to the nearest occupied tile, columns or rows.
  int32_t DistanceOf(int32_t tile_x, int32_t tile_y) const;
  uint64_t WordAt(int64_t x, int64_t y) const;

  int32_t x_ = 0, y_ = 0, width_ = 0, height_ = 0;  // box, in tiles
  std::vector<uint8_t> distances_;                  // by tile, at most kFar
  std::vector<uint64_t> bits_;                      // rows of cells, words_ words each
  int64_t words_ = 0;
  static constexpr int32_t kFar = 255;
};

inline int32_t CellMap::DistanceOf(int32_t tile_x, int32_t tile_y) const {
  const int32_t x = tile_x - x_, y = tile_y - y_;
  if (static_cast<uint32_t>(x) < static_cast<uint32_t>(width_) &&
      static_cast<uint32_t>(y) < static_cast<uint32_t>(height_))
    return distances_[static_cast<size_t>(y) * static_cast<size_t>(width_) +
                      static_cast<size_t>(x)];
  const int64_t beside =
      std::max<int64_t>({int64_t{x_} - tile_x, int64_t{tile_x} - x_ - width_ + 1,
                         int64_t{y_} - tile_y, int64_t{tile_y} - y_ - height_ + 1});
  return static_cast<int32_t>(std::min<int64_t>(beside, INT32_MAX / 16));
}

/// The 64 cells from x on in a row, both relative to the map's first cell.
inline uint64_t CellMap::WordAt(int64_t x, int64_t y) const {
  if (y < 0 || y >= int64_t{height_} * 8) return 0;
  const int64_t word = x >> 6, bit = x & 63;
  const auto part = [&](int64_t i) {
    return i < 0 || i >= words_ ? 0 : bits_[static_cast<size_t>(y * words_ + i)];
  };
  return bit == 0 ? part(word) : part(word) >> bit | part(word + 1) << (64 - bit);
}

template <class Word>
bool CellMap::Meets(const OutlineBox& box, const Word* rows) const {
  if (width_ == 0 || box.height == 0) return false;
  STAGE_ASSERT(!bits_.empty());
  const int64_t x = int64_t{box.x} - int64_t{x_} * 8, y = int64_t{box.y} - int64_t{y_} * 8;
  for (int32_t i = 0; i < box.height; i++)
    if (rows[i] & WordAt(x, y + i)) return true;
  return false;
}

}  // namespace Stg::rows

#endif
