// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calls the callbacks of models: those that keep to themselves (Model::AddParallelCallback()) on
// several threads.
//
// Those that don't may look at anything and change anything: what callbacks of models before them
// did has to be there, and what those behind them do must not. So each of these ends a run.

#ifndef STAGE_WORLD_PHASES_CALLBACK_PHASE_HH
#define STAGE_WORLD_PHASES_CALLBACK_PHASE_HH

#include <cstdint>
#include <functional>
#include <vector>

#include "models/model.hh"
#include "threads/worker_pool.hh"
#include "world/phases/first_thrower.hh"
#include "world/phases/run_finder.hh"

namespace Stg {

class WorldEngine;

class CallbackPhase {
 public:
  /// See RunOptions::share_from.
  void SetFewest(size_t models) { runs_.SetFewest(models); }
  /// Between steps.
  void EndStep() { runs_.EndStep(); }
  uint64_t looks() const { return runs_.looks(); }  ///< see RunFinder
  /// Calls the CB_UPDATE callbacks of the models that updated in this step. They may delete the
  /// world; who calls this shares in the engine.
  void Run(WorldEngine* engine);
  /// Calls those of the first few of these models together, as if one after the other. Returns of
  /// how many: up to one whose callbacks may not be called at the same time; 0 if it
  /// isn't worth while. Null stands for a model that is gone.
  /// Meanwhile calls `beside` on the caller's thread, if there are other threads at work.
  size_t CallTogether(Model* const* models, size_t count, threads::WorkerPool* workers,
                      const std::function<void()>& beside = nullptr);

 private:
  size_t FindGroups(Model* const* models, size_t count, threads::WorkerPool* workers);
  bool FindGroupsTogether(Model* const* models, size_t count, threads::WorkerPool* workers);
  size_t FindGroupsInTurn(Model* const* models, size_t count);

  FirstThrower thrower_;
  RunFinder runs_;
  // Neighbours of the same tree are a group, which one thread calls. Where each begins, and the end
  // of the last.
  std::vector<uint32_t> group_begins_;
  std::vector<uint8_t> begins_group_;  // of each model
  uint64_t run_ = 0;
};

}  // namespace Stg

#endif
