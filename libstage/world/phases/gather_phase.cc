// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/gather_phase.hh"

#include <algorithm>
#include <atomic>
#include <optional>
#include <utility>

#include "messages/assert.hh"
#include "models/deletion_watch.hh"
#include "models/exception_origin.hh"
#include "models/model_type.hh"
#include "sensing/scene.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {

constexpr size_t kGatherGrain = 32;

/// Freezes or unfreezes the indices of fiducials and lights; the destructor does the opposite.
class IndicesFrozen {
 public:
  IndicesFrozen(Host* host, bool frozen) : host_(host), frozen_(frozen) { Set(frozen_); }
  ~IndicesFrozen() { Set(!frozen_); }
  IndicesFrozen(const IndicesFrozen&) = delete;
  IndicesFrozen& operator=(const IndicesFrozen&) = delete;

 private:
  void Set(bool frozen) {
    host_->fiducials->SetFrozen(frozen);
    host_->lights->SetFrozen(frozen);
  }

  Host* const host_;
  const bool frozen_;
};

}  // namespace

void GatherPhase::Run(World* world, WorldEngine* engine) {
  STAGE_ASSERT(engine->stepping && engine->scene.batch.fans().empty());
  std::vector<Scheduler::Event>& due = engine->due;
  now_ = world->SimTimeNow();
  step_ = engine->steps_begun;
  engine->scheduler.Take(now_, &due);
  const size_t models = due.size() + engine->moving.size();
  engine->ChooseThreadsFor(models);
  engine->parallel_choice.Choose(engine->threads(), models);
  const bool batch = world->options().batch;
  const bool parallel = batch && engine->parallel_choice.is_parallel();
  // Updates of built-in types move nothing; see RunEvent() for the rest.
  const IndicesFrozen frozen(engine, true);
  // By index: an update may delete models, which clears their events, or the whole world, which
  // empties the list.
  for (size_t i = 0; i < due.size();) {
    const size_t updated =
        parallel ? UpdateParallel(due.data() + i, due.size() - i, world, engine->workers()) : 0;
    if (updated == 0) {
      RunEvent(engine, i);
      if (!batch) engine->TraceBatch();
    }
    STAGE_ASSERT(updated == 0 || i + updated <= due.size());
    i += std::max<size_t>(updated, 1);
  }
  due.clear();
  StoreSensedPose(engine, parallel);
}

/// Robots store their poses if a model of their tree has updated: the readings of this step belong
/// to these poses.
void GatherPhase::StoreSensedPose(WorldEngine* engine, bool parallel) const {
  constexpr size_t kMany = 1000;  // fewer are done before other threads have started
  const std::vector<Model*>& moving = engine->moving;
  const auto note = [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++)
      if (moving[i]->root->tree_updated_in_ == step_) moving[i]->StoreSensedPose();
  };
  if (!parallel || moving.size() < kMany) return note(0, moving.size(), 0);
  engine->workers()->Run(moving.size(), engine->workers()->Grain(moving.size(), kGatherGrain),
                         note);
}

void GatherPhase::RunEvent(WorldEngine* engine, size_t index) {
  STAGE_ASSERT(index < engine->due.size());
  const Scheduler::Event event = engine->due[index];
  // Callbacks, and updates of classes derived by clients, may move and change any model.
  std::optional<IndicesFrozen> unfrozen;
  if (!CanRunInParallel(event)) unfrozen.emplace(engine, false);
  if (event.callback) {
    engine->due[index] = Scheduler::Event();    // called once, even if it throws
    engine->TraceBatch();                       // it may read what others sensed
    std::optional<RandomScope> random_numbers;  // the world's generator if there is no model
    if (event.model) random_numbers.emplace(&event.model->random_);
    try {
      event.callback(event.model, event.arg);
    } catch (...) {
      RecordExceptionOrigin("an enqueued callback", nullptr,
                            reinterpret_cast<void (*)()>(event.callback));
      throw;
    }
  } else if (event.model && event.model->ExpectsUpdate(event.generation)) {
    UpdateSerially(event.model);
  }
}

