// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/cell_map.hh"

#include <algorithm>

#include "messages/assert.hh"

namespace Stg::rows {

namespace {

/// Coordinates of tiles, both ends included.
struct TileBox {
  int64_t min_x = INT32_MAX, min_y = INT32_MAX, max_x = INT32_MIN, max_y = INT32_MIN;

  void Include(int64_t x, int64_t y) {
    min_x = std::min(min_x, x);
    min_y = std::min(min_y, y);
    max_x = std::max(max_x, x);
    max_y = std::max(max_y, y);
  }
};

}  // namespace

bool CellMap::Make(std::span<const internal::grid::CellSet> cells, bool with_cells) {
  return MakeChangeable({}, cells, with_cells);
}

bool CellMap::MakeChangeable(const internal::grid::CellBox& tiles,
                             std::span<const internal::grid::CellSet> cells, bool with_cells) {
  *this = CellMap();
  TileBox box;
  for (const internal::grid::CellSet& set : cells) box.Include(set.x, set.y);
  if (!tiles.empty()) {
    box.Include(tiles.min_x, tiles.min_y);
    box.Include(tiles.max_x, tiles.max_y);
  }
  if (box.max_x < box.min_x) return true;
  const int64_t width = box.max_x - box.min_x + 1, height = box.max_y - box.min_y + 1;
  if (width > kMaxTiles || height > kMaxTiles || width * height > kMaxTiles ||
      (with_cells && width * height * 64 > kMaxCells))
    return false;
  x_ = static_cast<int32_t>(box.min_x);
  y_ = static_cast<int32_t>(box.min_y);
  width_ = static_cast<int32_t>(width);
  height_ = static_cast<int32_t>(height);
  distances_.assign(static_cast<size_t>(width * height), kFar);
  words_ = (width + 7) / 8;
  if (with_cells) bits_.assign(static_cast<size_t>(words_ * height * 8), 0);
  for (const internal::grid::CellSet& set : cells) {
    distances_[PlaceOf(set.x, set.y)] = 0;
    if (with_cells) SetTile(set.x, set.y, Tile(set.x, set.y) | set.cells);
  }
  MeasureDistances();
  return true;
}

uint64_t CellMap::Tile(int32_t x, int32_t y) const {
  const int64_t column = x - x_, row = int64_t{y - y_} * 8;
  uint64_t cells = 0;
  for (int64_t i = 0; i < 8; i++)
    cells |= (bits_[static_cast<size_t>((row + i) * words_ + column / 8)] >> column % 8 * 8 & 0xff)
             << 8 * i;
  return cells;
}

void CellMap::SetTile(int32_t x, int32_t y, uint64_t cells) {
  STAGE_ASSERT(!bits_.empty());
  const int64_t column = x - x_, shift = column % 8 * 8;
  uint64_t* word = &bits_[static_cast<size_t>(int64_t{y - y_} * 8 * words_ + column / 8)];
  for (int i = 0; i < 8; i++, word += words_)
    *word = (*word & ~(uint64_t{0xff} << shift)) | (cells >> (8 * i) & 0xff) << shift;
}

namespace {

constexpr uint8_t PlusOne(uint8_t distance) {
  return static_cast<uint8_t>(distance + (distance != 255));
}

/// Lowers the distances of a row to those of the row beside plus 1, straight and diagonally.
void LowerTo(const uint8_t* beside, uint8_t* row, int32_t width) {
  const auto lower = [&](int32_t x, uint8_t nearest) {
    row[x] = std::min(row[x], PlusOne(std::min(nearest, beside[x])));
  };
  if (width == 1) return lower(0, 255);
  lower(0, beside[1]);
  for (int32_t x = 1; x + 1 < width; x++) lower(x, std::min(beside[x - 1], beside[x + 1]));
  lower(width - 1, beside[width - 2]);
}

/// Lowers each distance of a row to that before it plus 1. `step`: 1 from left to right, -1 from
/// right to left.
void LowerAlong(uint8_t* row, int32_t width, int32_t step) {
  int32_t before = 255;
  for (int32_t i = 0, x = step > 0 ? 0 : width - 1; i < width; i++, x += step) {
    before = std::min<int32_t>(row[x], before + 1);
    row[x] = static_cast<uint8_t>(before);
  }
}

}  // namespace

/// Two passes give the exact distance with diagonal steps of length 1.
void CellMap::MeasureDistances() {
  static_assert(kFar == 255);
  const auto row = [&](int32_t y) {
    return &distances_[static_cast<size_t>(y) * static_cast<size_t>(width_)];
  };
  for (uint8_t& distance : distances_) distance = distance == 0 ? 0 : 255;
  for (int32_t y = 0; y < height_; y++) {
    if (y > 0) LowerTo(row(y - 1), row(y), width_);
    LowerAlong(row(y), width_, 1);
  }
  for (int32_t y = height_ - 1; y >= 0; y--) {
    if (y + 1 < height_) LowerTo(row(y + 1), row(y), width_);
    LowerAlong(row(y), width_, -1);
  }
}

}  // namespace Stg::rows
