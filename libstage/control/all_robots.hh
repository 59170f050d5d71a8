// SPDX-License-Identifier: GPL-2.0-or-later
//
// Velocities of all robots, for batch controllers.

#ifndef STAGE_CONTROL_ALL_ROBOTS_HH
#define STAGE_CONTROL_ALL_ROBOTS_HH

#include "control/batch_controller.hh"
#include "kernels/row_control.h"

namespace Stg::control {

/// See ControllerBatch::all_velocities.
inline PlanarVelocity GlobalVelocity(double heading, const PlanarVelocity& v, bool stands) {
  const row_planar_t global = row_global_velocity(heading, {v.x, v.y, v.a}, stands);
  return {global.x, global.y, global.a};
}

}  // namespace Stg::control

#endif
