// SPDX-License-Identifier: GPL-2.0-or-later
// Outlines of the dark regions of a picture.

#ifndef STAGE_GEOMETRY_TRACE_HH
#define STAGE_GEOMETRY_TRACE_HH

#include <cstddef>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "geometry/picture.hh"

namespace Stg {
namespace picture {

/// What the outlines of a picture may have together. Those of real floor plans have some ten
/// thousand; speckle makes more, and each takes memory and time in the world.
inline constexpr std::size_t kMaxCorners = 500'000;

/// The closed outlines of the solid pixels, holes included as polygons of their own, in pixels: x
/// to the right, y upwards, the picture's top left corner at (0,0). Order of polygons and vertices
/// is part of the contract, as simulation results depend on it: each polygon starts at the smallest
/// corner left (by x, then by row), keeps the solid side on its right, and at a corner with two
/// ways on takes the one that leads to the smaller corner. Unit steps in one direction are joined,
/// except the first two steps with each other, and the one back to the start with the one before
/// it. Throws LoadError (exit status 255) if there are more than kMaxCorners.
std::vector<std::vector<point_t>> Trace(const Bitmap& bitmap);

/// The outlines of a picture, and the size of the picture that they were found in.
struct Outlines {
  std::vector<std::vector<point_t>> polygons;  ///< see Trace()
  int width = 0, height = 0;                   ///< pixels
};

/// The outlines of the picture file at `path`; its name stands before what is wrong with it.
Outlines OutlinesOf(const std::string& path);

}  // namespace picture

}  // namespace Stg

#endif  // STAGE_GEOMETRY_TRACE_HH
