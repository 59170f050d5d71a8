// SPDX-License-Identifier: GPL-2.0-or-later
//
// The scenery of a world as a map.

#ifndef STAGE_RECORDING_OCCUPANCY_MAP_HH
#define STAGE_RECORDING_OCCUPANCY_MAP_HH

#include <vector>

#include "models/model.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

/// What stands there and stays: the outlines of bodies that robots run into or rangers see, without
/// robots and what grippers may carry away. `cell`: wanted; cells are larger if there would be more
/// than four million. No cells if there is no such body.
OccupancyMap MapOf(const std::vector<Model*>& models, double cell);

}  // namespace Stg::recording

#endif
