// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rasterization of thin outlines.

#ifndef STAGE_GRID_OUTLINE_HH
#define STAGE_GRID_OUTLINE_HH

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/cell_set.hh"

namespace Stg::internal::grid {

/// Calls f(x, y) for the cells of an edge: a 4-connected path of |dx| + |dy| cells. It includes the
/// first cell but not the last, which starts the next edge of an outline. Ties step in y first, so
/// the reversed edge may visit other cells.
template <typename F>
void ForEachCellOfEdge(const point_int_t& from, const point_int_t& to, F f) {
  // 64 bits, because the doubled difference of two 32-bit coordinates overflows 32.
  const int64_t dx = int64_t{to.x} - from.x, dy = int64_t{to.y} - from.y;
  const int32_t sx = dx < 0 ? -1 : 1, sy = dy < 0 ? -1 : 1;
  const int64_t ax = std::abs(dx), ay = std::abs(dy);
  int64_t error = ay - ax;
  int32_t x = from.x, y = from.y;
  for (int64_t n = ax + ay; n > 0; n--) {
    f(x, y);
    // Branch-free, because the direction of the next step is unpredictable.
    const bool goes_x = error < 0;
    x += goes_x ? sx : 0;
    y += goes_x ? 0 : sy;
    error += goes_x ? 2 * ay : -2 * ax;
  }
}

/// Calls f(x, y) for the cells of a closed outline, edge by edge. An outline within one cell yields
/// that cell. (Stage 4.3 yields none, which makes the body invisible.)
template <typename F>
void ForEachCellOfOutline(const point_int_t* corners, size_t count, F f) {
  bool any = false;
  for (size_t i = 0; i < count; i++) {
    const point_int_t &from = corners[i], &to = corners[i + 1 < count ? i + 1 : 0];
    any |= !(from == to);
    ForEachCellOfEdge(from, to, f);
  }
  if (!any && count > 2) f(corners[0].x, corners[0].y);
}

/// Appends the cells of a closed outline to `sets`.
inline void AppendOutline(const point_int_t* corners, size_t count, std::vector<CellSet>* sets) {
  CellSetBuilder maker(sets);
  ForEachCellOfOutline(corners, count, [&](int32_t x, int32_t y) { maker.Add(x, y); });
  maker.Finish();
}

}  // namespace Stg::internal::grid

#endif
