// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs what is due in a step: updates of models, and callbacks that somebody has queued. Updates of
// types that allow it are made on several threads, with the very outcome of one after the other.
//
// What may be done in another order, and why: an update of such a type changes the model itself,
// the batch, and the lists of what is to come (the next update, callbacks, what follows sensing).
// It looks at poses and bodies, which no update changes (fingers of grippers move after sensing),
// and at nothing else that another update changes. So models may update in any order, whatever
// their types; and so may their fans be in the batch in any order, as a fan's hits concern its own
// sensor alone. Only the order of the lists shows later: these are filled in the order of the
// events, when all have updated. What may not: callbacks that somebody has queued, updates of
// classes derived by clients, and positions with callbacks for CB_VELOCITY. These may do anything,
// such as move or delete models that come later. They are done alone, with all before them done and
// none of those behind them.
//
// What each model adds to the batch is counted first; then each fills in its own room there.

#ifndef STAGE_WORLD_PHASES_GATHER_PHASE_HH
#define STAGE_WORLD_PHASES_GATHER_PHASE_HH

#include <cstdint>
#include <span>
#include <vector>

#include "models/self_masks.hh"
#include "sensing/batch.hh"
#include "sensing/fan_list.hh"
#include "threads/worker_pool.hh"
#include "world/phases/first_thrower.hh"
#include "world/phases/run_finder.hh"
#include "world/scheduler.hh"

namespace Stg {

class WorldEngine;

class GatherPhase {
 public:
  /// See RunOptions::share_from.
  void SetFewest(size_t models) { runs_.SetFewest(models); }
  /// Between steps.
  void EndStep() { runs_.EndStep(); }
  uint64_t looks() const { return runs_.looks(); }  ///< see RunFinder
  /// Everything that is due at the world's present time. Callbacks among it may delete the world;
  /// who calls this shares in the engine.
  void Run(World* world, WorldEngine* engine);

 private:
  static void RunEvent(WorldEngine* engine, size_t index);
  /// Updates the models of the first few of these events together. Returns how many events that
  /// was: up to one that is something else; 0 if it isn't worth while.
  size_t UpdateTogether(const Scheduler::Event* events, size_t count, World* world,
                        threads::WorkerPool* workers);
  struct Entry {
    Model* model;
    sensing::BatchShare share;  // then where its room begins
    usec_t next_update;
    uint64_t chain;
    size_t first_fan, fan_count;  // of those listed in the block
    Model::SelfMasksToMake masks;
    bool updates;  // it does: its update is not void
    bool ready, has_rest, has_callbacks, layer_missing;
  };
  // Some entries that follow each other: what is added up of all is added up block by block.
  static constexpr size_t kBlock = 16;
  struct Block {
    sensing::BatchShare share;  // of its entries together, then where their room begins
    sensing::FanList fans;      // of its entries of other types
    size_t callbacks;           // entries with callbacks, then how many come before it
    usec_t next_update;         // of its entries, if it is the same
    bool same_next_update, layer_missing, has_rests;
  };
  template <typename F>
  void ForEachBlock(threads::WorkerPool* workers, F f);
  std::span<Entry> EntriesOf(const Block& block);
  std::span<Block> Blocks() { return std::span(blocks_).first(block_count_); }
  static bool MayShare(const Scheduler::Event& event);
  bool Prepare(const Scheduler::Event* events, size_t count, World* world,
               threads::WorkerPool* workers);
  static constexpr unsigned kTargets = 4;  // beside what Model::GetReady() may want
  static unsigned PrepareEntry(const Scheduler::Event& event, Entry* entry);
  void FinishGettingReady(unsigned wants, World* world);
  static void UpdateAlone(Model* model);
  void UpdatePrepared(World* world, threads::WorkerPool* workers);
  template <typename F>
  void NoteIfThrown(const Entry& entry, F f);
  void Measure(Block* block);
  void MakeRoom(sensing::RayBatch* batch);
  void MeasureEntry(Entry* entry, Block* block);
  void PlaceSelfMasks(const Block& block);
  void Fill(Block* block);
  void FillEntry(Entry* entry, const Block& block);
  void MakeLayers(sensing::Scene* scene);
  void Queue(World* world, threads::WorkerPool* workers);
  void QueueTogether(World* world, threads::WorkerPool* workers);
  void NoteSensed(WorldEngine* engine, bool shares) const;

  FirstThrower thrower_;
  RunFinder runs_;
  std::vector<Entry> entries_;
  std::vector<Block> blocks_;  // the first block_count_; the others are kept for their memory
  size_t block_count_ = 0;
  usec_t now_ = 0;     // simulated time of this step
  uint32_t step_ = 0;  // Host::steps_begun
};

}  // namespace Stg

#endif
