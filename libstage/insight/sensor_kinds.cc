// SPDX-License-Identifier: GPL-2.0-or-later

#include "insight/sensor_kinds.hh"

#include <algorithm>
#include <map>
#include <tuple>

#include "models/model_type.hh"

namespace Stg {

namespace {

/// Fills in `kind`. Returns false if the model is not a sensor.
bool Describe(const Model& model, SensorKind* kind) {
  const ModelType* const type = FindNearestModelType(model);
  if (!type || !type->describe) return false;
  SensorExtent extent;
  type->describe(model, &extent);
  kind->type = type->name;
  kind->parts = extent.parts;
  kind->rays = extent.rays;
  kind->rays_vary = extent.rays_vary;
  kind->pixels = extent.pixels;
  return true;
}

auto KeyOf(const SensorKind& k) {
  return std::make_tuple(!k.subscribed, k.type, k.parts, k.rays, k.rays_vary, k.pixels, k.interval);
}

bool Before(const SensorGroup& a, const SensorGroup& b) {
  if (a.kind.subscribed != b.kind.subscribed) return a.kind.subscribed;
  const double rays_a = a.kind.RaysPerStep(), rays_b = b.kind.RaysPerStep();
  return rays_a != rays_b ? rays_a > rays_b : KeyOf(a.kind) < KeyOf(b.kind);
}

}  // namespace

double UpdatesPerStep(const Model& model, usec_t step) {
  // Long-run average; a model updates at most once per step.
  const double steps = static_cast<double>(model.GetUpdateInterval()) / static_cast<double>(step);
  return 1.0 / std::max(1.0, steps);
}

std::vector<SensorGroup> SortSensors(const std::vector<Model*>& models, usec_t step) {
  std::map<decltype(KeyOf(SensorKind())), SensorGroup> groups;
  for (Model* model : models) {
    SensorKind kind;
    if (!Describe(*model, &kind)) continue;
    kind.subscribed = model->HasSubscribers();
    kind.interval = model->GetUpdateInterval();
    kind.updates_per_step = UpdatesPerStep(*model, step);
    SensorGroup& group = groups[KeyOf(kind)];
    if (group.models.empty()) {
      group.kind = kind;
      group.kind.example = model->TokenStr();
    }
    group.models.push_back(model);
    group.kind.models++;
  }
  std::vector<SensorGroup> sorted;
  for (auto& [key, group] : groups) sorted.push_back(std::move(group));
  std::sort(sorted.begin(), sorted.end(), Before);
  return sorted;
}

}  // namespace Stg
