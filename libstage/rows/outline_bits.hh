// SPDX-License-Identifier: GPL-2.0-or-later
//
// The cells of a thin outline as bits in its bounding box: one word per row of cells. They are the
// cells that grid/outline.hh visits. Overlaps and rays are found word by word.

#ifndef STAGE_ROWS_OUTLINE_BITS_HH
#define STAGE_ROWS_OUTLINE_BITS_HH

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include "geometry/geometry.hh"
#include "kernels/ray_walk.h"

namespace Stg::rows {

/// Longest side of an outline, in cells, and of a narrow outline.
inline constexpr int32_t kMaxSide = 64, kNarrowSide = 16;

/// Bits of a row of cells: those of narrow outlines, and of others. All outlines of a scene have
/// words of one type.
using NarrowWord = uint16_t;
using WideWord = uint64_t;

/// The bounding box of an outline. Its rows of bits are stored elsewhere.
struct OutlineBox {
  int32_t x = 0, y = 0;           ///< first cell
  int32_t width = 0, height = 0;  ///< in cells; 0: the outline is not in the grid

  bool operator==(const OutlineBox&) const = default;
};

/// Cells of the corners of an outline.
struct CornerCells {
  static constexpr uint32_t kMax = 64;
  int32_t x[kMax], y[kMax];
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

/// The cells of all short edges, without their last ones, as 8 rows among empty ones. Reading from
/// an earlier row shifts a pattern, so drawing takes no branches, which would be unpredictable.
class EdgePatterns {
 public:
  static constexpr int32_t kLongest = 7;  // cells on each axis

  constexpr EdgePatterns() : rows_{} {
    for (int32_t dy = -kLongest; dy <= kLongest; dy++)
      for (int32_t dx = -kLongest; dx <= kLongest; dx++)
        ForEachCellOfEdge(dx, dy, [&](int32_t x, int32_t y) {
          const int32_t row = kFirst + y - std::min(dy, 0), column = x - std::min(dx, 0);
          rows_[dy + kLongest][dx + kLongest][row] |= static_cast<NarrowWord>(1 << column);
        });
  }
  static bool Has(int32_t dx, int32_t dy) {
    return static_cast<uint32_t>(dx + kLongest) < 2 * kLongest + 1 &&
           static_cast<uint32_t>(dy + kLongest) < 2 * kLongest + 1;
  }
  /// kNarrowSide rows, of which the pattern begins at `row`.
  const NarrowWord* At(int32_t dx, int32_t dy, int32_t row) const {
    return &rows_[dy + kLongest][dx + kLongest][kFirst - row];
  }

 private:
  static constexpr int32_t kSide = 16, kFirst = kNarrowSide - 1;
  NarrowWord rows_[kSide][kSide][2 * kNarrowSide];
};
inline constexpr EdgePatterns kEdgePatterns;

/// Sets the box to that of the corners.
inline void FindBox(const CornerCells& corners, uint32_t count, OutlineBox* box) {
  int32_t min_x = corners.x[0], max_x = min_x, min_y = corners.y[0], max_y = min_y;
  for (uint32_t i = 1; i < count; i++) {
    min_x = std::min(min_x, corners.x[i]);
    max_x = std::max(max_x, corners.x[i]);
    min_y = std::min(min_y, corners.y[i]);
    max_y = std::max(max_y, corners.y[i]);
  }
  *box = {min_x, min_y, max_x - min_x + 1, max_y - min_y + 1};
}

/// Draws the closed outline with these corners edge by edge. Returns false if all corners are in
/// one cell. `rows` has room for the height of the box and is all 0.
template <class Word>
bool DrawEdges(const CornerCells& corners, uint32_t count, const OutlineBox& box, Word* rows) {
  bool any = false;
  for (uint32_t i = 0, k = count - 1; i < count; k = i++) {
    const int32_t dx = corners.x[i] - corners.x[k], dy = corners.y[i] - corners.y[k];
    any |= (dx | dy) != 0;
    ForEachCellOfEdge(dx, dy, [&](int32_t x, int32_t y) {
      rows[corners.y[k] - box.y + y] |= static_cast<Word>(Word{1} << (corners.x[k] - box.x + x));
    });
  }
  return any;
}

/// Draws the closed outline with these corner cells, as grid::AppendOutline() does. `rows` has room
/// for kMaxSide words.
inline void DrawOutline(const CornerCells& corners, uint32_t count, OutlineBox* box,
                        WideWord* rows) {
  FindBox(corners, count, box);
  std::fill(rows, rows + box->height, 0);
  if (!DrawEdges(corners, count, *box, rows) && count > 2) rows[0] = 1;
}

/// DrawOutline() for narrow outlines. `rows` has room for kNarrowSide words; all are written.
inline void DrawOutline(const CornerCells& corners, uint32_t count, OutlineBox* box,
                        NarrowWord* rows) {
  typedef NarrowWord Rows __attribute__((vector_size(kNarrowSide * sizeof(NarrowWord))));
  FindBox(corners, count, box);
  Rows drawn = {};
  bool any = false, all_short = true;
  for (uint32_t i = 0, k = count - 1; i < count; k = i++) {
    const int32_t dx = corners.x[i] - corners.x[k], dy = corners.y[i] - corners.y[k];
    any |= (dx | dy) != 0;
    if (!EdgePatterns::Has(dx, dy)) {
      all_short = false;
      break;
    }
    Rows pattern;
    std::memcpy(&pattern, kEdgePatterns.At(dx, dy, std::min(corners.y[i], corners.y[k]) - box->y),
                sizeof pattern);
    drawn |= pattern << static_cast<NarrowWord>(std::min(corners.x[i], corners.x[k]) - box->x);
  }
  if (all_short) {
    std::memcpy(rows, &drawn, sizeof drawn);
  } else {
    std::fill(rows, rows + kNarrowSide, 0);
    any = DrawEdges(corners, count, *box, rows);
  }
  if (!any && count > 2) rows[0] = 1;
}

/// True if two outlines share a cell.
template <class Word>
bool Overlap(const OutlineBox& a, const Word* rows_of_a, const OutlineBox& b,
             const Word* rows_of_b) {
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
template <class Word>
bool MeetOutline(const OutlineBox& box, const Word* rows, const CellRay& ray, int32_t* borders_x,
                 int32_t* borders_y) {
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
