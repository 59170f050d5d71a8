// SPDX-License-Identifier: GPL-2.0-or-later
//
// Calls the callbacks of models. Those that access only their own tree
// (Model::AddParallelCallback()) run on several threads.
//
// Any other callback may read and change everything: it must see the effects of all callbacks
// before it and none of those after it. It therefore ends a parallel interval.

#ifndef STAGE_WORLD_PHASES_CALLBACK_PHASE_HH
#define STAGE_WORLD_PHASES_CALLBACK_PHASE_HH

#include <cstdint>
#include <functional>
#include <vector>

#include "models/model.hh"
#include "threads/worker_pool.hh"
#include "world/phases/first_exception_origin.hh"
#include "world/phases/interval_finder.hh"

namespace Stg {

class WorldEngine;

class CallbackPhase {
 public:
  /// See RunOptions::share_from.
  void SetMinLength(size_t models) { interval_finder_.SetMinLength(models); }
  /// Call between steps.
  void EndStep() { interval_finder_.EndStep(); }
  uint64_t examined() const { return interval_finder_.examined(); }  ///< see IntervalFinder
  /// Calls the CB_UPDATE callbacks of the models that updated in this step. They may delete the
  /// world, so the caller must share ownership of the engine.
  void Run(WorldEngine* engine);
  /// Calls the callbacks of a prefix of these models in parallel, with the result of serial calls.
  /// Returns its length: it ends before a model with other callbacks; 0 if sharing does not pay.
  /// Null entries are deleted models. Runs `beside` on the calling thread while other threads work.
  size_t CallParallel(Model* const* models, size_t count, threads::WorkerPool* workers,
                      const std::function<void()>& beside = nullptr);

 private:
  size_t FindGroups(Model* const* models, size_t count, threads::WorkerPool* workers);
  bool FindGroupsParallel(Model* const* models, size_t count, threads::WorkerPool* workers);
  size_t FindGroupsSerially(Model* const* models, size_t count);

  FirstExceptionOrigin exception_origin_;
  IntervalFinder interval_finder_;
  // Neighbours of the same tree form a group, which one thread calls. Holds the begin of each group
  // and the end of the last.
  std::vector<uint32_t> group_begins_;
  std::vector<uint8_t> begins_group_;  // for each model, whether a group begins there
  uint64_t interval_number_ = 0;
};

}  // namespace Stg

#endif
