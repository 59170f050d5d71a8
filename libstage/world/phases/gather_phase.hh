// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs the due events of a step: updates of models, and enqueued callbacks. Updates of types that
// allow it run on several threads, with the result of serial updates.
//
// Why parallel updates give equal results: an update of such a type changes only the model, the
// batch, and the lists of future work (next updates, callbacks, Sensed() calls). It reads poses and
// bodies, which no update changes (gripper fingers move after sensing). So models may update in any
// order, and their fans may be in any order in the batch, because hits of a fan concern only its
// own sensor. Only the order of the lists matters later; they are filled in event order after all
// updates. Enqueued callbacks, updates of classes derived by clients, and positions with
// CB_VELOCITY callbacks may do anything, such as move or delete later models. They run alone, after
// everything before them and before everything after them.
//
// First, the space that each model needs in the batch is counted; then each fills in its own space.

#ifndef STAGE_WORLD_PHASES_GATHER_PHASE_HH
#define STAGE_WORLD_PHASES_GATHER_PHASE_HH

#include <cstdint>
#include <span>
#include <vector>

#include "models/self_masks.hh"
#include "sensing/batch.hh"
#include "sensing/fan_list.hh"
#include "threads/worker_pool.hh"
#include "world/phases/first_exception_origin.hh"
#include "world/phases/interval_finder.hh"
#include "world/scheduler.hh"

namespace Stg {

class WorldEngine;

class GatherPhase {
 public:
  /// See RunOptions::share_from.
  void SetMinLength(size_t models) { interval_finder_.SetMinLength(models); }
  /// Call between steps.
  void EndStep() { interval_finder_.EndStep(); }
  uint64_t examined() const { return interval_finder_.examined(); }  ///< see IntervalFinder
  /// Runs all events that are due at the world's present time. Callbacks may delete the world, so
  /// the caller must share ownership of the engine.
  void Run(World* world, WorldEngine* engine);

 private:
  static void RunEvent(WorldEngine* engine, size_t index);
  /// Updates the models of a prefix of these events in parallel. Returns its length: it ends before
  /// an event that must run alone; 0 if sharing does not pay.
  size_t UpdateParallel(const Scheduler::Event* events, size_t count, World* world,
                        threads::WorkerPool* workers);
  struct Entry {
    Model* model;
    sensing::BatchSpace space;  // size, later begin of its space
    usec_t next_update;
    uint64_t generation;
    size_t first_fan, fan_count;  // range in the block's list of fans
    Model::PendingSelfMasks masks;
    bool updates;  // false if the event is void
    bool ready, wants_sensed, has_callbacks, layer_missing;
  };
  // Consecutive entries. Sums over all entries are computed block by block.
  static constexpr size_t kBlock = 16;
  struct Block {
    sensing::BatchSpace space;  // total of its entries, later begin of their space
    sensing::FanList fans;      // fans that its entries list one by one
    size_t callbacks;           // number of entries with callbacks; later that of earlier blocks
    usec_t next_update;         // next update of its entries, if they agree
    bool same_next_update, layer_missing, any_wants_sensed;
  };
  template <typename F>
  void ForEachBlock(threads::WorkerPool* workers, F f);
  std::span<Entry> EntriesOf(const Block& block);
  std::span<Block> Blocks() { return std::span(blocks_).first(block_count_); }
  static bool CanRunInParallel(const Scheduler::Event& event);
  bool Prepare(const Scheduler::Event* events, size_t count, World* world,
               threads::WorkerPool* workers);
  // Flags in addition to those of Model::Preparations().
  static constexpr unsigned kTargets = 4, kContacts = 8, kLights = 16;
  static unsigned PrepareEntry(const Scheduler::Event& event, Entry* entry);
  void FinishPreparation(unsigned needs, World* world);
  static void UpdateSerially(Model* model);
  void UpdatePrepared(World* world, threads::WorkerPool* workers);
  template <typename F>
  void RecordIfThrown(const Entry& entry, F f);
  void Measure(Block* block);
  void Reserve(sensing::RayBatch* batch);
  void MeasureEntry(Entry* entry, Block* block);
  void PlaceSelfMasks(const Block& block);
  void Fill(Block* block);
  void FillEntry(Entry* entry, const Block& block);
  void MakeLayers(sensing::Scene* scene);
  void Queue(World* world, threads::WorkerPool* workers);
  void QueueParallel(World* world, threads::WorkerPool* workers);
  void StoreSensedPose(WorldEngine* engine, bool parallel) const;

  FirstExceptionOrigin exception_origin_;
  IntervalFinder interval_finder_;
  std::vector<Entry> entries_;
  std::vector<Block> blocks_;  // only block_count_ are used; the rest keep their memory
  size_t block_count_ = 0;
  usec_t now_ = 0;     // simulated time of this step
  uint32_t step_ = 0;  // Host::steps_begun
};

}  // namespace Stg

#endif
