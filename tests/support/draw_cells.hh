// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rasterizes bodies into a grid cell by cell.

#ifndef STAGE_TESTS_SUPPORT_DRAW_CELLS_HH
#define STAGE_TESTS_SUPPORT_DRAW_CELLS_HH

#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "grid/grid.hh"

namespace Stg::test {

inline grid::CellSet CellSetOf(int32_t x, int32_t y) {
  return {.x = x >> 3, .y = y >> 3, .cells = uint64_t{1} << grid::Grid::BitOf(x, y)};
}

/// Adds a cell to a body that does not have it yet.
inline grid::CellRef DrawCell(grid::Grid* grid, int32_t x, int32_t y, grid::BodyId body) {
  grid::CellSet set = CellSetOf(x, y);
  grid->Rasterize(body, {}, std::span(&set, 1));
  return grid::CellOf(set.slot, grid::Grid::BitOf(x, y));
}

/// Adds a cell to a body unless the body has it.
inline grid::CellRef DrawCellOnce(grid::Grid* grid, int32_t x, int32_t y, grid::BodyId body) {
  const grid::CellSet set = CellSetOf(x, y);
  if (const uint32_t slot = grid->FindTileSlot(set); slot != 0) {
    const grid::CellRef cell = grid::CellOf(slot, grid::Grid::BitOf(x, y));
    if (grid->AnyIn(cell, [&](grid::BodyId id) { return id == body; })) return cell;
  }
  return DrawCell(grid, x, y, body);
}

/// Undoes one call of DrawCell().
inline void EraseCell(grid::Grid* grid, grid::CellRef cell, grid::BodyId body) {
  int32_t x, y;
  grid->Coordinates(cell, &x, &y);
  grid::CellSet set = CellSetOf(x, y);
  set.slot = static_cast<uint32_t>(cell >> 6);
  grid->Rasterize(body, std::span(&set, 1), {});
}

/// Collects cells into sets, one per tile.
inline std::vector<grid::CellSet> CellSetsOf(const grid::Grid& grid,
                                             const std::vector<grid::CellRef>& cells) {
  std::vector<grid::CellSet> sets;
  grid::CellSetBuilder maker(&sets);
  for (const grid::CellRef cell : cells) {
    int32_t x, y;
    grid.Coordinates(cell, &x, &y);
    maker.Add(x, y);
  }
  maker.Finish();
  grid.FindSlots(sets);
  return sets;
}

/// The bodies in a cell, in the order of its list.
inline std::vector<grid::BodyId> BodiesAt(const grid::Grid& grid, int32_t x, int32_t y) {
  std::vector<grid::BodyId> found;
  grid.AnyAt(grid.FindRegion(x, y), grid::Grid::TileOf(x, y), grid::Grid::BitOf(x, y),
             [&](grid::BodyId id) {
               found.push_back(id);
               return false;
             });
  return found;
}

}  // namespace Stg::test

#endif
