// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where a ray meets an outline, in real numbers: the geometry of the exact ray model.

#ifndef STAGE_SENSING_CROSSING_HH
#define STAGE_SENSING_CROSSING_HH

#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"

namespace Stg::internal::sensing {

/// A ray without an end; metres, and a direction of length 1.
struct Line {
  double x, y;
  SineCosine direction;
};

/// How far along the line it first meets one of the edges points[i] to points[i + 1], i from 0 to
/// edges - 1; infinity if it meets none. Ends belong to edges, and a point counts as on the line if
/// the rounding of its coordinates could have moved it off: so no ray slips between two edges that
/// share a corner, and one that runs along an edge meets it at its nearer end. A line that starts
/// on an edge meets it there, at 0.
double FirstCrossing(const Line& line, const point_t* points, uint32_t edges);

/// True if the line, up to `end` metres from its start, surely stays clear of the circle. A quick
/// look before a careful one.
inline bool PassesBy(const Line& line, const point_t& centre, double radius, double end) {
  const double dx = centre.x - line.x, dy = centre.y - line.y;
  const double along = line.direction.cosine * dx + line.direction.sine * dy;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  // Far above what rounding may amount to.
  const double reach =
      radius + 1e-9 +
      1e-13 * (std::fabs(centre.x) + std::fabs(centre.y) + std::fabs(line.x) + std::fabs(line.y));
  return std::fabs(side) > reach || along + reach < 0 || along - reach > end;
}

}  // namespace Stg::internal::sensing

#endif
