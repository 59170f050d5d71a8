// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/free_box.hh"

#include <algorithm>

#include "messages/assert.hh"

namespace Stg::internal::sensing {

namespace {

using grid::CellBox;

/// Size of the area that is examined: the region of the start and its neighbours.
constexpr int kRegions = 3, kTiles = 8 * kRegions;

/// Mask of tiles min to max of a row.
uint32_t Between(int min, int max) {
  // Boxes lie within that area, which clang-tidy cannot know.
  // NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult)
  return (uint32_t{2} << max) - (uint32_t{1} << min);
}

/// Occupied tiles around a cell. Boxes are in tiles, relative to the corner of the area.
class Surroundings {
 public:
  Surroundings(const ray_grid_t& grid, int32_t x, int32_t y)
      : grid_(grid),
        region_x_((x >> RAY_REGION_SHIFT) - kRegions / 2),
        region_y_((y >> RAY_REGION_SHIFT) - kRegions / 2) {
    for (int i = 0; i < kRegions; i++)
      for (int k = 0; k < kRegions; k++) TakeRegion(i, k);
  }

  /// Column and row of a cell's tile. They may lie outside of the area.
  int ColumnOf(int32_t x) const { return (x >> RAY_TILE_SHIFT) - 8 * region_x_; }
  int RowOf(int32_t y) const { return (y >> RAY_TILE_SHIFT) - 8 * region_y_; }
  /// Mask of the occupied tiles in a row.
  uint32_t row(int y) const { return rows_[y]; }
  /// Mask of the columns that are occupied in the rows of the box.
  uint32_t Columns(const CellBox& box) const {
    uint32_t columns = 0;
    for (int y = box.min_y; y <= box.max_y; y++) columns |= rows_[y];
    return columns;
  }
  bool IsFree(const CellBox& box) const {
    return (Columns(box) & Between(box.min_x, box.max_x)) == 0;
  }
  CellBox InCells(const CellBox& box) const {
    const int32_t x = 8 * region_x_, y = 8 * region_y_;
    return {(x + box.min_x) * 8, (y + box.min_y) * 8, (x + box.max_x) * 8 + 7,
            (y + box.max_y) * 8 + 7};
  }

  /// Marks tiles as empty that hold nothing but what the self-mask hides.
  void Hide(const ray_mask_t& mask) {
    const int first_x = mask.x - 8 * region_x_, first_y = mask.y - 8 * region_y_;
    for (int i = 0; i < static_cast<int>(mask.height); i++) {
      if (first_y + i < 0 || first_y + i >= kTiles) continue;
      const uint64_t* hidden = mask.tiles + static_cast<uint32_t>(i) * mask.width;
      for (int k = 0; k < static_cast<int>(mask.width); k++)
        if (first_x + k >= 0 && first_x + k < kTiles) Hide(first_x + k, first_y + i, hidden[k]);
    }
  }

 private:
  void TakeRegion(int i, int k) {
    const int32_t x = region_x_ + k, y = region_y_ + i;
    constexpr int kShift = RAY_SUPER_SHIFT - RAY_REGION_SHIFT;
    if ((i == 0 && k == 0) || x >> kShift != super_x_ || y >> kShift != super_y_) {
      super_x_ = x >> kShift;
      super_y_ = y >> kShift;
      super_ = ray_find_super(&grid_, super_x_, super_y_);
    }
    const uint32_t place = static_cast<uint32_t>(ray_place(x, y, 4));
    const uint32_t region = super_ ? grid_.regions[super_ * 256 + place] : 0;
    regions_[i][k] = region;
    const uint64_t map = region ? grid_.tile_maps[region] : 0;
    for (int row = 0; row < 8; row++)
      rows_[8 * i + row] |= static_cast<uint32_t>(map >> (8 * row) & 0xff) << (8 * k);
  }

  void Hide(int x, int y, uint64_t hidden) {
    const uint32_t bit = uint32_t{1} << x;
    if ((rows_[y] & bit) == 0) return;
    const uint32_t tile = static_cast<uint32_t>(ray_place(x, y, 3));
    const uint64_t word = grid_.tiles[uint64_t{regions_[y >> 3][x >> 3]} * 64 + tile];
    if ((word & ~hidden) == 0) rows_[y] &= ~bit;
  }

  const ray_grid_t& grid_;
  const int32_t region_x_, region_y_;
  int32_t super_x_ = 0, super_y_ = 0;
  uint32_t super_ = 0;
  uint32_t regions_[kRegions][kRegions];
  uint32_t rows_[kTiles] = {};
};

/// Grows the box tile by tile towards the signs of x and y while it stays empty.
CellBox Grow(const Surroundings& around, CellBox box, int x, int y) {
  STAGE_ASSERT(!box.empty() && around.IsFree(box));
  int* const far_x = x > 0 ? &box.max_x : &box.min_x;
  int* const far_y = y > 0 ? &box.max_y : &box.min_y;
  uint32_t columns = around.Columns(box);
  const auto inside = [](int tile) { return tile >= 0 && tile < kTiles; };
  for (bool grows_x = true, grows_y = true; grows_x || grows_y;) {
    grows_x = grows_x && inside(*far_x + x) && (columns >> (*far_x + x) & 1) == 0;
    if (grows_x) *far_x += x;
    grows_y = grows_y && inside(*far_y + y) &&
              (around.row(*far_y + y) & Between(box.min_x, box.max_x)) == 0;
    if (grows_y) columns |= around.row(*far_y += y);
  }
  STAGE_ASSERT(around.IsFree(box) && box.min_x >= 0 && box.max_x < kTiles);
  STAGE_ASSERT(box.min_y >= 0 && box.max_y < kTiles);
  return box;
}

/// The tiles that the rays start in, or that of the first if the others are too far away or
/// something lies between them.
CellBox StartsOf(const RayGroup& rays, const Surroundings& around) {
  const auto tile_of = [&](const FanRecord& fan) {
    const int x = around.ColumnOf(fan.x), y = around.RowOf(fan.y);
    return CellBox{x, y, x, y};
  };
  const CellBox first = tile_of(*rays.slices[0].fan);
  CellBox all = first;
  for (uint32_t i = 1; i < rays.slice_count; i++) {
    const CellBox tile = tile_of(*rays.slices[i].fan);
    all = {std::min(all.min_x, tile.min_x), std::min(all.min_y, tile.min_y),
           std::max(all.max_x, tile.max_x), std::max(all.max_y, tile.max_y)};
  }
  const bool near = all.min_x >= 0 && all.min_y >= 0 && all.max_x < kTiles && all.max_y < kTiles;
  return near && around.IsFree(all) ? all : first;
}

}  // namespace

FreeBoxes FindFreeBoxesIfWorthwhile(const RayGroup& rays) {
  constexpr uint32_t kMany = 16;  // searching costs as much as about ten rays
  return rays.count < kMany ? FreeBoxes() : FindFreeBoxes(rays);
}

FreeBoxes FindFreeBoxes(const RayGroup& rays) {
  STAGE_ASSERT(rays.slice_count > 0);
  const FanRecord& first = *rays.slices[0].fan;
  Surroundings around(*rays.grid, first.x, first.y);
  around.Hide(*rays.mask);
  const CellBox starts = StartsOf(rays, around);
  FreeBoxes boxes;
  if (!around.IsFree(starts)) return boxes;
  for (const int back_y : {0, 1})
    for (const int back_x : {0, 1})
      boxes.towards[back_y][back_x] =
          around.InCells(Grow(around, starts, back_x ? -1 : 1, back_y ? -1 : 1));
  return boxes;
}

}  // namespace Stg::internal::sensing
