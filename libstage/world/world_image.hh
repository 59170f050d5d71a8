// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loaded data that copies of a world share, so that they need not read files, trace pictures or
// rasterize scenery: see World::LoadCopy().

#ifndef STAGE_WORLD_WORLD_IMAGE_HH
#define STAGE_WORLD_WORLD_IMAGE_HH

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "grid/grid.hh"
#include "models/body.hh"
#include "models/host.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

struct PopulationPlan;

struct WorldImage {
  std::string path;
  std::unique_ptr<const Worldfile> file;
  Host::Outlines outlines;
  Host::Samples samples;
  std::shared_ptr<const PopulationPlan> populations;  ///< null without populations
  /// Bodies of models of the file that are unchanged since loading, at their poses at that time.
  grid::Grid grid;
  std::vector<std::vector<BlockGroup::Rasterization>> rasterizations;  ///< by entity of the file
  /// See WorldEngine.
  uint64_t last_stamp_of_loading;
  grid::CellBox extent_of_loading;
};

}  // namespace Stg

#endif
