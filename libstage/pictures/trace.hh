// SPDX-License-Identifier: GPL-2.0-or-later
// Traces the outlines of the dark regions of a picture.

#ifndef STAGE_PICTURES_TRACE_HH
#define STAGE_PICTURES_TRACE_HH

#include <cstddef>
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
