// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where a ray meets an outline, in real numbers: the geometry of the exact ray model.

#ifndef STAGE_SENSING_CROSSING_HH
#define STAGE_SENSING_CROSSING_HH

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "sensing/fan.hh"

namespace Stg::internal::sensing {

/// A ray without an end; metres, and a direction of length 1.
struct Line {
  double x, y;
  SineCosine direction;
};

/// That of a ray of the fan.
inline Line LineOf(const Fan& fan, const SineCosine& turn) {
  const SineCosine& heading = fan.heading;
  return {fan.x,
          fan.y,
          {.sine = heading.sine * turn.cosine + heading.cosine * turn.sine,
           .cosine = heading.cosine * turn.cosine - heading.sine * turn.sine}};
}

/// How far the coordinates of a point, seen from another, may be off by rounding, metres: eight
/// units in the last place, for turning a body and for two products after that. Static, as
/// wide_walk_lanes.hh says.
static inline double RoundingAt(const point_t& p, double x, double y) {
  return 8 * 0x1p-52 *
         (__builtin_fabs(p.x) + __builtin_fabs(p.y) + __builtin_fabs(x) + __builtin_fabs(y));
}

/// How far along the line it first meets one of some edges: bit i stands for that from points[i] to
/// points[i + 1]; infinity if it meets none. Ends belong to edges, and a point counts as on the
/// line if the rounding of its coordinates could have moved it off: so no ray slips between two
/// edges that share a corner, and one that runs along an edge meets it at its nearer end. A line
/// that starts on an edge meets it there, at 0.
double FirstCrossing(const Line& line, const point_t* points, uint32_t edges);

/// How much of a leg lies before a place so many metres from its start.
inline double ShareOfLeg(double distance, double leg_length) {
  return std::clamp(distance / leg_length, 0.0, 1.0);
}
/// Where a walk ends after this share of a leg of `size`, as ray_t has it: nothing that lies
/// behind is of interest any more.
inline int LimitOf(double share, int size) { return static_cast<int>(share * size) + 1; }

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
