// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calls of batch controllers for a row; part of stepper.hh. See BatchControls.

#include "rows/controls.hh"

#include <algorithm>
#include <cmath>

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
  for (std::vector<PlanarVelocity>* some : {&velocity, &command}) some->resize(robots);
  stalled.resize(robots);
  random.resize(robots);
  ranges.resize(sensors);
  all_poses.resize(controls.positions.size());
}

void Rows::Stepper::RunControls() {
  for (const ControlGroup& group : scene_.controls.groups) {
    GatherForControl(group);
    const double time = static_cast<double>(c_.time[world_]) / 1e6;
    const ControllerBatch batch = BatchOf(group, &time);
    group.controller->Step(batch);
    for (size_t i = 0; i < group.controls.size(); i++) {
      const size_t k = mover_ + group.controls[i].mover;
      const PlanarVelocity& command = batch.command[i];
      c_.random[k] = batch.random[i];
      if (!IsCommand(command)) continue;
      c_.command[k] = {command.x, command.y, command.a};
      c_.mode[k] = DriveInput::kVelocity;
    }
  }
}

void Rows::Stepper::GatherForControl(const ControlGroup& group) {
  ControlBuffers& b = s_.control;
  size_t sensor = 0;
  for (size_t i = 0; i < group.controls.size(); i++) {
    const Control& control = group.controls[i];
    const size_t k = mover_ + control.mover;
    b.sensed[i] = InPlane(c_.sensed[k]);
    const bool has_odometry = scene_.movers[control.mover].has_odometry;
    b.estimate[i] = InPlane(has_odometry ? c_.estimate[k] : c_.sensed[k]);
    b.velocity[i] = VelocityInPlane(c_.velocity[k]);
    b.command[i] = VelocityInPlane(c_.command[k]);
    b.stalled[i] = c_.stalled[k];
    b.random[i] = c_.random[k];
    for (const uint32_t first : control.first_rays)
      b.ranges[sensor++] = first == Control::kNoRays ? nullptr : &c_.ranges[ray_ + first];
  }
  if (!group.controller->needs_poses()) return;
  for (size_t i = 0; i < scene_.controls.positions.size(); i++) {
    const uint32_t mover = scene_.controls.positions[i];
    const std::vector<Planar>& poses = scene_.movers[mover].runs ? c_.sensed : c_.pose;
    b.all_poses[i] = InPlane(poses[mover_ + mover]);
  }
}

ControllerBatch Rows::Stepper::BatchOf(const ControlGroup& group, const double* time) {
  ControlBuffers& b = s_.control;
  ControllerBatch batch{};
  batch.worlds = 1;
  batch.robots = group.controls.size();
  batch.sensors = group.sensors;
  batch.all_robots = group.controller->needs_poses() ? b.all_poses.size() : 0;
  batch.robot = group.robot.data();
  batch.first_sensor = group.first_sensor.data();
  batch.own = group.own.data();
  batch.time = time;
  batch.sensed = b.sensed.data();
  batch.estimate = b.estimate.data();
  batch.velocity = b.velocity.data();
  batch.stalled = b.stalled.data();
  batch.ranges = b.ranges.data();
  batch.all_poses = b.all_poses.data();
  batch.command = b.command.data();
  batch.memory = c_.memory.data() + memory_ + group.first_memory;
  batch.random = b.random.data();
  return batch;
}

}  // namespace Stg::rows
