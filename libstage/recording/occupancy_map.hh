// SPDX-License-Identifier: GPL-2.0-or-later
//
// Maps the scenery of a world.

#ifndef STAGE_RECORDING_OCCUPANCY_MAP_HH
#define STAGE_RECORDING_OCCUPANCY_MAP_HH

#include <vector>

#include "models/model.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

/// Returns a map of the bodies that obstruct robots or are visible to rangers, without robots and
/// objects that grippers can take. `cell` is the wanted cell size in metres; it is doubled until
/// there are at most four million cells. The map is empty if there are no such bodies.
OccupancyMap MakeOccupancyMap(const std::vector<Model*>& models, double cell);

}  // namespace Stg::recording

#endif