void GatherPhase::UpdateSerially(Model* model) {
  const DeletionWatch watch(*model);  // a type of a plug-in may delete the model
  try {
    model->Update();
  } catch (...) {
    RecordUpdateException(watch.gone() ? nullptr : model);
    throw;
  }
}

size_t GatherPhase::UpdateParallel(const Scheduler::Event* events, size_t count, World* world,
                                   threads::WorkerPool* workers) {
  if (workers->threads() == 1) return 0;
  count = interval_finder_.Find(count, [&] {
    return workers->FindFirst(count, [&](size_t i) { return !CanRunInParallel(events[i]); });
  });
  if (count == 0) return 0;
  if (!Prepare(events, count, world, workers)) {
    interval_finder_.Skip(count);
    return 0;
  }
  exception_origin_.Begin();
  try {
    interval_finder_.Do(count, workers->threads(), [&] { UpdatePrepared(world, workers); });
  } catch (...) {
    exception_origin_.Publish();
    throw;
  }
  return count;
}

void GatherPhase::UpdatePrepared(World* world, threads::WorkerPool* workers) {
  sensing::Scene& scene = world->host().scene;
  ForEachBlock(workers, [this](Block* block) { Measure(block); });
  Reserve(&scene.batch);
  // All self-masks must be placed before the first fan refers to one.
  ForEachBlock(workers, [this](Block* block) { PlaceSelfMasks(*block); });
  ForEachBlock(workers, [this](Block* block) { Fill(block); });
  MakeLayers(&scene);
  Queue(world, workers);
}

/// Calls f(), a stage of the entry's update, and records the thrower of an exception.
template <typename F>
void GatherPhase::RecordIfThrown(const Entry& entry, F f) {
  try {
    f();
  } catch (...) {
    RecordUpdateException(entry.model);
    exception_origin_.Note(static_cast<size_t>(&entry - entries_.data()));
    throw;
  }
}

template <typename F>
void GatherPhase::ForEachBlock(threads::WorkerPool* workers, F f) {
  workers->Run(block_count_, workers->Grain(block_count_, kGatherGrain / kBlock),
               [&](size_t begin, size_t end, unsigned) {
                 for (size_t i = begin; i < end; i++) f(&blocks_[i]);
               });
}

std::span<GatherPhase::Entry> GatherPhase::EntriesOf(const Block& block) {
  STAGE_ASSERT(&block >= blocks_.data() && &block < blocks_.data() + block_count_);
  const size_t first = static_cast<size_t>(&block - blocks_.data()) * kBlock;
  return std::span(entries_).subspan(first, std::min(kBlock, entries_.size() - first));
}

/// True if this type's Update() is equivalent to the batched path, so that it may run in parallel.
bool GatherPhase::CanRunInParallel(const Scheduler::Event& event) {
  if (event.callback || !event.model) return false;
  const ModelType* const type = FindModelType(*event.model);
  if (!type || type->updates == ModelType::kSerial) return false;
  return !(type->updates & ModelType::kCallsVelocity) ||
         !event.model->HasCallbacks(Model::CB_VELOCITY);
}

// ---- preparations -------------------------------------------------------------------------------

/// Prepares all entries. Returns false if the updates cannot run in parallel.
bool GatherPhase::Prepare(const Scheduler::Event* events, size_t count, World* world,
                          threads::WorkerPool* workers) {
  entries_.resize(count);
  block_count_ = (count + kBlock - 1) / kBlock;
  if (blocks_.size() < block_count_) blocks_.resize(block_count_);
  std::atomic<unsigned> needs{0};
  workers->Run(count, workers->Grain(count, kGatherGrain), [&](size_t begin, size_t end, unsigned) {
    unsigned all = 0;
    for (size_t i = begin; i < end; i++) all |= PrepareEntry(events[i], &entries_[i]);
    if (all != 0) needs.fetch_or(all, std::memory_order_relaxed);
  });
  // Before the first exact ray, all bodies must be rasterized for it, which changes the grid.
  if ((needs & Model::kExactRays) && !world->host().scene.exact_rasterization) return false;
  FinishPreparation(needs, world);
  return true;
}

