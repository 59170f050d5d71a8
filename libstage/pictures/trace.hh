// SPDX-License-Identifier: GPL-2.0-or-later
// Traces the outlines of the dark regions of a picture.

#ifndef STAGE_PICTURES_TRACE_HH
#define STAGE_PICTURES_TRACE_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "pictures/picture.hh"

namespace Stg {
namespace picture {

/// Maximum number of corners in a picture. Real floor plans have some ten thousand; speckle makes
/// more, and each corner takes memory and time in the world.
inline constexpr std::size_t kMaxCorners = 500'000;

/// Returns the closed outlines of the solid pixels, in pixels: x to the right, y upwards, the top
/// left corner of the picture at (0, 0). Holes are separate polygons. The order of polygons and
/// vertices is fixed, since simulation results depend on it. A polygon starts at the smallest
/// remaining corner (by x, then by row), keeps the solid side on its right and, where two ways lead
/// on, takes the one to the smaller corner. Unit steps in one direction are merged, except the
/// first two and the last two. Throws LoadError (exit status 255) beyond kMaxCorners.
std::vector<std::vector<point_t>> Trace(const Bitmap& bitmap);

/// Traces one picture after the other. Its memory is kept, so nothing is allocated for a picture
/// with no more corners than one before.
class Tracer {
 public:
  /// A corner between pixels. Rows are counted from the top.
  struct Corner {
    int x, row;
  };
  /// See picture::Trace().
  void Trace(const Bitmap& bitmap);
  /// The corners of all polygons, and for each polygon the end of its corners.
  std::span<const Corner> corners() const { return corners_; }
  std::span<const std::uint32_t> ends() const { return ends_; }

  /// 64 corners between two rows of pixels, one bit each.
  struct CornerWords {
    std::uint64_t edges[4];   ///< by direction
    std::uint64_t turns;      ///< outline changes its direction
    std::uint64_t crossings;  ///< two outlines, or two parts of one, touch
  };

 private:
  /// A corner where outlines turn. An edge from one runs straight to the next one in its row or
  /// column. Turns are numbered row by row.
  struct Turn {
    std::uint16_t x, row;
    std::uint32_t column_place;  ///< index in by_column_
    std::uint8_t edges;          ///< edges not yet in a polygon, one bit per direction
  };
  void AddRow(std::size_t row, const std::uint64_t* above, const std::uint64_t* below,
              std::size_t width);
  void AddCorners(std::size_t x, std::size_t row, const CornerWords& words);
  void SortByColumn(std::size_t width);
  void ExtractPolygon(std::uint32_t start);
  unsigned ExtractEdge(std::uint32_t* at);

  std::vector<Turn> turns_;
  std::vector<std::uint32_t> by_column_;  // indices of turns, sorted by x, then by row
  std::vector<std::uint32_t> next_;
  std::vector<Corner> corners_;
  std::vector<std::uint32_t> ends_;
  std::size_t count_ = 0;  // corners of all polygons
};

/// The outlines of a picture, and its size.
struct Outlines {
  std::vector<std::vector<point_t>> polygons;  ///< see Trace()
  int width = 0, height = 0;                   ///< pixels
};

/// Reads and traces the picture file at `path`. Errors start with its path.
Outlines OutlinesOf(const std::string& path);
/// Does the same with the content of a picture file. Errors start with `name`.
Outlines OutlinesOf(const std::string& content, const std::string& name);

}  // namespace picture

}  // namespace Stg

#endif  // STAGE_PICTURES_TRACE_HH
