// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rotation of points in the plane.

#ifndef STAGE_GEOMETRY_ROTATED_HH
#define STAGE_GEOMETRY_ROTATED_HH

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"

namespace Stg {

/// Rotates a point about the origin, counter-clockwise by the angle of `turn`.
inline point_t Rotated(const point_t& p, const SineCosine& turn) {
  return point_t(p.x * turn.cosine - p.y * turn.sine, p.x * turn.sine + p.y * turn.cosine);
}

}  // namespace Stg

#endif
