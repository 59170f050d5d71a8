// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/world_statistics.hh"

#include <cmath>

namespace Stg::program {

namespace {

void Count(const Ancestor& parent, const Model* ground, ModelCounts* counts) {
  for (const Model* model : parent.GetChildren()) {
    if (model == ground) continue;
    const bool driven = model->HasSubscribers();
    const bool position = dynamic_cast<const ModelPosition*>(model) != nullptr;
    counts->models++;
    counts->positions += position;
    counts->robots += position && driven;
    Count(*model, ground, counts);
  }
}

}  // namespace

ModelCounts CountModels(World& world) {
  ModelCounts counts;
  Count(world, world.GetGround(), &counts);
  return counts;
}

nlohmann::ordered_json MetricsOf(const World& world) {
  auto metrics = nlohmann::ordered_json::object();
  for (const NamedMetric& metric : world.Metrics())
    metrics[metric.name] = std::isfinite(metric.value) ? nlohmann::ordered_json(metric.value)
                                                       : nlohmann::ordered_json();
  return metrics;
}

}  // namespace Stg::program
