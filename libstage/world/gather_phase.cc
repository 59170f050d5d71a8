// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/gather_phase.hh"

#include <algorithm>
#include <atomic>
#include <typeinfo>
#include <utility>

#include "models/position.hh"
#include "models/ranger.hh"
#include "sensing/scene.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {
constexpr size_t kGrain = 32;
}  // namespace

size_t GatherPhase::Update(const Scheduler::Event* events, size_t count, World* world,
                           sensing::WorkerPool* workers) {
  if (workers->threads() == 1) return 0;
  count = runs_.Find(count, [&] {
    return workers->FindFirst(count, [&](size_t i) { return !IsPlain(events[i]); });
  });
  if (count == 0) return 0;
  if (!Prepare(events, count, workers)) {
    runs_.Skip(count);
    return 0;
  }
  sensing::Scene& scene = world->scene();
  blocks_.resize((count + kBlock - 1) / kBlock);
  ForEachBlock(workers, [this](Block* block) { Measure(block); });
  MakeRoom(&scene.batch);
  // All windows have their place before the first fan refers to one.
  ForEachBlock(workers, [this](Block* block) { PlaceWindows(*block); });
  ForEachBlock(workers, [this](Block* block) { Fill(block); });
  MakeLayers(&scene);
  Queue(world, workers);
  return count;
}

template <typename F>
void GatherPhase::ForEachBlock(sensing::WorkerPool* workers, F f) {
  workers->Run(blocks_.size(), workers->Grain(blocks_.size(), kGrain / kBlock),
               [&](size_t begin, size_t end, unsigned) {
                 for (size_t i = begin; i < end; i++) f(&blocks_[i]);
               });
}

std::span<GatherPhase::Entry> GatherPhase::EntriesOf(const Block& block) {
  const size_t first = static_cast<size_t>(&block - blocks_.data()) * kBlock;
  return std::span(entries_).subspan(first, std::min(kBlock, entries_.size() - first));
}

/// The update of a model whose class does what it does here.
bool GatherPhase::IsPlain(const Scheduler::Event& event) {
  if (event.callback || !event.model) return false;
  const std::type_info& type = typeid(*event.model);
  return type == typeid(ModelRanger) ||
         (type == typeid(ModelPosition) && !event.model->HasCallbacks(Model::CB_VELOCITY));
}

GatherPhase::Kind GatherPhase::KindOf(const Scheduler::Event& event) {
  if (!event.model->ExpectsUpdate(event.chain)) return Kind::kNothing;
  return typeid(*event.model) == typeid(ModelRanger) ? Kind::kRanger : Kind::kPosition;
}

/// False if the updates can't be made in parts.
bool GatherPhase::Prepare(const Scheduler::Event* events, size_t count,
                          sensing::WorkerPool* workers) {
  entries_.resize(count);
  std::atomic<bool> can_share{true}, all_ready{true};
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) {
      Entry& entry = entries_[i];
      entry = Entry();
      entry.model = events[i].model;
      entry.kind = KindOf(events[i]);
      if (entry.kind != Kind::kRanger) continue;
      ModelRanger& ranger = *static_cast<ModelRanger*>(entry.model);
      entry.ready = ranger.GetReady();
      if (!entry.ready) all_ready.store(false, std::memory_order_relaxed);
      if (!ranger.CanShare()) can_share.store(false, std::memory_order_relaxed);
    }
  });
  if (!all_ready)
    for (const Entry& entry : entries_)
      if (entry.kind == Kind::kRanger && !entry.ready)
        static_cast<ModelRanger*>(entry.model)->FinishGettingReady();
  return can_share;
}

void GatherPhase::Measure(Block* block) {
  block->share = {};
  for (Entry& entry : EntriesOf(*block)) {
    if (entry.kind != Kind::kRanger) continue;
    entry.share = static_cast<ModelRanger*>(entry.model)->MeasureUpdate();
    block->share += entry.share;
  }
}

void GatherPhase::MakeRoom(sensing::RayBatch* batch) {
  sensing::BatchShare all;
  for (const Block& block : blocks_) all += block.share;
  sensing::BatchShare next = batch->AddRoom(all);
  for (Block& block : blocks_) next += std::exchange(block.share, next);
}

