// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_ROWS_PLANAR_HH
#define STAGE_ROWS_PLANAR_HH

#include "geometry/geometry.hh"

namespace Stg::rows {

/// A pose, velocity or command in the plane: m or m/s, rad or rad/s.
struct Planar {
  double x = 0, y = 0, a = 0;

  bool IsZero() const { return x == 0 && y == 0 && a == 0; }
  bool operator==(const Planar&) const = default;
};

inline Planar PlanarOf(const Pose& pose) { return {pose.x, pose.y, pose.a}; }
inline Pose PoseOf(const Planar& p, double z) { return Pose(p.x, p.y, z, p.a); }
inline Velocity VelocityOf(const Planar& v) { return Velocity(v.x, v.y, 0, v.a); }

}  // namespace Stg::rows

#endif
