// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/device_controls.hh"

#include <algorithm>

#include "messages/report.hh"
#include "models/position.hh"

namespace Stg::rows {

std::string WhyNotControls(const Scene& scene) {
  for (const ControlGroup& group : scene.controls.groups)
    for (const Control& control : group.controls)
      if (!control::StockParametersOf(group.controller, *control.robot))
        return "the controller of " +
               messages::Quoted(scene.movers[control.mover].model->TokenStr()) + " is not built in";
  return "";
}

DeviceControls::DeviceControls(const Scene& scene) {
  bool needs_poses = false;
  for (const ControlGroup& group : scene.controls.groups) {
    for (size_t i = 0; i < group.controls.size(); i++) Add(group, i);
    needs_poses = needs_poses || group.controller->needs_poses();
    needs_velocities_ = needs_velocities_ || group.controller->needs_velocities();
  }
  if (needs_poses || needs_velocities_) positions_ = scene.controls.positions;
  GroupByRobot();
}

void DeviceControls::Add(const ControlGroup& group, size_t index) {
  const Control& control = group.controls[index];
  const control::StockParameters& parameters =
      *control::StockParametersOf(group.controller, *control.robot);
  row_control_t record = parameters.record;
  record.mover = control.mover;
  record.memory = group.first_memory + static_cast<uint32_t>(index) * group.memory_size;
  record.own = group.own[index];
  if (!control.first_rays.empty()) {
    record.first_ray = std::ranges::min(control.first_rays);
    record.rays = static_cast<uint32_t>(control.robot->sensors[0].bearings.size());
  }
  if (parameters.layout) record.layout = FindLayout(parameters, control, record.first_ray);
  records_.push_back(record);
}

uint32_t DeviceControls::FindLayout(const control::StockParameters& parameters,
                                    const Control& control, uint32_t first_ray) {
  std::vector<uint32_t> offsets;
  for (const uint32_t first : control.first_rays)
    offsets.push_back(first == Control::kNoRays ? 0 : first - first_ray);
  const auto [place, is_new] =
      known_layouts_.try_emplace({parameters.layout.get(), offsets},
                                 static_cast<uint32_t>(layouts_.size() * sizeof(layouts_[0])));
  if (!is_new) return place->second;
  const control::RayLayout layout(control.robot->sensors, offsets, parameters.horizon);
  layouts_.insert(layouts_.end(), layout.words().begin(), layout.words().end());
  return place->second;
}

uint32_t DeviceControls::SectorsOf(const row_control_t& record) const {
  const auto* const bytes = reinterpret_cast<const row_byte*>(layouts_.data());
  return reinterpret_cast<const row_layout_t*>(bytes + record.layout)->sector_count;
}

/// Puts the controllers of each robot side by side, in the order of their calls.
void DeviceControls::GroupByRobot() {
  std::ranges::stable_sort(records_, {}, &row_control_t::mover);
  for (uint32_t i = 0; i < records_.size(); i++) {
    row_control_t& record = records_[i];
    if (i == 0 || record.mover != records_[i - 1].mover) driven_.push_back({i, i});
    driven_.back().end_control = i + 1;
    if (record.kind != ROW_DISPERSE) continue;
    record.first_look = static_cast<uint32_t>(look_of_.size());
    look_of_.insert(look_of_.end(), SectorsOf(record), i);
  }
}

}  // namespace Stg::rows
