// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_WORLD_POPULATE_HH
#define STAGE_WORLD_POPULATE_HH

#include <cstdint>
#include <memory>
#include <vector>

#include "geometry/free_floor.hh"
#include "models/model.hh"

namespace Stg {

/// Places the members of the file's populations on free floor. Call it when all models of the file
/// exist and none is rasterized. `made` has the model of each entity, or null. `cell` is the cell
/// size in metres. `floor` is the free floor of an earlier world of the same file; if null, it is
/// computed. Throws LoadError if there is not enough free floor.
void PlacePopulations(const std::vector<Model*>& models, const std::vector<Model*>& made,
                      Worldfile* file, double cell, uint64_t seed,
                      std::shared_ptr<const geometry::FreeFloor>* floor);

}  // namespace Stg

#endif
