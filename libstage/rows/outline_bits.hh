// SPDX-License-Identifier: GPL-2.0-or-later
//
// The cells of a thin outline as bits in its bounding box: one word per row of cells. They are the
// cells that grid/outline.hh visits. Overlaps and rays are found word by word.

#ifndef STAGE_ROWS_OUTLINE_BITS_HH
#define STAGE_ROWS_OUTLINE_BITS_HH

#include <algorithm>
#include <cstdint>
#include <cstdlib>

#include "geometry/geometry.hh"
#include "kernels/ray_walk.h"

namespace Stg::rows {

/// Longest side of an outline, in cells.
inline constexpr int32_t kMaxSide = 64;

/// The bounding box of an outline. Its rows of bits are stored elsewhere.
struct OutlineBox {
  int32_t x = 0, y = 0;           ///< first cell
  int32_t width = 0, height = 0;  ///< in cells; 0: the outline is not in the grid

  bool operator==(const OutlineBox&) const = default;
};

/// The cells of all short edges, without their last ones, as 8 rows of 8 cells. Drawing them takes
/// no branches, which would be unpredictable.
class EdgePatterns {
 public:
  static constexpr int32_t kLongest = 7;  // cells on each axis

  struct Pattern {
    uint64_t cells;
    int32_t x, y;  ///< first cell of the rows relative to the edge's first cell
  };
  constexpr EdgePatterns();
  static bool Has(int32_t dx, int32_t dy) {
    return static_cast<uint32_t>(dx + kLongest) < kSide &&
           static_cast<uint32_t>(dy + kLongest) < kSide;
  }
  const Pattern& Of(int32_t dx, int32_t dy) const {
    return patterns_[dy + kLongest][dx + kLongest];
  }

 private:
  static constexpr uint32_t kSide = 2 * kLongest + 1;
  Pattern patterns_[kSide][kSide];
};
/// Calls f(x, y) for the cells of an edge from (0, 0), without the last one. See
/// grid::ForEachCellOfEdge().
template <typename F>
constexpr void ForEachCellOfEdge(int32_t dx, int32_t dy, F f) {
  const int32_t sx = dx < 0 ? -1 : 1, sy = dy < 0 ? -1 : 1;
  const int32_t ax = dx * sx, ay = dy * sy;
  int32_t error = ay - ax, x = 0, y = 0;
  for (int32_t n = ax + ay; n > 0; n--) {
    f(x, y);
    const int32_t goes_x = error >> 31;  // all ones, or 0
    x += sx & goes_x;
    y += sy & ~goes_x;
    error += (2 * ay & goes_x) - (2 * ax & ~goes_x);
  }
}

constexpr EdgePatterns::EdgePatterns() : patterns_{} {
  for (int32_t dy = -kLongest; dy <= kLongest; dy++)
    for (int32_t dx = -kLongest; dx <= kLongest; dx++) {
      Pattern& pattern = patterns_[dy + kLongest][dx + kLongest];
      pattern = {0, std::min(dx, 0), std::min(dy, 0)};
      ForEachCellOfEdge(dx, dy, [&](int32_t x, int32_t y) {
        pattern.cells |= uint64_t{1} << (8 * (y - pattern.y) + x - pattern.x);
      });
    }
}
inline constexpr EdgePatterns kEdgePatterns;

/// Rows beyond the height of an outline that DrawOutline() may write zeros to.
inline constexpr int32_t kSpareRows = 8;

/// Draws the closed outline with these corner cells. `rows` has room for the height of the box,
/// which is at most kMaxSide on each side, and for kSpareRows.
inline void DrawOutline(const point_int_t* corners, uint32_t count, OutlineBox* box,
                        uint64_t* rows) {
  int32_t min_x = corners[0].x, max_x = min_x, min_y = corners[0].y, max_y = min_y;
  for (uint32_t i = 1; i < count; i++) {
    min_x = std::min(min_x, corners[i].x);
    max_x = std::max(max_x, corners[i].x);
    min_y = std::min(min_y, corners[i].y);
    max_y = std::max(max_y, corners[i].y);
  }
  *box = {min_x, min_y, max_x - min_x + 1, max_y - min_y + 1};
  std::fill(rows, rows + box->height + kSpareRows, 0);
  bool has_cells = false;
  for (uint32_t i = 0; i < count; i++) {
    const point_int_t &from = corners[i], &to = corners[i + 1 < count ? i + 1 : 0];
    const int32_t dx = to.x - from.x, dy = to.y - from.y;
    const int32_t x = from.x - min_x, y = from.y - min_y;
    has_cells |= (dx | dy) != 0;
    if (EdgePatterns::Has(dx, dy)) {
      const EdgePatterns::Pattern& pattern = kEdgePatterns.Of(dx, dy);
      uint64_t* const first = rows + y + pattern.y;
      for (int32_t k = 0; k < 8; k++)
        first[k] |= (pattern.cells >> (8 * k) & 0xff) << (x + pattern.x);
    } else {
      ForEachCellOfEdge(dx, dy,
                        [&](int32_t u, int32_t v) { rows[y + v] |= uint64_t{1} << (x + u); });
    }
  }
  if (!has_cells && count > 2) rows[0] |= 1;
}

/// True if two outlines share a cell.
inline bool Overlap(const OutlineBox& a, const uint64_t* rows_of_a, const OutlineBox& b,
                    const uint64_t* rows_of_b) {
  const int64_t shift = int64_t{b.x} - a.x, up = int64_t{b.y} - a.y;
  if (shift >= a.width || -shift >= b.width || up >= a.height || -up >= b.height) return false;
  const auto begin = static_cast<int32_t>(std::max<int64_t>(0, up));
  const auto end = static_cast<int32_t>(std::min<int64_t>(a.height, up + b.height));
  uint64_t common = 0;
  for (int32_t y = begin; y < end; y++) {
    const uint64_t other = rows_of_b[y - up];
    common |= rows_of_a[y] & (shift >= 0 ? other << shift : other >> -shift);
  }
  return common != 0;
}

/// A ray of one leg, as ray_begin() prepares it.
struct CellRay {
  int32_t x, y;    ///< start cell
  int32_t sx, sy;  ///< direction of travel
  int32_t ox, oy, adx, ady;

