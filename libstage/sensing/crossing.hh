// SPDX-License-Identifier: GPL-2.0-or-later
//
// Intersection of a ray with an outline in floating point: the geometry of the exact ray model.

#ifndef STAGE_SENSING_CROSSING_HH
#define STAGE_SENSING_CROSSING_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "sensing/fan.hh"

namespace Stg::internal::sensing {

/// A half-line: start in metres, direction of length 1.
struct Line {
  double x, y;
  SineCosine direction;
};

/// The half-line of the fan's ray with this turn.
inline Line LineOf(const Fan& fan, const SineCosine& unit_vector) {
  const SineCosine& heading = fan.heading;
  return {fan.x,
          fan.y,
          {.sine = heading.sine * unit_vector.cosine + heading.cosine * unit_vector.sine,
           .cosine = heading.cosine * unit_vector.cosine - heading.sine * unit_vector.sine}};
}

/// Bound of the rounding error, in metres, of a point's coordinates relative to (x, y): eight units
/// in the last place, for rotating a body and for two products. Static, see wide_walk_lanes.hh.
static inline double RoundingAt(const point_t& p, double x, double y) {
  return 8 * 0x1p-52 *
         (__builtin_fabs(p.x) + __builtin_fabs(p.y) + __builtin_fabs(x) + __builtin_fabs(y));
}

/// Distance along the line to the first of some edges: bit i selects the edge from points[i] to
/// points[i + 1]. Returns infinity if the line meets none. Edges include their ends, and a point
/// counts as on the line if rounding could have moved it off. So no ray slips between edges that
/// share a corner, and a ray along an edge meets its nearer end. A line that starts on an edge
/// meets it at 0.
double FirstCrossing(const Line& line, const point_t* points, uint32_t edges);

/// Fraction of a leg that lies before `distance` (in metres from the start of the leg).
inline double FractionOfLeg(double distance, double leg_length) {
  return std::clamp(distance / leg_length, 0.0, 1.0);
}
/// Limit for ray_t after this fraction of a leg of `size`: cells behind it need not be visited.
inline int BorderLimit(double leg_fraction, int size) {
  return static_cast<int>(leg_fraction * size) + 1;
}

/// Conservative rejection test: true if the line up to `end` metres surely misses the circle.
inline bool PassesBy(const Line& line, const point_t& centre, double radius, double end) {
  const double dx = centre.x - line.x, dy = centre.y - line.y;
  const double along = line.direction.cosine * dx + line.direction.sine * dy;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  // Far above any rounding error.
  const double reach =
      radius + 1e-9 +
      1e-13 * (std::fabs(centre.x) + std::fabs(centre.y) + std::fabs(line.x) + std::fabs(line.y));
  return std::fabs(side) > reach || along + reach < 0 || along - reach > end;
}

}  // namespace Stg::internal::sensing

#endif
