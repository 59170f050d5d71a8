// SPDX-License-Identifier: GPL-2.0-or-later
//
// Simplifies the polyline of a sensor's ray ends: most rays end on straight walls, so most points
// can be dropped without a visible change.

#ifndef STAGE_GUI_DRAW_FAN_POLYLINE_HH
#define STAGE_GUI_DRAW_FAN_POLYLINE_HH

#include <cstddef>
#include <vector>

namespace Stg::draw {

/// A ray's end in the sensor's frame, metres: x ahead, y to the left.
struct RayEnd {
  float x, y;
};

/// Unit vectors of a sensor's rays, from its bearings.
struct Directions {
  std::vector<float> x, y;
};
Directions DirectionsOf(const std::vector<double>& bearings);

/// Appends the simplified polyline of the ray ends to `ray_ends` and returns the number of points
/// added. It keeps the first and the last point; no dropped point is further than `tolerance`
/// metres from the line. Ranges above `longest` are clamped to it.
std::size_t AppendSimplified(const std::vector<double>& ranges, const Directions& directions,
                             float longest, float tolerance, std::vector<RayEnd>* ray_ends);

}  // namespace Stg::draw

#endif
