// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/cell_map.hh"

#include <algorithm>

#include "messages/assert.hh"

namespace Stg::rows {

bool CellMap::Make(std::span<const internal::grid::CellSet> cells, bool with_cells) {
  *this = CellMap();
  if (cells.empty()) return true;
  int64_t min_x = INT32_MAX, min_y = INT32_MAX, max_x = INT32_MIN, max_y = INT32_MIN;
  for (const internal::grid::CellSet& set : cells) {
    min_x = std::min<int64_t>(min_x, set.x);
    min_y = std::min<int64_t>(min_y, set.y);
    max_x = std::max<int64_t>(max_x, set.x);
    max_y = std::max<int64_t>(max_y, set.y);
  }
  const int64_t width = max_x - min_x + 1, height = max_y - min_y + 1;
  if (width > kMaxTiles || height > kMaxTiles || width * height > kMaxTiles ||
      (with_cells && width * height * 64 > kMaxCells))
    return false;
  x_ = static_cast<int32_t>(min_x);
  y_ = static_cast<int32_t>(min_y);
  width_ = static_cast<int32_t>(width);
  height_ = static_cast<int32_t>(height);
  distances_.assign(static_cast<size_t>(width * height), kFar);
  words_ = (width + 7) / 8;
  if (with_cells) bits_.assign(static_cast<size_t>(words_ * height * 8), 0);
  for (const internal::grid::CellSet& set : cells) {
    const int64_t column = set.x - min_x, row = set.y - min_y;
    distances_[static_cast<size_t>(row * width + column)] = 0;
    for (int64_t y = 0; with_cells && y < 8; y++)
      bits_[static_cast<size_t>((row * 8 + y) * words_ + column / 8)] |=
          (set.cells >> (8 * y) & 0xff) << (column % 8 * 8);
  }
  MeasureDistances();
  return true;
}

/// Two passes give the exact distance with diagonal steps of length 1.
void CellMap::MeasureDistances() {
  const int64_t width = width_, height = height_;
  const auto at = [&](int64_t x, int64_t y) -> int32_t {
    if (x < 0 || y < 0 || x >= width || y >= height) return kFar;
    return distances_[static_cast<size_t>(y * width + x)];
  };
  const auto lower = [&](int64_t x, int64_t y, std::initializer_list<int32_t> beside) {
    uint8_t& distance = distances_[static_cast<size_t>(y * width + x)];
    const int32_t nearest = std::min(std::min(beside) + 1, kFar);
    distance = static_cast<uint8_t>(std::min<int32_t>(distance, nearest));
  };
  for (int64_t y = 0; y < height; y++)
    for (int64_t x = 0; x < width; x++)
      lower(x, y, {at(x - 1, y), at(x - 1, y - 1), at(x, y - 1), at(x + 1, y - 1)});
  for (int64_t y = height - 1; y >= 0; y--)
    for (int64_t x = width - 1; x >= 0; x--)
      lower(x, y, {at(x + 1, y), at(x + 1, y + 1), at(x, y + 1), at(x - 1, y + 1)});
}

}  // namespace Stg::rows
