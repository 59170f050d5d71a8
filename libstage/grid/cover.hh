// SPDX-License-Identifier: GPL-2.0-or-later
//
// All cells that an edge touches: what outlines are drawn with for the exact ray model. (outline.hh
// draws thin lines from cell to cell, which leave out cells that an edge only nicks.)

#ifndef STAGE_GRID_COVER_HH
#define STAGE_GRID_COVER_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"

namespace Stg::internal::grid {

/// The walk of a ray follows the true one to within some 5/65536 of a cell (its start and its
/// displacement are rounded to 1/65536). Edges are drawn with a margin well above that, so that the
/// walk never passes by the cell in which the true ray meets an edge. In cells.
inline constexpr double kCoverMargin = 1.0 / 1024;

/// Calls f(y, first, last) for each row of cells that has some from which the edge from `a` to `b`
/// (in cells) is at most the margin away, measured along the axes: those from x = `first` to
/// `last`. Both ends must lie in the grid.
template <typename F>
void ForEachRowNear(const point_t& a, const point_t& b, F f) {
  const auto floor_of = [](double v) {  // without a call, as std::floor() is on older processors
    const auto whole = static_cast<int32_t>(v);
    return whole - (v < whole);
  };
  const auto first_of = [&](double v) { return floor_of(v - kCoverMargin); };
  const auto last_of = [&](double v) { return floor_of(v + kCoverMargin); };
  const double dx = b.x - a.x, dy = b.y - a.y;
  const bool level = std::fabs(dy) < kCoverMargin * 1e-6;
  const double per_row = level ? 0 : 1 / dy;
  const int32_t last_row = last_of(std::max(a.y, b.y));
  for (int32_t y = first_of(std::min(a.y, b.y)); y <= last_row; y++) {
    // The part of the edge, from 0 to 1, whose height is within the margin of this row's.
    double from = 0, to = 1;
    if (!level) {
      const double low = (y - kCoverMargin - a.y) * per_row;
      const double high = (y + 1 + kCoverMargin - a.y) * per_row;
      from = std::max(0.0, std::min(low, high));
      to = std::min(1.0, std::max(low, high));
    }
    const double x0 = a.x + from * dx, x1 = a.x + to * dx;
    f(y, first_of(std::min(x0, x1)), last_of(std::max(x0, x1)));
  }
}

}  // namespace Stg::internal::grid

#endif
