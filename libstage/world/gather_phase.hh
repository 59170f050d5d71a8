// SPDX-License-Identifier: GPL-2.0-or-later
//
// Updates positions and rangers on several threads, with the very outcome of one after the other:
// an update of theirs touches nothing but the model itself, the batch and the schedule. What each
// adds to the batch is counted first; then each fills in its own room there.

#ifndef STAGE_WORLD_GATHER_PHASE_HH
#define STAGE_WORLD_GATHER_PHASE_HH

#include <cstdint>
#include <span>
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
  // Some entries that follow each other: what is added up of all is added up block by block.
  static constexpr size_t kBlock = 16;
  struct Block {
    sensing::BatchShare share;  // of its entries together, then where their room begins
    size_t callbacks;           // entries with callbacks, then how many come before it
    usec_t interval;            // of its entries, if it is the same
    bool same_interval, layer_missing;
  };
  template <typename F>
  void ForEachBlock(sensing::WorkerPool* workers, F f);
  std::span<Entry> EntriesOf(const Block& block);
  static bool IsPlain(const Scheduler::Event& event);
  static Kind KindOf(const Scheduler::Event& event);
  bool Prepare(const Scheduler::Event* events, size_t count, sensing::WorkerPool* workers);
  void Measure(Block* block);
  void MakeRoom(sensing::RayBatch* batch);
  void PlaceWindows(const Block& block);
  void Fill(Block* block);
  static void FillEntry(Entry* entry);
  void MakeLayers(sensing::Scene* scene);
  void Queue(World* world, sensing::WorkerPool* workers);
  void QueueTogether(World* world, sensing::WorkerPool* workers);

  RunFinder runs_;
  std::vector<Entry> entries_;
  std::vector<Block> blocks_;
};

}  // namespace Stg

#endif
