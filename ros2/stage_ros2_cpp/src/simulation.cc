// SPDX-License-Identifier: GPL-2.0-or-later

#include "simulation.hh"

#include <algorithm>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace stage_ros2_cpp {

using Stg::Model;
using Stg::ModelPosition;
using Stg::World;

namespace {

Stg::RunOptions Options() {
  if (!Stg::InitDone()) Stg::Init(nullptr, nullptr);
  Stg::RunOptions options;
  options.listed = false;  // several nodes in a process share nothing
  return options;
}

const Stg::ModelType* FindType(const std::string& name) {
  for (const Stg::ModelType* type : Stg::SensorTypes())
    if (type->name == name) return type;
  return nullptr;
}

Model* FindInTree(const Stg::ModelType& type, Model* tree, size_t* n) {
  if (type.is(*tree) && (*n)-- == 0) return tree;
  for (Model* child : tree->GetChildren())
    if (Model* const found = FindInTree(type, child, n)) return found;
  return nullptr;
}

void EnsureSubscribed(Model* model) {
  if (!model->HasSubscribers()) model->Subscribe();
}

/// The last message of loading, or else that loading failed.
std::string ReasonOf(const World& world, const std::string& what) {
  const std::vector<std::string>& messages = world.LoadMessages();
  return messages.empty() ? what + " can't be loaded" : messages.back();
}

}  // namespace

Simulation::Simulation(const std::string& file) : world_(new World(Options())) {
  std::unique_ptr<World> owner(world_);
  if (!world_->Load(file)) throw std::runtime_error(ReasonOf(*world_, file));
  world_->SetQuitTime(0);
  for (Model* const model : world_->GetAllModels())
    if (dynamic_cast<ModelPosition*>(model) && !model->Parent()) ids_.push_back(model->GetId());
  if (ids_.empty())
    throw std::runtime_error(file +
                             ": found no robot, expected a model that drives and stands on "
                             "the ground");
  std::sort(ids_.begin(), ids_.end());
  commands_.resize(size());
  (void)owner.release();
}

Simulation::~Simulation() {
  if (World::Exists(world_)) delete world_;
}

ModelPosition* Simulation::Robot(size_t robot) const {
  return dynamic_cast<ModelPosition*>(Find(ids_[robot]));
}

int64_t Simulation::Now() const { return static_cast<int64_t>(world_->SimTimeNow()); }

int64_t Simulation::StepTime() const { return static_cast<int64_t>(world_->sim_interval); }

std::string Simulation::StateHash() const {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(world_->StateHash()));
  return text;
}

bool Simulation::Step() {
  for (size_t i = 0; i < size(); i++) {
    ModelPosition* const robot = commands_[i] ? Robot(i) : nullptr;
    if (!robot) continue;
    EnsureSubscribed(robot);
    robot->SetSpeed(*commands_[i]);
  }
  const bool ended = world_->Update();
  if (!World::Exists(world_)) throw std::runtime_error("a controller has deleted the world");
  return !ended;
}

void Simulation::Reset(uint64_t seed) {
  if (!initial_state_ || !world_->RestartFrom(*initial_state_, seed)) Restart(seed);
  std::fill(commands_.begin(), commands_.end(), std::nullopt);
  for (const Attached& what : attached_) Subscribe(what);
}

void Simulation::Restart(uint64_t seed) {
  if (!world_->Reset(seed)) throw std::runtime_error(ReasonOf(*world_, "the world"));
  world_->SetQuitTime(0);
  if (!std::exchange(tried_initial_state_, true)) initial_state_ = world_->CaptureInitialState();
}

void Simulation::Place(size_t robot, const Stg::Pose& pose) {
  if (ModelPosition* const model = Robot(robot))
    model->SetGlobalPose(Stg::Pose(pose.x, pose.y, model->GetGlobalPose().z, pose.a));
}

void Simulation::AttachRobots() { Attach({nullptr, 0}); }

void Simulation::AttachSensors(const std::string& type, size_t index) {
  if (const Stg::ModelType* const known = FindType(type)) Attach({known, index});
}

void Simulation::Attach(const Attached& what) {
  if (std::find(attached_.begin(), attached_.end(), what) == attached_.end())
    attached_.push_back(what);
  Subscribe(what);
}

void Simulation::Subscribe(const Attached& what) const {
  for (size_t i = 0; i < size(); i++) {
    Model* model = Robot(i);
    size_t n = what.index;
    if (model && what.type) model = FindInTree(*what.type, model, &n);
    if (model) EnsureSubscribed(model);
  }
}

}  // namespace stage_ros2_cpp
