// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/estimate.hh"

#include <algorithm>

#include "stage/format.hh"

namespace Stg::program {

namespace {

constexpr double kMegabyte = 1024.0 * 1024.0;

/// Number of updates per step of all sensors of a kind.
double Updates(const SensorKind& kind) {
  return kind.subscribed ? static_cast<double>(kind.models) * kind.updates_per_step : 0;
}

/// Fills in kinds that were not measured, because there are too many: with the mean of their type,
/// or with the mean of all kinds if no kind of the type was measured.
std::vector<SensorCost> FillGaps(const SceneSummary& scene, std::vector<SensorCost> costs) {
  const std::vector<SensorCost> measured = costs;
  const auto mean_of = [&](const std::string& type, double SensorCost::*field) {
    double sum = 0, count = 0;
    for (size_t i = 0; i < measured.size(); i++) {
      if (measured[i].sample == 0 || !(type.empty() || scene.sensors[i].type == type)) continue;
      sum += measured[i].*field;
      count++;
    }
    return count > 0 ? sum / count : -1.0;
  };
  for (size_t i = 0; i < costs.size(); i++) {
    const SensorKind& kind = scene.sensors[i];
    if (costs[i].sample > 0 || !kind.subscribed) continue;
    const bool known = mean_of(kind.type, &SensorCost::update_ns) >= 0;
    for (const auto field : {&SensorCost::update_ns, &SensorCost::ray_ns, &SensorCost::read_ns,
                             &SensorCost::device_ray_ns})
      costs[i].*field = mean_of(known ? kind.type : "", field);
    costs[i].update_ns = std::max(0.0, costs[i].update_ns);
    costs[i].ray_ns = std::max(0.0, costs[i].ray_ns);
    costs[i].read_ns = std::max(0.0, costs[i].read_ns);
    costs[i].rays = static_cast<double>(kind.rays);
  }
  return costs;
}

void EstimateStep(const SceneSummary& scene, const StepCosts& costs, const RunOptions& options,
                  Estimate* e) {
  const std::vector<SensorCost> sensors = FillGaps(scene, costs.sensors);
  double rays = 0, gather = 0, pictures = 0, look = 0;  // nanoseconds
  for (size_t i = 0; i < scene.sensors.size(); i++) {
    const SensorKind& kind = scene.sensors[i];
    const SensorCost& cost = sensors[i];
    const double updates = Updates(kind), of_rays = updates * cost.rays * RayNs(cost, options);
    e->rays += updates * cost.rays;
    e->kind_ms.push_back((updates * cost.update_ns + of_rays) / 1e6);
    rays += of_rays;
    (kind.pixels > 0 ? pictures : gather) += updates * cost.update_ns;
    if (scene.callbacks_per_step > 0) look += updates * cost.read_ns;
  }
  const double robots = static_cast<double>(scene.robots);
  const double energy = static_cast<double>(scene.energy_models);
  const auto add = [e](const char* name, double ns, const std::string& text) {
    if (ns > 0) e->step.push_back({name, ns / 1e6, text});
    e->step_ms += ns / 1e6;
  };
  add("rays", rays, Count(e->rays, "ray") + Format(" x %.0f ns", e->rays > 0 ? rays / e->rays : 0));
  add("gather", gather, "sensors put their rays into the batch");
  add("pictures", pictures, "cameras");
  add("drive", scene.position_updates * costs.position_ns,
      Count(scene.position_updates, "update") + Format(" x %.0f ns", costs.position_ns));
  add("move", robots * costs.move_ns,
      Count(robots, "robot") + Format(" x %.0f ns, if all drive", costs.move_ns));
  add("callbacks", look, "stand-in: each reading looked at once; controllers may do more");
  add("energy", energy * costs.energy_ns,
      Count(energy, "model") + Format(" x %.0f ns", costs.energy_ns));
  add("fields", scene.field_cells * costs.field_cell_ns,
      Count(scene.field_cells, "cell") +
          Format(" x %.2f ns, if all rows have values", costs.field_cell_ns));
}

/// Cameras keep rendering buffers. Their size is measured where the system supports it.
double PicturesMb(const SceneSummary& scene, const StepCosts& costs) {
  double bytes = 0;
  for (size_t i = 0; i < scene.sensors.size(); i++)
    if (scene.sensors[i].pixels > 0 && scene.sensors[i].subscribed)
      bytes += static_cast<double>(scene.sensors[i].models * costs.sensors[i].kept_bytes);
  return std::max(bytes, static_cast<double>(scene.memory.pictures)) / kMegabyte;
}

void EstimateMemory(const SceneSummary& scene, const StepCosts& costs, const MemoryReadings& read,
                    Estimate* e) {
  const auto add = [e](const char* name, double mb, const char* text) {
    if (mb != 0) e->memory.push_back({name, mb, text});
    e->memory_mb += mb;
  };
  const auto mb = [](uint64_t bytes) { return static_cast<double>(bytes) / kMegabyte; };
  const MemoryCount& m = scene.memory;
  add("program", read.before, "the program, its libraries, worlds before this one");
  add("grid", mb(m.grid), "cells, and the layers so far");
  add("bodies", mb(m.bodies), "polygons, and where they are drawn");
  add("models", mb(m.models), "models and sensors");
  const double other = read.after - read.before - mb(m.grid + m.bodies + m.models);
  add("other", other,
      other < 0              ? "counted above, but not touched yet"
      : scene.device.empty() ? "world file, names, controllers, heap"
                             : "world file, names, controllers, OpenCL, heap");
  add("layers", mb(m.layers), "allocated during the run: layers of the grid, for rangers");
  add("readings", mb(m.readings), "allocated during the run: readings of rangers");
  add("pictures", PicturesMb(scene, costs),
      "allocated during the run: pictures of cameras, and rendering buffers");
  add("batch", mb(m.batch), "allocated during the run: rays and due updates of a step");
  add("device", costs.device_bytes_per_ray * e->rays / kMegabyte,
      "allocated during the run: lists of hits");
  e->peak_mb = std::max(e->memory_mb, read.peak);
}

}  // namespace

double RayNs(const SensorCost& cost, const RunOptions& options) {
  if (cost.device_ray_ns < 0) return cost.ray_ns;
  if (options.always_on_device || cost.ray_ns <= 0) return cost.device_ray_ns;
  return std::min(cost.ray_ns, cost.device_ray_ns);
}

Estimate MakeEstimate(const SceneSummary& scene, const StepCosts& costs,
                      const MemoryReadings& memory, const RunOptions& options) {
  Estimate e;
  EstimateStep(scene, costs, options, &e);
  EstimateMemory(scene, costs, memory, &e);
  return e;
}

}  // namespace Stg::program
