// SPDX-License-Identifier: GPL-2.0-or-later
//
// Conservative rasterization of an edge: every cell that the edge touches. The exact ray model uses
// it. (outline.hh rasterizes thin lines, which skip cells that an edge only nicks.)

#ifndef STAGE_GRID_COVER_HH
#define STAGE_GRID_COVER_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"

namespace Stg::internal::grid {

/// Margin in cells. The walk of a ray deviates from the true ray by up to about 5/65536 of a cell,
/// since its start and displacement are rounded to 1/65536. The much larger margin guarantees that
/// the walk visits the cell where the true ray meets an edge.
inline constexpr double kCoverMargin = 1.0 / 1024;

/// Calls f(y, first, last) for each row that contains cells within kCoverMargin of the edge from
/// `a` to `b`. The cells are x = `first` to `last`. The distance is measured per axis; both ends
/// are in cells and must lie in the grid.
template <typename F>
void ForEachRowNear(const point_t& a, const point_t& b, F f) {
  const auto floor_of = [](double v) {  // inline: std::floor() may be a library call
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
    // Interval of the edge, in 0..1, that lies within the margin of this row.
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
