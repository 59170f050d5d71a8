// SPDX-License-Identifier: GPL-2.0-or-later

#include "simulation.hh"

#include <sstream>
#include <utility>

#include "crowd.hh"
#include "gil.hh"
#include "models/exception_origin.hh"
#include "models/host.hh"
#include "signals.hh"
#include "world/copy_source.hh"

namespace Stg::python {

Simulation::Simulation(std::unique_ptr<World> world) : world_(world.release()) {}

Simulation::~Simulation() { delete world_.get(); }

World* Simulation::WorldAt(size_t) const { return world_.get(); }

World& Simulation::world() const {
  World* const world = WorldAt(0);
  if (!world)
    throw Failure{Kind::kGone, closed_ ? "the world is gone: it has been closed"
                                       : "the world is gone: a controller has deleted it"};
  return *world;
}

Model* Simulation::Find(size_t, const ModelKey& key) const {
  if (key.resets != resets_ && key.id >= loaded_models_) return nullptr;
  World* const world = WorldAt(0);
  return world ? world->FindModel(key.id) : nullptr;
}

void Simulation::LoadFile(const std::string& path) {
  Load([&](World& world) { return world.Load(path); }, path);
}

void Simulation::LoadText(const std::string& text, const std::string& path) {
  Load(
      [&](World& world) {
        std::istringstream stream(text);
        return world.Load(stream, path);
      },
      "the text");
}

void Simulation::Load(const std::function<bool(World&)>& load, const std::string& what) {
  const Use use(this);
  World& own = world();
  const GilRelease no_gil;
  const ErrorCollector collector;
  try {
    if (!load(own)) throw Failure{Kind::kWorld, collector.Last(what + " can't be loaded")};
  } catch (const Failure&) {
    throw;
  } catch (...) {
    throw Failure{Kind::kWorld, what + " can't be loaded: " + DescribeException()};
  }
  FinishLoading();
}

/// Finishes loading. Moves the quit time out of the world: Python decides how long it runs.
void Simulation::FinishLoading() {
  World& own = world();
  quit_time_ = own.GetQuitTime();
  own.SetQuitTime(0);
  loaded_models_ = own.host().next_model_id;
}

/// Deletes the world. Closing a closed world has no effect.
void Simulation::Close() {
  const Use use(this);
  World* const world = WorldAt(0);
  closed_ = true;
  world_ = WorldHandle();
  const GilRelease no_gil;
  delete world;
}

/// Makes a step. Returns false if the world asks to quit or has been deleted.
bool Simulation::StepOnce() {
  World* const world = WorldAt(0);
  if (!world) return false;
  Command();
  return !world->Update();
}

uint64_t Simulation::Step(uint64_t steps) {
  const Use use(this);
  world();
  uint64_t made = 0;
  const auto refresh_at_end = [this] { Refresh(); };
  {
    const GilRelease no_gil;
    SignalChecks signals;
    try {
      for (; made < steps; made++) {
        if (!StepOnce()) break;
        if (made + 1 < steps) signals.Poll();
      }
    } catch (const nb::python_error&) {
      refresh_at_end();
      throw;
    } catch (...) {
      const std::string thrown = DescribeException();
      refresh_at_end();
      throw Failure{Kind::kStage, thrown};
    }
    refresh_at_end();
  }
  world();  // throws if a controller has deleted the world
  return made;
}

void Simulation::Reset(uint64_t seed) {
  const Use use(this);
  World& own = world();
  const GilRelease no_gil;
  resets_++;
  if (!initial_state_ || !own.RestartFrom(*initial_state_, seed)) Reload(seed);
  for (const std::weak_ptr<Crowd>& known : crowds_)
    if (const std::shared_ptr<Crowd> crowd = known.lock()) crowd->ClearCommands(0);
  Refresh();
}

void Simulation::Reload(uint64_t seed) {
  World& own = world();
  const ErrorCollector collector;
  if (!own.Reset(seed))
    throw Failure{Kind::kWorld, collector.Last("the world can't be loaded again")};
  FinishLoading();
  if (std::exchange(tried_initial_state_, true)) return;
  initial_state_ = own.CaptureInitialState();
}

Snapshot Simulation::Take(bool lean) {
  const Use use(this);
  const World& own = world();
  const GilRelease no_gil;
  const ErrorCollector collector;
  Snapshot snapshot;
  if (!own.Take(&snapshot, lean ? Snapshot::kLean : Snapshot::kFull))
    throw Failure{Kind::kStage, collector.Last("no snapshot can be taken")};
  return snapshot;
}

void Simulation::Restore(const Snapshot& from) {
  const Use use(this);
  World& own = world();
  const GilRelease no_gil;
  const ErrorCollector collector;
  if (!own.Restore(from))
    throw Failure{Kind::kStage, collector.Last("the snapshot doesn't fit this world")};
  Refresh();
}

std::shared_ptr<Simulation> Simulation::Fork() {
  const Use use(this);
  const std::shared_ptr<Simulation> fork = CopyOf(world());
  fork->quit_time_ = quit_time_;
  fork->initial_state_ = initial_state_;
  fork->tried_initial_state_ = tried_initial_state_;
  return fork;
}

std::shared_ptr<Simulation> Simulation::CopyOf(const World& world) {
  const GilRelease no_gil;
  const ErrorCollector collector;
  const CopySource source(world, true);
  RunOptions options = source.options();
  options.threads = world.options().threads;
  Snapshot now;
  std::unique_ptr<World> loaded;
  if (!source.empty() && world.Take(&now)) loaded = source.Make(options);
  if (!loaded) throw Failure{Kind::kStage, collector.Last("the world can't be copied")};
  const auto copy = std::make_shared<Simulation>(std::move(loaded));
  copy->FinishLoading();
  if (!copy->world().Restore(now))
    throw Failure{Kind::kStage, collector.Last("the copy can't take the state")};
  return copy;
}

uint64_t Simulation::StateHash() {
  const Use use(this);
  const World& own = world();
  const GilRelease no_gil;
  return own.StateHash();
}

void Simulation::Register(const std::shared_ptr<Crowd>& crowd) {
  std::erase_if(crowds_, [](const std::weak_ptr<Crowd>& known) { return known.expired(); });
  crowds_.push_back(crowd);
}

void Simulation::OnCrowdDestroyed(Crowd* crowd) noexcept try {
  With([this, crowd](World&) { crowd->Command(*this, 0); });
} catch (...) {  // if the world is closed or in use, the commands are dropped
}

void Simulation::Command() {
  for (const std::weak_ptr<Crowd>& known : crowds_)
    if (const std::shared_ptr<Crowd> crowd = known.lock()) crowd->Command(*this, 0);
}

void Simulation::Refresh() {
  for (const std::weak_ptr<Crowd>& known : crowds_)
    if (const std::shared_ptr<Crowd> crowd = known.lock()) crowd->Gather(*this, 0);
}

}  // namespace Stg::python
