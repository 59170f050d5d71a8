// SPDX-License-Identifier: GPL-2.0-or-later
//
// World statistics shared by several reports.

#ifndef STAGE_TOOLS_STAGE_WORLD_FIGURES_HH
#define STAGE_TOOLS_STAGE_WORLD_FIGURES_HH

#include <cstddef>
#include <nlohmann/json.hpp>

#include "stage.hh"

namespace Stg::program {

/// Numbers of models.
struct ModelCounts {
  size_t models = 0, positions = 0, robots = 0;  ///< positions with subscribers
};
ModelCounts CountModels(World& world);

/// Returns an object of the metrics; null for a metric without a value.
nlohmann::ordered_json MetricsOf(const World& world);

}  // namespace Stg::program

#endif
