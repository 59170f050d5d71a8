// SPDX-License-Identifier: GPL-2.0-or-later
//
// Restarts worlds with another seed without loading them. Reinforcement learning does that after
// each episode, and loading takes several times as long as restoring a snapshot.

#include "world/initial_state.hh"

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include "messages/assert.hh"
#include "models/model.hh"
#include "world/engine.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

std::vector<unsigned> IndicesOf(const std::vector<Model*>& models) {
  std::map<std::pair<const Model*, std::string>, unsigned> counts;
  std::vector<unsigned> indices;
  for (const Model* model : models)
    indices.push_back(counts[{model->Parent(), model->GetModelType()}]++);
  return indices;
}

/// True if clients may hold pointers to models that a restart deletes, or expect callbacks.
bool World::HasClients() const {
  const auto has_callbacks = [](const Model* model) {
    return model->controllers_ > model->batch_controllers_ ||
           (model->callbacks_ && std::ranges::any_of(model->callbacks_->all, [](const auto& entry) {
              return entry.function != nullptr;
            }));
  };
  const auto is_in_force = [](const WorldEngine::UpdateCallback& entry) {
    return entry.function != nullptr;
  };
  return std::ranges::any_of(engine_->update_callbacks, is_in_force) ||
         !engine_->calls_after_step.empty() || std::ranges::any_of(engine_->models, has_callbacks);
}

bool World::CanRestart() {
  return wf && engine_->IsIdle() && wf->populations().empty() &&
         (!options_.controllers || wf->TupleLength(0, "plugins") == 0) && !HasClients();
}

/// Draws the same random numbers in the same order as loading with that seed.
void World::RestartRandomNumbers(const InitialState& initial_state, uint64_t seed) {
  STAGE_ASSERT(initial_state.indices.size() == engine_->models.size());
  options_.seed = seed;
  random_.Restart(seed);
  for (size_t i = 0; i < engine_->models.size(); i++)
    engine_->models[i]->RestartRandomNumbers(initial_state.indices[i]);
}

std::shared_ptr<const InitialState> World::CaptureInitialState() {
  if (!CanRestart()) return nullptr;
  auto initial_state = std::make_shared<InitialState>();
  if (!Take(&initial_state->state)) return nullptr;
  initial_state->indices = IndicesOf(engine_->models);
  // Verifies that no model type draws other random numbers while loading: restarting with the
  // world's own seed must reproduce the state.
  Snapshot again;
  if (!RestartFrom(*initial_state, seed()) || !Take(&again)) return nullptr;
  return again.hash() == initial_state->state.hash() ? initial_state : nullptr;
}

bool World::RestartFrom(const InitialState& initial_state, uint64_t seed) {
  if (!CanRestart()) return false;
  const double start = WallClock();
  if (!Restore(initial_state.state)) return false;
  RestartRandomNumbers(initial_state, seed);
  simulated_before_ = 0;
  quit_ = false;
  log_.clear();
  ray_list.clear();
  engine_->max_dissipation = 0;
  engine_->statistics = RunStatistics();
  sensing::TraceStatistics none;
  none.device = engine_->tracer.statistics().device;
  engine_->tracer.SetStatistics(none);
  engine_->statistics.load_seconds = WallClock() - start;
  return true;
}

}  // namespace Stg