/// Fills in the entry. Returns flags of what its update needs.
unsigned GatherPhase::PrepareEntry(const Scheduler::Event& event, Entry* entry) {
  STAGE_ASSERT(event.model && !event.callback && CanRunInParallel(event));
  *entry = Entry();
  Model& model = *event.model;
  entry->model = &model;
  if (!model.ExpectsUpdate(event.generation)) return 0;
  const unsigned updates = FindModelType(model)->updates;
  unsigned needs = model.Preparations();
  if ((updates & ModelType::kIgnoresOwnTree) && !model.root->self_masks_)
    needs |= Model::kNeedsPreparation;
  if (updates & ModelType::kReadsFiducialIndex) needs |= kTargets;
  if (updates & ModelType::kReadsLightIndex) needs |= kLights;
  if (updates & ModelType::kReadsContacts) needs |= kContacts;
  if ((updates & ModelType::kUsesEverythingLayer) && model.host().IsExact(RayModel::kDefault))
    needs |= Model::kExactRays;
  entry->updates = true;
  entry->wants_sensed = updates & ModelType::kRequestsSensed;
  entry->ready = !(needs & Model::kNeedsPreparation);
  return needs;
}

/// Does the preparations that must not run in parallel.
void GatherPhase::FinishPreparation(unsigned needs, World* world) {
  WorldEngine& engine = world->engine();
  if (needs & kTargets) engine.fiducials->Refresh(engine.models);
  if (needs & kLights) engine.lights->Refresh();
  if (needs & kContacts) engine.contacts.FindContacts(&engine);
  if ((needs & Model::kExactRays) && world->IsExact(RayModel::kDefault))
    engine.scene.grid.EverythingLayer(true);
  if (!(needs & Model::kNeedsPreparation)) return;
  for (const Entry& entry : entries_) {
    if (!entry.updates || entry.ready) continue;
    Model& model = *entry.model;
    if (!model.root->self_masks_) model.root->self_masks_ = std::make_unique<Model::SelfMasks>();
    model.FinishPreparation();
  }
}

// ---- measuring ----------------------------------------------------------------------------------

void GatherPhase::Measure(Block* block) {
  block->space = {};
  block->fans.Clear();
  for (Entry& entry : EntriesOf(*block)) {
    MeasureEntry(&entry, block);
    block->space += entry.space;
  }
}

void GatherPhase::MeasureEntry(Entry* entry, Block* block) {
  if (!entry->updates) return;
  entry->first_fan = block->fans.size();
  RecordIfThrown(*entry,
                 [&] { entry->space = entry->model->MeasureSpace(&block->fans, &entry->masks); });
  entry->fan_count = block->fans.size() - entry->first_fan;
}

void GatherPhase::Reserve(sensing::RayBatch* batch) {
  sensing::BatchSpace all;
  for (const Block& block : Blocks()) all += block.space;
  sensing::BatchSpace next = batch->Allocate(all);
  for (Block& block : Blocks()) next += std::exchange(block.space, next);
  STAGE_ASSERT(next.fans == batch->fans().size() && next.rays == batch->ray_count());
  STAGE_ASSERT(next.words == batch->mask_words().size());
}

void GatherPhase::PlaceSelfMasks(const Block& block) {
  sensing::BatchSpace next = block.space;
  for (Entry& entry : EntriesOf(block)) {
    if (!entry.updates) continue;
    next += std::exchange(entry.space, next);
    entry.masks.Place(*entry.model, entry.space.words);
  }
}

// ---- filling in ---------------------------------------------------------------------------------

