// SPDX-License-Identifier: GPL-2.0-or-later
//
// Batch controllers on the way between worlds and rows.

#include <algorithm>
#include <cstring>
#include <string>

#include "messages/assert.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"

namespace Stg {

/// Says why rows cannot hold the controllers of a world; empty if they can.
std::string RowBridge::WhyNotControls(const World& world) {
  for (const DrivenGroup& group : world.engine_->batch_controls.Groups(*world.engine_))
    for (const DrivenRobot* driven : group.robots) {
      if (!rows::IsRobot(*driven->model))
        return rows::Named(*driven->model) + " has a controller and is of a type of its own";
      if (!driven->model->HasSubscribers())
        return rows::Named(*driven->model) + " has a controller and no subscribers";
      for (const DrivenRobot::SensorPlace& place : driven->sensors)
        if (!place.ranger || !place.ranger->HasSubscribers())
          return "a ranger of the controller of " + rows::Named(*driven->model) + " is not running";
    }
  return "";
}

/// Finds the controllers. The sensors of the scene are known.
void RowBridge::AddControls(const World& prototype, rows::Scene* scene) {
  rows::Controls& controls = scene->controls;
  const auto mover_of = [&](const Model* model) {
    const auto found = std::ranges::find(scene->movers, model, &rows::Mover::model);
    STAGE_ASSERT(found != scene->movers.end());
    return static_cast<uint32_t>(found - scene->movers.begin());
  };
  for (uint32_t k = 0; k < scene->movers.size(); k++)
    if (scene->movers[k].robot) controls.positions.push_back(k);
  for (const DrivenGroup& driven : prototype.engine_->batch_controls.Groups(*prototype.engine_)) {
    rows::ControlGroup group{};
    group.controller = driven.controller;
    group.first_memory = controls.memory_count;
    group.memory_size = static_cast<uint32_t>(driven.controller->memory_size());
    for (const DrivenRobot* robot : driven.robots) {
      rows::Control control{mover_of(robot->model), &robot->robot, {}, {}};
      for (const DrivenRobot::SensorPlace& place : robot->sensors) {
        rows::Sensor* const sensor = FindSensor(scene, place.ranger, place.index);
        if (sensor) sensor->needed = scene->needs_rays = true;
        control.first_rays.push_back(sensor ? sensor->first_ray : rows::Control::kNoRays);
        control.rates.push_back(sensor ? sensor->rate : 0);
      }
      group.robot.push_back(control.robot);
      group.first_sensor.push_back(group.sensors);
      group.own.push_back(
          static_cast<uint32_t>(std::ranges::lower_bound(controls.positions, control.mover) -
                                controls.positions.begin()));
      group.sensors += static_cast<uint32_t>(control.first_rays.size());
      group.rates |= 1u << scene->movers[control.mover].rate;
      group.everyone.push_back(static_cast<uint32_t>(group.controls.size()));
      group.controls.push_back(std::move(control));
    }
    controls.memory_count += group.memory_size * static_cast<uint32_t>(group.controls.size());
    controls.groups.push_back(std::move(group));
  }
}

/// Returns null if the sensor has no rays.
rows::Sensor* RowBridge::FindSensor(rows::Scene* scene, const ModelRanger* ranger, uint32_t index) {
  for (rows::Sensor& sensor : scene->sensors)
    if (sensor.ranger == ranger && sensor.index == index) return &sensor;
  return nullptr;
}

/// Calls f(robot of the world, mover, its numbers in the row) for each robot with a controller.
/// Returns false if the world has other controllers than the scene.
template <typename F>
bool RowBridge::ForEachControl(const World& world, const rows::Scene& scene, F f) {
  const auto& groups = world.engine_->batch_controls.Groups(*world.engine_);
  if (groups.size() != scene.controls.groups.size()) return false;
  for (size_t g = 0; g < groups.size(); g++) {
    const rows::ControlGroup& group = scene.controls.groups[g];
    if (groups[g].controller != group.controller ||
        groups[g].robots.size() != group.controls.size())
      return false;
    for (size_t i = 0; i < group.controls.size(); i++) {
      DrivenRobot& driven = *groups[g].robots[i];
      if (driven.robot.id != group.controls[i].robot->id) return false;
      f(driven, group.controls[i].mover, group.first_memory + i * group.memory_size);
    }
  }
  return true;
}

bool RowBridge::ReadControls(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  return ForEachControl(
      world, scene, [&](const DrivenRobot& driven, uint32_t mover, size_t memory) {
        c.random[row * scene.movers.size() + mover] = driven.model->random_.Copy();
        std::ranges::copy(driven.memory,
                          c.memory.begin() + static_cast<std::ptrdiff_t>(
                                                 row * scene.controls.memory_count + memory));
      });
}

void RowBridge::WriteControls(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  [[maybe_unused]] const bool same =
      ForEachControl(*world, scene, [&](DrivenRobot& driven, uint32_t mover, size_t memory) {
        WriteRandom(c.random[row * scene.movers.size() + mover], driven.model);
        std::copy_n(c.memory.begin() +
                        static_cast<std::ptrdiff_t>(row * scene.controls.memory_count + memory),
                    driven.memory.size(), driven.memory.begin());
      });
  STAGE_ASSERT(same);
}

/// A stream from which nothing was drawn is not made.
void RowBridge::WriteRandom(const RandomStream& random, Model* to) {
  const RandomStream fresh(to->random_.seed());
  if (std::memcmp(static_cast<const void*>(&random), static_cast<const void*>(&fresh),
                  sizeof random) != 0)
    to->random_.Get() = random;
}

}  // namespace Stg