  CellRay(int32_t start_x, int32_t start_y, int32_t fraction_x, int32_t fraction_y, int32_t dx,
          int32_t dy)
      : x(start_x),
        y(start_y),
        sx(dx < 0 ? -1 : 1),
        sy(dy < 0 ? -1 : 1),
        ox(dx < 0 ? 65536 - fraction_x : fraction_x),
        oy(dy < 0 ? 65536 - fraction_y : fraction_y),
        adx(std::abs(dx)),
        ady(std::abs(dy)) {}
};

/// Number of borders of the other axis that are crossed before the border `to` of this one.
inline int32_t LandAt(int32_t to, int32_t offset, int32_t across, int32_t other_offset,
                      int32_t along, int32_t ties) {
  const float slope = across > 0 ? static_cast<float>(along) / static_cast<float>(across) : 0.0f;
  return ray_leap_end(to, offset, across, other_offset, along, slope, 0, ties);
}

/// Finds the first cell of the outline on the ray: the numbers of borders crossed. Returns false if
/// there is none before the ray's end.
inline bool MeetOutline(const OutlineBox& box, const uint64_t* rows, const CellRay& ray,
                        int32_t* borders_x, int32_t* borders_y) {
  // In borders from the start, in the direction of travel.
  const int64_t near_x =
      ray.sx > 0 ? int64_t{box.x} - ray.x : int64_t{ray.x} - box.x - box.width + 1;
  const int64_t near_y =
      ray.sy > 0 ? int64_t{box.y} - ray.y : int64_t{ray.y} - box.y - box.height + 1;
  const int64_t far_x = near_x + box.width - 1, far_y = near_y + box.height - 1;
  if (far_x < 0 || far_y < 0) return false;
  const int64_t first_x = std::max<int64_t>(near_x, 0), first_y = std::max<int64_t>(near_y, 0);
  if (first_x * 65536 - ray.ox > ray.adx || first_y * 65536 - ray.oy > ray.ady) return false;
  auto u = static_cast<int32_t>(first_x), v = static_cast<int32_t>(first_y);
  if (u > 0 || v > 0) {
    // The later of both borders; at a tie y is crossed first.
    const bool x_is_later = v == 0 || (u > 0 && ray_product((u << 16) - ray.ox, ray.ady) >=
                                                    ray_product((v << 16) - ray.oy, ray.adx));
    if (x_is_later)
      v = LandAt(u, ray.ox, ray.adx, ray.oy, ray.ady, 1);
    else
      u = LandAt(v, ray.oy, ray.ady, ray.ox, ray.adx, 0);
    if (u > far_x || v > far_y) return false;
  }
  int64_t e = ray_product(((u + 1) << 16) - ray.ox, ray.ady) -
              ray_product(((v + 1) << 16) - ray.oy, ray.adx);
  const int64_t step_x = int64_t{ray.ady} << 16, step_y = int64_t{ray.adx} << 16;
  while (u <= far_x && v <= far_y) {
    if (((u << 16) - ray.ox > ray.adx) | ((v << 16) - ray.oy > ray.ady)) return false;
    const int32_t column = ray.x + ray.sx * u - box.x, row = ray.y + ray.sy * v - box.y;
    if (rows[row] >> column & 1) {
      *borders_x = u;
      *borders_y = v;
      return true;
    }
    if (e < 0) {
      u++;
      e += step_x;
    } else {
      v++;
      e -= step_y;
    }
  }
  return false;
}

}  // namespace Stg::rows

#endif
