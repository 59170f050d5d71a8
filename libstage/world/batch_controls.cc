// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/batch_controls.hh"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>
#include <utility>

#include "control/all_robots.hh"
#include "control/stock_controllers.hh"
#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "world/engine.hh"

namespace Stg {

namespace {

PlanarPose InPlane(const Pose& pose) { return {pose.x, pose.y, pose.a}; }
PlanarVelocity VelocityInPlane(const Pose& v) { return {v.x, v.y, v.a}; }

bool IsSame(const RandomStream& a, const RandomStream& b) {
  return std::memcmp(static_cast<const void*>(&a), static_cast<const void*>(&b), sizeof a) == 0;
}

/// The readings of a sensor; null if it has none or has been changed.
const double* RangesOf(const DrivenRobot& driven, size_t sensor) {
  const DrivenRobot::SensorPlace& place = driven.sensors[sensor];
  if (!place.ranger || place.index >= place.ranger->GetSensors().size()) return nullptr;
  const std::vector<double>& ranges = place.ranger->GetSensors()[place.index].ranges;
  const bool fits = ranges.size() == driven.robot.sensors[sensor].bearings.size();
  return fits && !ranges.empty() ? ranges.data() : nullptr;
}

}  // namespace

void BatchBuffers::Clear() {
  robot.clear();
  first_sensor.clear();
  own.clear();
  sensed.clear();
  estimate.clear();
  velocity.clear();
  command.clear();
  stalled.clear();
  ranges.clear();
  memory.clear();
  random.clear();
}

ControllerBatch BatchBuffers::Batch(const double* time, const AllRobots& all) {
  ControllerBatch batch{};
  batch.worlds = 1;
  batch.robots = robot.size();
  batch.sensors = ranges.size();
  batch.all_robots = all.poses.size();
  batch.robot = robot.data();
  batch.first_sensor = first_sensor.data();
  batch.own = own.data();
  batch.time = time;
  batch.sensed = sensed.data();
  batch.estimate = estimate.data();
  batch.velocity = velocity.data();
  batch.stalled = stalled.data();
  batch.ranges = ranges.data();
  batch.all_poses = all.poses.data();
  batch.all_velocities = all.velocities.empty() ? nullptr : all.velocities.data();
  batch.command = command.data();
  batch.memory = memory.data();
  batch.random = random.data();
  return batch;
}

void BatchControls::Attach(Model* model, const BatchArguments& arguments) {
  auto* const position = dynamic_cast<ModelPosition*>(model);
  if (!position)
    throw std::runtime_error("found a model of type " + messages::Quoted(model->GetModelType()) +
                             ", expected a position: this controller drives robots");
  const auto driven = std::make_shared<DrivenRobot>();
  driven->number = model->batch_controllers_;
  driven->name = arguments.name;
  driven->controller = arguments.controller;
  driven->model = position;
  driven->robot.id = model->GetId();
  ControllerSetup setup(position, arguments.text);
  driven->robot.parameters = arguments.controller->Prepare(&setup);
  driven->robot.sensors = setup.sensors();
  for (const ModelRanger* ranger : setup.rangers())
    for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
      driven->sensors.push_back({ranger->GetId(), i, ranger});
  driven->memory.resize(arguments.controller->memory_size());
  arguments.controller->FillMemory(driven->robot, driven->memory.data());
  model->Adopt(driven);
  if (driven->memory.empty())
    model->DeclareNoState(driven->name);
  else
    model->KeepState(driven->name, driven->memory.data(), driven->memory.size() * sizeof(double));
  model->batch_controllers_++;
  model->Subscribe();
  all_.push_back(driven);
  topology_version_ = 0;
}

/// Finds the groups again after models have been added or deleted.
void BatchControls::Refresh(const WorldEngine& engine) const {
  if (topology_version_ == engine.topology_version) return;
  topology_version_ = engine.topology_version;
  std::erase_if(all_, [](const auto& driven) { return driven.expired(); });
  std::map<std::pair<unsigned, std::string>, DrivenGroup> groups;
  for (const auto& held : all_) {
    DrivenRobot* const driven = held.lock().get();
    if (engine.FindModel(driven->robot.id) != driven->model) continue;
    for (DrivenRobot::SensorPlace& place : driven->sensors)
      place.ranger = dynamic_cast<const ModelRanger*>(engine.FindModel(place.id));
    DrivenGroup& group = groups[{driven->number, driven->name}];
    group.controller = driven->controller;
    group.robots.push_back(driven);
  }
  groups_.clear();
  for (auto& [name, group] : groups) {
    std::ranges::sort(group.robots, {}, [](const DrivenRobot* driven) { return driven->robot.id; });
    groups_.push_back(std::move(group));
  }
  positions_.clear();
  for (Model* model : engine.models)
    if (model->Drives()) positions_.push_back(static_cast<ModelPosition*>(model));
}

const std::vector<DrivenGroup>& BatchControls::Groups(const WorldEngine& engine) const {
  Refresh(engine);
  return groups_;
}

void BatchControls::Run(WorldEngine* engine, usec_t now) {
  if (all_.empty()) return;
  Refresh(*engine);
  for (const DrivenGroup& group : groups_) RunGroup(group, engine, now);
}

/// Calls a controller once. Rules of built-in ones look at one robot at a time, so several threads
/// call them for some robots each.
void BatchControls::RunGroup(const DrivenGroup& group, WorldEngine* engine, usec_t now) {
  constexpr size_t kGrain = 16;
  due_.clear();
  for (DrivenRobot* driven : group.robots)
    if (driven->model->GetLastUpdate() == now && driven->model->HasSubscribers())
      due_.push_back(driven);
  if (due_.empty()) return;
  CollectAll(*group.controller);
  const bool shares = engine->parallel_choice.is_parallel() && control::IsStock(group.controller);
  threads::WorkerPool* const workers = shares ? engine->workers() : nullptr;
  const size_t grain = workers ? kGrain : due_.size();
  buffers_.resize(std::max<size_t>(buffers_.size(), workers ? workers->threads() : 1));
  threads::RunOn(workers, due_.size(), grain, [&](size_t begin, size_t end, unsigned thread) {
    Call(*group.controller, std::span(due_).subspan(begin, end - begin),
         static_cast<double>(now) / 1e6, &buffers_[thread]);
  });
}

void BatchControls::Call(const BatchController& controller, std::span<DrivenRobot* const> robots,
                         double time, BatchBuffers* buffers) const {
  buffers->Clear();
  for (const DrivenRobot* driven : robots) Gather(*driven, buffers);
  const ControllerBatch batch = buffers->Batch(&time, all_robots_);
  try {
    controller.Step(batch);
  } catch (...) {
    RecordExceptionOrigin(("the controller " + messages::Quoted(robots[0]->name)).c_str(), nullptr,
                          nullptr);
    throw;
  }
  Apply(batch, robots);
}

void BatchControls::Gather(const DrivenRobot& driven, BatchBuffers* to) const {
  const ModelPosition& model = *driven.model;
  BatchBuffers& b = *to;
  b.robot.push_back(&driven.robot);
  b.first_sensor.push_back(static_cast<uint32_t>(b.ranges.size()));
  const auto place = std::ranges::lower_bound(positions_, driven.robot.id, {}, &Model::GetId);
  b.own.push_back(static_cast<uint32_t>(place - positions_.begin()));
  b.sensed.push_back(InPlane(model.GetSensedPose()));
  b.estimate.push_back(InPlane(model.est_pose));
  b.velocity.push_back(VelocityInPlane(model.velocity));
  b.command.push_back(VelocityInPlane(model.goal));
  b.stalled.push_back(model.Stalled());
  for (size_t i = 0; i < driven.sensors.size(); i++) b.ranges.push_back(RangesOf(driven, i));
  b.memory.insert(b.memory.end(), driven.memory.begin(), driven.memory.end());
  b.random.push_back(model.random_.Copy());
}

void BatchControls::CollectAll(const BatchController& controller) {
  const bool needs_velocities = controller.needs_velocities();
  all_robots_.poses.clear();
  all_robots_.velocities.clear();
  if (!controller.needs_poses() && !needs_velocities) return;
  for (const ModelPosition* position : positions_) {
    all_robots_.poses.push_back(InPlane(position->GetSensedPose()));
    if (!needs_velocities) continue;
    const bool stands = position->Stalled() || !position->HasSubscribers();
    all_robots_.velocities.push_back(control::GlobalVelocity(
        all_robots_.poses.back().a, VelocityInPlane(position->velocity), stands));
  }
}

/// Passes on what the controller has changed. A stream that it did not use is not made.
void BatchControls::Apply(const ControllerBatch& batch, std::span<DrivenRobot* const> robots) {
  const double* memory = batch.memory;
  for (size_t i = 0; i < robots.size(); i++) {
    DrivenRobot& driven = *robots[i];
    std::copy_n(memory, driven.memory.size(), driven.memory.begin());
    memory += driven.memory.size();
    const PlanarVelocity& v = batch.command[i];
    driven.model->SetSpeed(v.x, v.y, v.a);
    if (!IsSame(batch.random[i], driven.model->random_.Copy()))
      driven.model->random_.Get() = batch.random[i];
  }
}

}  // namespace Stg
