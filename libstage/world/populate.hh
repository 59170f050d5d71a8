// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_POPULATE_HH
#define STAGE_WORLD_POPULATE_HH

#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/free_floor.hh"
#include "models/model.hh"

namespace Stg {

/// Puts the members of the file's populations onto free ground, when all of its models have been
/// made and none is drawn. `made`: of each entity, or null. `cell`: the side of one, metres.
/// `floor`: that of an earlier world of the same file, or null; then it is looked for. Throws
/// LoadError if there is no room.
void PlacePopulations(const std::vector<Model*>& models, const std::vector<Model*>& made,
                      Worldfile* file, double cell, uint64_t seed,
                      std::shared_ptr<const geometry::FreeFloor>* floor);

}  // namespace Stg

#endif