void GatherPhase::Fill(Block* block) {
  const std::span<Entry> entries = EntriesOf(*block);
  block->callbacks = 0;
  block->layer_missing = block->any_wants_sensed = false;
  block->same_next_update = true;
  for (Entry& entry : entries) {
    FillEntry(&entry, *block);
    block->callbacks += entry.has_callbacks;
    block->layer_missing |= entry.layer_missing;
    block->any_wants_sensed |= entry.wants_sensed;
    block->same_next_update &= entry.updates && entry.next_update == entries[0].next_update;
  }
  block->next_update = entries[0].next_update;
}

void GatherPhase::FillEntry(Entry* entry, const Block& block) {
  if (!entry->updates) return;
  STAGE_ASSERT(entry->first_fan + entry->fan_count <= block.fans.size());
  entry->masks.Fill(*entry->model);
  RecordIfThrown(*entry, [&] {
    entry->layer_missing =
        !entry->model->FillSpace(entry->space, block.fans, entry->first_fan, entry->fan_count);
  });
  // Corresponds to the rest of Model::Update().
  Model& model = *entry->model;
  model.updated_at_ = now_;
  // Several threads may fill in models of one tree at once.
  std::atomic_ref<uint32_t>(model.root->tree_updated_in_).store(step_, std::memory_order_relaxed);
  entry->next_update = model.NextUpdateAfter(now_);
  STAGE_ASSERT(entry->next_update > now_ || model.interval == 0);
  entry->generation = model.update_generation_ = UpdateGeneration::Next(model.update_generation_);
  entry->has_callbacks = model.HasCallbacks(Model::CB_UPDATE);
}

/// Makes grid layers for heights at which no ranger has looked before.
void GatherPhase::MakeLayers(sensing::Scene* scene) {
  for (const Block& block : Blocks()) {
    if (!block.layer_missing) continue;
    for (const Entry& entry : EntriesOf(block))
      if (entry.layer_missing) scene->MakeLayers(entry.space.fans, entry.model);
  }
}

/// Queues the next updates, and the Sensed() calls and callbacks of this step.
void GatherPhase::Queue(World* world, threads::WorkerPool* workers) {
  constexpr size_t kMany = 1000;  // fewer are done before other threads have started
  const bool together =
      entries_.size() >= kMany && std::ranges::all_of(Blocks(), [&](const Block& block) {
        return block.same_next_update && block.next_update == blocks_[0].next_update &&
               !block.any_wants_sensed;
      });
  if (together) return QueueParallel(world, workers);
  WorldEngine& engine = world->engine();
  for (const Entry& entry : entries_) {
    if (!entry.updates) continue;
    if (entry.wants_sensed) engine.sensed.push_back(entry.model);
    engine.ScheduleUpdate(entry.model, entry.next_update, entry.generation);
    if (entry.has_callbacks) engine.update_callbacks_due.push_back(entry.model);
  }
}

/// Queue() for the case that all next updates are due at one time.
void GatherPhase::QueueParallel(World* world, threads::WorkerPool* workers) {
  WorldEngine& engine = world->engine();
  const std::span<Scheduler::Event> events =
      engine.scheduler.AppendUninitialized(blocks_[0].next_update, entries_.size());
  size_t callbacks = engine.update_callbacks_due.size();
  for (Block& block : Blocks()) callbacks += std::exchange(block.callbacks, callbacks);
  engine.update_callbacks_due.resize(callbacks);
  ForEachBlock(workers, [&](Block* block) {
    Model** due = engine.update_callbacks_due.data() + block->callbacks;
    for (const Entry& entry : EntriesOf(*block)) {
      events[static_cast<size_t>(&entry - entries_.data())] = {entry.model, nullptr, nullptr,
                                                               entry.generation};
      if (entry.has_callbacks) *due++ = entry.model;
    }
    STAGE_ASSERT(due <= engine.update_callbacks_due.data() + callbacks);
  });
}

}  // namespace Stg
