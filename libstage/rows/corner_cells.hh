// SPDX-License-Identifier: GPL-2.0-or-later
//
// From a mover's pose to cells.

#ifndef STAGE_ROWS_CORNER_CELLS_HH
#define STAGE_ROWS_CORNER_CELLS_HH

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "geometry/floor.hh"
#include "grid/grid.hh"
#include "kernels/ray_walk.h"
#include "rows/clones.hh"
#include "rows/outline_bits.hh"
#include "rows/placed.hh"
#include "rows/scene.hh"

namespace Stg::rows {

/// Eight corners at once.
typedef double CornerNumbers __attribute__((vector_size(64)));
typedef int32_t CornerIntegers __attribute__((vector_size(32)));

/// FloorToInt() of numbers that are within its range.
STAGE_INLINE void StoreFloors(const CornerNumbers& numbers, int32_t* to) {
  const CornerIntegers truncated = __builtin_convertvector(numbers, CornerIntegers);
  const auto above = __builtin_convertvector(truncated, CornerNumbers) > numbers;  // -1 or 0
  const CornerIntegers floors = truncated + __builtin_convertvector(above, CornerIntegers);
  std::memcpy(to, &floors, sizeof floors);
}

/// FindCells() for bodies that are far from the borders of the grid. Returns false if it is not.
STAGE_INLINE bool FindCellsInside(const Body& body, const Placed& frame, double cells_per_metre,
                                  CornerCells* to) {
  const double sine = frame.turn.sine, cosine = frame.turn.cosine;
  const double at_x = frame.x, at_y = frame.y;
  constexpr double kInside = internal::grid::kMaxCell / 2;  // outlines are at most kMaxSide long
  for (size_t i = 0; i < body.corners_x.size(); i += 8) {
    CornerNumbers x, y;
    std::memcpy(&x, &body.corners_x[i], sizeof x);
    std::memcpy(&y, &body.corners_y[i], sizeof y);
    const CornerNumbers cx = (at_x + x * cosine - y * sine) * cells_per_metre;
    const CornerNumbers cy = (at_y + x * sine + y * cosine) * cells_per_metre;
    if (!(std::fabs(cx[0]) < kInside && std::fabs(cy[0]) < kInside)) return false;
    StoreFloors(cx, &to->x[i]);
    StoreFloors(cy, &to->y[i]);
  }
  return true;
}

/// Finds the cells of a body's corners. Returns false if one exceeds the grid.
STAGE_INLINE bool FindCells(const Body& body, const Placed& frame, double cells_per_metre,
                            CornerCells* to) {
  if (FindCellsInside(body, frame, cells_per_metre, to)) return true;
  const double *const x = body.corners_x.data(), *const y = body.corners_y.data();
  const size_t count = body.corners_x.size();
  const double sine = frame.turn.sine, cosine = frame.turn.cosine;
  const double at_x = frame.x, at_y = frame.y;
  int outside = 0;
  for (size_t i = 0; i < count; i++) {
    const double cx = (at_x + x[i] * cosine - y[i] * sine) * cells_per_metre;
    const double cy = (at_y + x[i] * sine + y[i] * cosine) * cells_per_metre;
    const bool fits =
        FloorIsWithin(cx, internal::grid::kMaxCell) & FloorIsWithin(cy, internal::grid::kMaxCell);
    outside |= !fits;
    to->x[i] = FloorToInt(fits ? cx : 0.0);
    to->y[i] = FloorToInt(fits ? cy : 0.0);
  }
  return outside == 0;
}

/// Extends the extent of a grid by the superregions of an outline. See Grid::extent().
inline void Widen(internal::grid::CellBox* extent, const OutlineBox& box) {
  if (box.height == 0) return;
  constexpr int32_t kSuperShift = RAY_TILE_SHIFT + 3 + 4;  // log2 of the side of a superregion
  constexpr int32_t kLast = (1 << kSuperShift) - 1;
  const int32_t min_x = box.x & ~kLast, max_x = (box.x + box.width - 1) | kLast;
  const int32_t min_y = box.y & ~kLast, max_y = (box.y + box.height - 1) | kLast;
  if (extent->empty()) *extent = {min_x, min_y, max_x, max_y};
  *extent = {std::min(extent->min_x, min_x), std::min(extent->min_y, min_y),
             std::max(extent->max_x, max_x), std::max(extent->max_y, max_y)};
}

}  // namespace Stg::rows

#endif
