// SPDX-License-Identifier: GPL-2.0-or-later
//
// Figures of a world that several reports have.

#ifndef STAGE_TOOLS_STAGE_WORLD_FIGURES_HH
#define STAGE_TOOLS_STAGE_WORLD_FIGURES_HH

#include <cstddef>
#include <nlohmann/json.hpp>

#include "stage.hh"

namespace Stg::program {

/// Of models.
struct ModelCounts {
  size_t models = 0, positions = 0, robots = 0;  ///< robots: positions that somebody drives
};
ModelCounts CountModels(World& world);

/// An object; null for a metric that has no value.
nlohmann::ordered_json MetricsOf(const World& world);

}  // namespace Stg::program

#endif
