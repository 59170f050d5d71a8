// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_LOCALIZATION_HH
#define STAGE_MODELS_LOCALIZATION_HH

#include "geometry/geometry.hh"
#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"

namespace Stg {

/// The estimate of a robot that knows its global pose, in the frame of `origin`.
inline Pose EstimateIn(const Pose& origin, const Pose& global) {
  const point_t seen =
      Rotated(point_t(global.x - origin.x, global.y - origin.y), SinCos(-origin.a));
  return Pose(seen.x, seen.y, 0, normalize(global.a - origin.a));
}

}  // namespace Stg

#endif
