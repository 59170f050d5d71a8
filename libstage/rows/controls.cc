// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calls of batch controllers for a row; part of stepper.hh. See BatchControls.

#include "rows/controls.hh"

#include <algorithm>
#include <cmath>

#include "control/all_robots.hh"
#include "rows/stepper.hh"

namespace Stg::rows {

namespace {

PlanarPose InPlane(const Planar& p) { return {p.x, p.y, p.a}; }
PlanarVelocity VelocityInPlane(const Planar& v) { return {v.x, v.y, v.a}; }

/// See ModelPosition::SetSpeed().
bool IsCommand(const PlanarVelocity& v) {
  return !(std::isnan(v.x) || std::isnan(v.y) || std::isnan(v.a));
}

}  // namespace

ControlBuffers::ControlBuffers(const Controls& controls) {
  size_t robots = 0, sensors = 0;
  for (const ControlGroup& group : controls.groups) {
    robots = std::max(robots, group.controls.size());
    sensors = std::max<size_t>(sensors, group.sensors);
  }
  for (std::vector<PlanarPose>* poses : {&sensed, &estimate}) poses->resize(robots);
  for (std::vector<PlanarVelocity>* each : {&velocity, &command}) each->resize(robots);
  stalled.resize(robots);
  random.resize(robots);
  ranges.resize(sensors);
  all_poses.resize(controls.positions.size());
  all_velocities.resize(controls.positions.size());
  for (std::vector<uint32_t>* numbers : {&some, &first_sensor, &own}) numbers->reserve(robots);
  robot.reserve(robots);
  memory.reserve(controls.memory_count);
}

void Rows::Stepper::RunControls() {
  for (const ControlGroup& group : scene_.controls.groups) {
    if ((group.rates & ~due_) == 0)
      CallController(group, group.everyone);
    else if (group.rates & due_)
      CallForSome(group);
  }
}

/// Calls a controller for those of its robots that have updated.
void Rows::Stepper::CallForSome(const ControlGroup& group) {
  ControlBuffers& b = s_.control;
  for (auto* const array : {&b.some, &b.first_sensor, &b.own}) array->clear();
  b.robot.clear();
  b.memory.clear();
  uint32_t sensors = 0;
  for (uint32_t i = 0; i < group.controls.size(); i++) {
    const Control& control = group.controls[i];
    if (!IsDue(scene_.movers[control.mover].rate)) continue;
    b.some.push_back(i);
    b.robot.push_back(group.robot[i]);
    b.own.push_back(group.own[i]);
    b.first_sensor.push_back(sensors);
    sensors += static_cast<uint32_t>(control.first_rays.size());
    const double* const memory = MemoryOf(group, i);
    b.memory.insert(b.memory.end(), memory, memory + group.memory_size);
  }
  CallController(group, b.some);
  for (size_t i = 0; i < b.some.size(); i++)
    std::copy_n(b.memory.data() + i * group.memory_size, group.memory_size,
                MemoryOf(group, b.some[i]));
}

void Rows::RunControls(size_t world, Scratch* scratch) {
  Stepper(this, world, scratch).RunControlsAfterStep();
}

/// Calls controllers of robots that updated in the last step. The models have one update interval.
void Rows::Stepper::RunControlsAfterStep() {
  if (c_.last_update[rate_] != c_.time[world_]) return;
  due_ = 1;
  RunControls();
}

/// The doubles that a controller keeps for robot i of a group.
double* Rows::Stepper::MemoryOf(const ControlGroup& group, size_t i) const {
  return c_.memory.data() + memory_ + group.first_memory + i * group.memory_size;
}

/// Calls a controller for these robots of a group.
void Rows::Stepper::CallController(const ControlGroup& group, std::span<const uint32_t> robots) {
  GatherForControl(group, robots);
  const double time = static_cast<double>(c_.time[world_]) / 1e6;
  const ControllerBatch batch = BatchOf(group, robots, &time);
  group.controller->Step(batch);
  for (size_t i = 0; i < robots.size(); i++) {
    const size_t k = mover_ + group.controls[robots[i]].mover;
    const PlanarVelocity& command = batch.command[i];
    c_.random[k] = batch.random[i];
    if (!IsCommand(command)) continue;
    c_.command[k] = {command.x, command.y, command.a};
    c_.mode[k] = DriveInput::kVelocity;
  }
}

void Rows::Stepper::GatherForControl(const ControlGroup& group, std::span<const uint32_t> robots) {
  ControlBuffers& b = s_.control;
  size_t next = 0;
  for (size_t i = 0; i < robots.size(); i++) {
    const Control& control = group.controls[robots[i]];
    const size_t k = mover_ + control.mover;
    b.sensed[i] = InPlane(c_.sensed[k]);
    const bool has_odometry = scene_.movers[control.mover].has_odometry;
    b.estimate[i] = InPlane(has_odometry ? c_.estimate[k] : c_.sensed[k]);
    b.velocity[i] = VelocityInPlane(c_.velocity[k]);
    b.command[i] = VelocityInPlane(c_.command[k]);
    b.stalled[i] = c_.stalled[k];
    b.random[i] = c_.random[k];
    for (size_t sensor = 0; sensor < control.first_rays.size(); sensor++) {
      const uint32_t first = control.first_rays[sensor];
      const bool has_readings =
          first != Control::kNoRays && c_.last_update[rate_ + control.rates[sensor]] > 0;
      b.ranges[next++] = has_readings ? &c_.ranges[ray_ + first] : nullptr;
    }
  }
  GatherAllRobots(*group.controller);
}

/// Finds the poses and velocities of all robots, as far as the controller needs them.
void Rows::Stepper::GatherAllRobots(const BatchController& controller) {
  ControlBuffers& b = s_.control;
  const bool needs_velocities = controller.needs_velocities();
  if (!controller.needs_poses() && !needs_velocities) return;
  for (size_t i = 0; i < scene_.controls.positions.size(); i++) {
    const uint32_t mover = scene_.controls.positions[i];
    const size_t k = mover_ + mover;
    const bool runs = scene_.movers[mover].runs;
    b.all_poses[i] = InPlane(runs ? c_.sensed[k] : c_.pose[k]);
    if (needs_velocities)
      b.all_velocities[i] = control::GlobalVelocity(
          b.all_poses[i].a, VelocityInPlane(c_.velocity[k]), !runs || c_.stalled[k]);
  }
}

ControllerBatch Rows::Stepper::BatchOf(const ControlGroup& group, std::span<const uint32_t> robots,
                                       const double* time) {
  ControlBuffers& b = s_.control;
  const bool all = robots.size() == group.controls.size();
  ControllerBatch batch{};
  batch.worlds = 1;
  batch.robots = robots.size();
  batch.sensors = group.sensors;
  if (!all) batch.sensors = b.first_sensor.back() + group.controls[robots.back()].first_rays.size();
  const bool needs_velocities = group.controller->needs_velocities();
  const bool needs_all = needs_velocities || group.controller->needs_poses();
  batch.all_robots = needs_all ? b.all_poses.size() : 0;
  batch.robot = all ? group.robot.data() : b.robot.data();
  batch.first_sensor = all ? group.first_sensor.data() : b.first_sensor.data();
  batch.own = all ? group.own.data() : b.own.data();
  batch.time = time;
  batch.sensed = b.sensed.data();
  batch.estimate = b.estimate.data();
  batch.velocity = b.velocity.data();
  batch.stalled = b.stalled.data();
  batch.ranges = b.ranges.data();
  batch.all_poses = b.all_poses.data();
  batch.all_velocities = needs_velocities ? b.all_velocities.data() : nullptr;
  batch.command = b.command.data();
  batch.memory = all ? MemoryOf(group, 0) : b.memory.data();
  batch.random = b.random.data();
  return batch;
}

}  // namespace Stg::rows
