// SPDX-License-Identifier: GPL-2.0-or-later
//
// Outlines into cells.

#ifndef STAGE_GRID_OUTLINE_HH
#define STAGE_GRID_OUTLINE_HH

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/tile_part.hh"

namespace Stg::internal::grid {

/// The cells of the edge from one cell to another: a 4-connected path of |dx| + |dy| cells that
/// includes the first cell and not the last (which is the first of the next edge of an outline).
/// At a tie the step in y goes first, so an edge drawn backwards may pass other cells.
template <typename F>
void ForEachCellOfEdge(const point_int_t& from, const point_int_t& to, F f) {
  // 64 bits: the difference of two 32-bit coordinates, doubled.
  const int64_t dx = int64_t{to.x} - from.x, dy = int64_t{to.y} - from.y;
  const int32_t sx = dx < 0 ? -1 : 1, sy = dy < 0 ? -1 : 1;
  const int64_t ax = std::abs(dx), ay = std::abs(dy);
  int64_t error = ay - ax;
  int32_t x = from.x, y = from.y;
  for (int64_t n = ax + ay; n > 0; n--) {
    f(x, y);
    // No branch: which way it goes can't be predicted.
    const bool goes_x = error < 0;
    x += goes_x ? sx : 0;
    y += goes_x ? 0 : sy;
    error += goes_x ? 2 * ay : -2 * ax;
  }
}

/// The cells of a closed outline, edge by edge. An outline that lies within one cell has that cell
/// (Stage 4.3 draws nothing then, and the body is invisible).
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

/// Appends the cells of a closed outline.
inline void AppendOutline(const point_int_t* corners, size_t count, std::vector<TilePart>* parts) {
  PartsMaker maker(parts);
  ForEachCellOfOutline(corners, count, [&](int32_t x, int32_t y) { maker.Add(x, y); });
  maker.Finish();
}

}  // namespace Stg::internal::grid

#endif
