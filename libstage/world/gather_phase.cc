// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/gather_phase.hh"

#include <atomic>
#include <typeinfo>

#include "models/position.hh"
#include "models/ranger.hh"
#include "sensing/scene.hh"
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
  Measure(count, workers);
  MakeRoom(&scene.batch);
  Fill(count, workers);
  for (const Entry& entry : entries_) {
    if (entry.kind == Kind::kNothing) continue;
    if (entry.layer_missing) MakeLayers(entry, &scene);
    world->ScheduleUpdate(entry.model, entry.interval, entry.chain);
    if (entry.has_callbacks) world->QueueUpdateCallbacks(entry.model);
  }
  return count;
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
  for (const Entry& entry : entries_)
    if (!all_ready && entry.kind == Kind::kRanger && !entry.ready)
      static_cast<ModelRanger*>(entry.model)->FinishGettingReady();
  return can_share;
}

void GatherPhase::Measure(size_t count, sensing::WorkerPool* workers) {
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) {
      Entry& entry = entries_[i];
      if (entry.kind == Kind::kRanger)
        entry.share = static_cast<ModelRanger*>(entry.model)->MeasureUpdate();
    }
  });
}

void GatherPhase::MakeRoom(sensing::RayBatch* batch) {
  sensing::BatchShare all;
  for (const Entry& entry : entries_) {
    all.fans += entry.share.fans;
    all.rays += entry.share.rays;
    all.words += entry.share.words;
  }
  sensing::BatchShare next = batch->AddRoom(all);
  for (Entry& entry : entries_) {
    if (entry.kind != Kind::kRanger) continue;
    const sensing::BatchShare share = entry.share;
    entry.share = next;
    next = {next.rays + share.rays, next.fans + share.fans, next.words + share.words};
  }
}

void GatherPhase::Fill(size_t count, sensing::WorkerPool* workers) {
  // All windows have their place before the first fan refers to one.
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++)
      if (entries_[i].kind == Kind::kRanger)
        static_cast<ModelRanger*>(entries_[i].model)->PlaceWindows(entries_[i].share.words);
  });
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) FillEntry(&entries_[i]);
  });
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

/// The layers of the grid that a ranger's fans look for, at heights that nobody looked at so far.
void GatherPhase::MakeLayers(const Entry& entry, sensing::Scene* scene) {
  for (uint32_t i = entry.share.fans; i < scene->batch.fans().size(); i++) {
    const sensing::Fan& fan = scene->batch.fans()[i];
    if (fan.finder != entry.model) return;
    if (fan.layer == grid::kNoLayer)
      scene->batch.SetLayer(i, scene->grid.RangerLayer(fan.z, fan.z_test, fan.exact));
  }
}

}  // namespace Stg