void GatherPhase::PlaceWindows(const Block& block) {
  sensing::BatchShare next = block.share;
  for (Entry& entry : EntriesOf(block)) {
    if (entry.kind != Kind::kRanger) continue;
    next += std::exchange(entry.share, next);
    static_cast<ModelRanger*>(entry.model)->PlaceWindows(entry.share.words);
  }
}

void GatherPhase::Fill(Block* block) {
  const std::span<Entry> entries = EntriesOf(*block);
  block->callbacks = 0;
  block->layer_missing = false;
  block->same_interval = true;
  for (Entry& entry : entries) {
    FillEntry(&entry);
    block->callbacks += entry.has_callbacks;
    block->layer_missing |= entry.layer_missing;
    block->same_interval &= entry.kind != Kind::kNothing && entry.interval == entries[0].interval;
  }
  block->interval = entries[0].interval;
}

void GatherPhase::FillEntry(Entry* entry) {
  if (entry->kind == Kind::kNothing) return;
  if (entry->kind == Kind::kRanger)
    entry->layer_missing = !static_cast<ModelRanger*>(entry->model)->FillUpdate(entry->share);
  else
    static_cast<ModelPosition*>(entry->model)->UpdateMotion();
  // As Model::Update() has it.
  entry->interval = entry->model->GetUpdateInterval();
  entry->chain = ++entry->model->update_chain_;
  entry->has_callbacks = entry->model->HasCallbacks(Model::CB_UPDATE);
}

/// The layers of the grid that rangers' fans look for, at heights that nobody looked at so far.
void GatherPhase::MakeLayers(sensing::Scene* scene) {
  sensing::RayBatch& batch = scene->batch;
  const auto make_for = [&](const Entry& entry) {
    for (uint32_t i = entry.share.fans; i < batch.fans().size(); i++) {
      const sensing::Fan& fan = batch.fans()[i];
      if (fan.finder != entry.model) return;
      if (fan.layer == grid::kNoLayer)
        batch.SetLayer(i, scene->grid.RangerLayer(fan.z, fan.z_test, fan.exact));
    }
  };
  for (const Block& block : blocks_) {
    if (!block.layer_missing) continue;
    for (const Entry& entry : EntriesOf(block))
      if (entry.layer_missing) make_for(entry);
  }
}

/// The next updates and the callbacks of this one.
void GatherPhase::Queue(World* world, sensing::WorkerPool* workers) {
  constexpr size_t kMany = 1000;  // fewer are done before other threads have begun
  const bool together = entries_.size() >= kMany &&
                        std::all_of(blocks_.begin(), blocks_.end(), [&](const Block& block) {
                          return block.same_interval && block.interval == blocks_[0].interval;
                        });
  if (together) return QueueTogether(world, workers);
  for (const Entry& entry : entries_) {
    if (entry.kind == Kind::kNothing) continue;
    world->ScheduleUpdate(entry.model, entry.interval, entry.chain);
    if (entry.has_callbacks) world->QueueUpdateCallbacks(entry.model);
  }
}

/// The same if all next updates are due at one time.
void GatherPhase::QueueTogether(World* world, sensing::WorkerPool* workers) {
  WorldEngine& engine = world->engine();
  const std::span<Scheduler::Event> events =
      engine.scheduler.AddRoom(world->SimTimeNow() + blocks_[0].interval, entries_.size());
  size_t callbacks = engine.update_callbacks_due.size();
  for (Block& block : blocks_) callbacks += std::exchange(block.callbacks, callbacks);
  engine.update_callbacks_due.resize(callbacks);
  ForEachBlock(workers, [&](Block* block) {
    Model** due = engine.update_callbacks_due.data() + block->callbacks;
    for (const Entry& entry : EntriesOf(*block)) {
      events[static_cast<size_t>(&entry - entries_.data())] = {entry.model, nullptr, nullptr,
                                                               entry.chain};
      if (entry.has_callbacks) *due++ = entry.model;
    }
  });
}

}  // namespace Stg
