// SPDX-License-Identifier: GPL-2.0-or-later

#include <nlohmann/json.hpp>

#include "stage/explain.hh"
#include "stage/option_json.hh"

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

Json Types(const SceneSummary& s) {
  Json list = Json::array();
  for (const ModelKind& kind : s.types)
    list.push_back({{"type", kind.type}, {"models", kind.models}, {"running", kind.running}});
  return list;
}

Json Sensors(const Explanation& e, const RunOptions& options) {
  Json list = Json::array();
  for (size_t i = 0; i < e.scene.sensors.size(); i++) {
    const SensorKind& kind = e.scene.sensors[i];
    const SensorCost& cost = e.costs.sensors[i];
    Json json = {{"type", kind.type},
                 {"example", kind.example},
                 {"subscribed", kind.subscribed},
                 {"models", kind.models},
                 {"parts", kind.parts},
                 {"rays", kind.rays_vary ? Json(nullptr) : Json(kind.rays)},
                 {"pixels", kind.pixels},
                 {"update_interval_ms", static_cast<double>(kind.interval) / 1e3},
                 {"updates_per_step", kind.subscribed ? kind.updates_per_step : 0},
                 {"rays_per_step", kind.subscribed ? kind.RaysPerStep() : 0},
                 {"ms_per_step", e.estimate.kind_ms[i]}};
    if (cost.sample > 0)
      json["measured"] = {
          {"models", cost.sample},
          {"rays", cost.rays},
          {"update_ns", cost.update_ns},
          {"ray_ns", cost.ray_ns},
          {"device_ray_ns", cost.device_ray_ns < 0 ? Json(nullptr) : Json(cost.device_ray_ns)},
          {"chosen_ray_ns", RayNs(cost, options)},
          {"read_ns", cost.read_ns}};
    list.push_back(json);
  }
  return list;
}

Json Heights(const SceneSummary& s) {
  Json list = Json::array();
  for (const SensedHeight& height : s.heights)
    list.push_back({{"z", height.z},
                    {"sensors", height.sensors},
                    {"idle_sensors", height.idle_sensors},
                    {"rays_per_step", height.rays_per_step},
                    {"blocks", height.blocks},
                    {"robots", height.robots}});
  return list;
}

Json Bodies(const SceneSummary& s) {
  return {{"models", s.bodies},
          {"blocks", s.blocks},
          {"corners", s.corners},
          {"hidden_from_rangers", s.hidden_blocks},
          {"at_heights_not_sensed", s.overlooked_blocks},
          {"unseen_models", s.unseen_bodies},
          {"unseen_examples", s.unseen_examples},
          {"sensors_that_look_at_all", s.looking_everywhere},
          {"exact_sensors", s.exact_sensors}};
}

Json Grid(const SceneSummary& s) {
  return {{"resolution", s.resolution},
          {"extent", {s.extent.x.min, s.extent.x.max, s.extent.y.min, s.extent.y.max}},
          {"plane_cells", s.plane_cells},
          {"occupied_cells", s.occupied_cells},
          {"superregions", s.superregions},
          {"regions", s.regions},
          {"tiles", s.tiles},
          {"layers", s.layers},
          {"layers_of_one_height", s.layer_heights},
          {"bytes", s.memory.grid},
          {"layer_bytes_to_come", s.memory.layers},
          {"dense_bytes", s.dense_bytes}};
}

Json Parts(const std::vector<CostPart>& parts) {
  Json json = Json::object();
  for (const CostPart& part : parts) json[part.name] = part.value;
  return json;
}

Json Costs(const StepCosts& c) {
  const auto known = [](size_t sample, double ns) { return sample > 0 ? Json(ns) : Json(nullptr); };
  return {{"position_update_ns", known(c.position_sample, c.position_ns)},
          {"move_ns", known(c.move_sample, c.move_ns)},
          {"energy_ns", known(c.energy_sample, c.energy_ns)},
          {"field_cell_ns", known(c.field_sample, c.field_cell_ns)},
          {"busy", c.busy},
          {"rays_traced", c.rays},
          {"seconds", c.seconds}};
}

Json Describe(const Explanation& e, const RunOptions& options) {
  const SceneSummary& s = e.scene;
  const Estimate& estimate = e.estimate;
  return {{"worldfile", e.file},
          {"models", s.models},
          {"robots", s.robots},
          {"undriven_robots", s.undriven},
          {"models_with_controller", s.with_controller},
          {"types", Types(s)},
          {"sensors", Sensors(e, options)},
          {"heights", Heights(s)},
          {"bodies", Bodies(s)},
          {"grid", Grid(s)},
          {"power_packs", s.power_packs},
          {"energy_models", s.energy_models},
          {"fields", s.fields},
          {"field_cells_per_step", s.field_cells},
          {"trails", s.records_trails},
          {"window", s.has_window},
          {"opencl", s.device.empty() ? Json(nullptr) : Json(s.device)},
          {"threads", s.threads},
          {"threads_chosen", s.chooses_threads},
          {"step_seconds", static_cast<double>(s.step) / 1e6},
          {"updates_per_step", s.updates_per_step},
          {"callbacks_per_step", s.callbacks_per_step},
          {"steps", e.steps > 0 ? Json(e.steps) : Json(nullptr)},
          {"closed", e.why_not_closed.empty()},
          {"not_closed_because", e.why_not_closed.empty() ? Json(nullptr) : Json(e.why_not_closed)},
          {"rays_per_step", estimate.rays},
          {"ms_per_step", estimate.step_ms},
          {"ms_per_step_now", estimate.step_ms * e.costs.busy},
          {"step_ms", Parts(estimate.step)},
          {"memory_mb", Parts(estimate.memory)},
          {"peak_memory_mb", estimate.peak_mb},
          {"measured", Costs(e.costs)},
          {"doubts", s.load_warnings},
          {"hints", Hints(e)}};
}

}  // namespace

std::string ExplanationJson(const std::vector<Explanation>& worlds, const RunOptions& options) {
  Json json = {{"program", "stage"}, {"version", Version()}, {"options", ToJson(options)}};
  Json list = Json::array();
  for (const Explanation& world : worlds) list.push_back(Describe(world, options));
  if (list.size() == 1)
    json.update(list[0]);
  else
    json["worlds"] = list;
  // File names may be invalid UTF-8 or contain control characters; the output is plain ASCII.
  return json.dump(2, ' ', true, Json::error_handler_t::replace) + "\n";
}

}  // namespace Stg::program
