// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_POPULATE_HH
#define STAGE_WORLD_POPULATE_HH

#include <cstdint>
#include <vector>

#include "models/model.hh"

namespace Stg {

/// Puts the members of the file's populations onto free ground, when all of its models have been
/// made and none is drawn. `made`: of each entity, or null. `cell`: the side of one, metres. Throws
/// LoadError if there is no room.
void PlacePopulations(const std::vector<Model*>& models, const std::vector<Model*>& made,
                      Worldfile* file, double cell, uint64_t seed);

}  // namespace Stg

#endif
