// SPDX-License-Identifier: GPL-2.0-or-later
//
// Updates positions and rangers on several threads, with the very outcome of one after the other:
// an update of theirs touches nothing but the model itself, the batch and the schedule. What each
// adds to the batch is counted first; then each fills in its own room there.

#ifndef STAGE_WORLD_GATHER_PHASE_HH
#define STAGE_WORLD_GATHER_PHASE_HH

#include <cstdint>
#include <vector>

#include "sensing/batch.hh"
#include "sensing/worker_pool.hh"
#include "world/run_finder.hh"
#include "world/scheduler.hh"

namespace Stg {

class GatherPhase {
 public:
  /// See RunOptions::share_from.
  void SetFewest(size_t models) { runs_.SetFewest(models); }
  /// Between steps.
  void EndStep() { runs_.Begin(); }
  /// Updates the models of the first few of these events. Returns how many events that was: up to
  /// one that is something else; 0 if it isn't worth while.
  size_t Update(const Scheduler::Event* events, size_t count, World* world,
                sensing::WorkerPool* workers);

 private:
  enum class Kind : uint8_t { kNothing, kPosition, kRanger };
  struct Entry {
    Model* model;
    sensing::BatchShare share;  // then where its room begins
    usec_t interval;
    uint64_t chain;
    Kind kind;
    bool ready, has_callbacks, layer_missing;
  };
  static bool IsPlain(const Scheduler::Event& event);
  static Kind KindOf(const Scheduler::Event& event);
  bool Prepare(const Scheduler::Event* events, size_t count, sensing::WorkerPool* workers);
  void Measure(size_t count, sensing::WorkerPool* workers);
  void MakeRoom(sensing::RayBatch* batch);
  void Fill(size_t count, sensing::WorkerPool* workers);
  static void FillEntry(Entry* entry);
  static void MakeLayers(const Entry& entry, sensing::Scene* scene);

  RunFinder runs_;
  std::vector<Entry> entries_;
};

}  // namespace Stg

#endif
