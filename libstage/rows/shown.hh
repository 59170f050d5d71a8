// SPDX-License-Identifier: GPL-2.0-or-later
//
// Conditions for the maps of cells of what stands: a body is there if it blocks a mover, or if a
// sensor may see it.

#ifndef STAGE_ROWS_SHOWN_HH
#define STAGE_ROWS_SHOWN_HH

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "models/model.hh"
#include "sensing/fan.hh"

namespace Stg::rows {

/// True if a body of a model that stands is in the way of a mover's body with this height.
inline bool Blocks(const Model& model, const internal::grid::Body& body, const Bounds& height) {
  return !body.exact() && model.vis.obstacle_return && body.z_min <= height.max &&
         body.z_max >= height.min;
}

/// True if rays of a ranger at height z may see the body.
inline bool IsSeenAt(const internal::grid::Body& body, double z) {
  return body.ranger_visible && body.z_min <= z && z <= body.z_max;
}

/// True if a model of that height stops the rays of a finder's fan.
inline bool Stops(const internal::sensing::Fan& fan, const Bounds& height, const Model& model) {
  return !(fan.z_test && (fan.z < height.min || fan.z > height.max)) &&
         fan.predicate(const_cast<Model*>(&model), nullptr, nullptr);
}

}  // namespace Stg::rows

#endif
