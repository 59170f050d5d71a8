// SPDX-License-Identifier: GPL-2.0-or-later
// Outlines of the dark regions of a picture.

#ifndef STAGE_GEOMETRY_TRACE_HH
#define STAGE_GEOMETRY_TRACE_HH

#include <cstdint>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "geometry/picture.hh"

namespace Stg {
namespace picture {

/// The closed outlines of the solid pixels (sample <= threshold), holes included as polygons of
/// their own, in pixels: x to the right, y upwards, the picture's top left corner at (0,0).
/// Order of polygons and vertices is part of the contract, as simulation results depend on it:
/// each polygon starts at the smallest corner left (by x, then by row), keeps the solid side on its
/// right, and at a corner with two ways on takes the one that leads to the smaller corner. Unit
/// steps in one direction are joined, except the first two steps with each other, and the one back
/// to the start with the one before it.
/// Throws std::invalid_argument if the raster does not have width * height samples.
std::vector<std::vector<point_t>> Trace(const Raster& raster, std::uint8_t threshold = 127);

}  // namespace picture

}  // namespace Stg

#endif  // STAGE_GEOMETRY_TRACE_HH
