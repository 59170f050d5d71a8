// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/engine.hh"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <string_view>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "world/snapshot_buffers.hh"
#include "world/world_image.hh"

namespace Stg {

namespace {

void StrikeOut(std::vector<Model*>* list, const Model* model) {
  for (Model*& entry : *list)
    if (entry == model) entry = nullptr;
}

}  // namespace

void WorldEngine::CallContactCallbacks(uint64_t epoch_of_step) {
  if (contact_callbacks == 0 || contact_model != ContactModel::kOutlines) return;
  std::vector<uint32_t> ids;  // callbacks may delete models
  ForEachContact(nullptr, [&](const ContactPoint& contact) {
    for (const Model* model : {contact.a, contact.b})
      if (model->Root()->HasCallbacks(Model::CB_CONTACT)) ids.push_back(model->Root()->GetId());
  });
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  for (const uint32_t id : ids) {
    if (Model* const model = FindModel(id)) model->CallCallbacks(Model::CB_CONTACT);
    if (epoch != epoch_of_step) return;
  }
}

void WorldEngine::DeliverMessages(usec_t now) {
  constexpr size_t kMaxGrain = 32;
  const auto deliver = [this](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) traffic->Deliver(i);
  };
  const size_t receivers = traffic->Begin(now, this);
  threads::RunOn(receivers < share_messages_from_ ? nullptr : workers(), receivers, kMaxGrain,
                 deliver);
  traffic->End();
}

void WorldEngine::PrepareMove() {
  if (contact_model == ContactModel::kOutlines) contacts.Refresh(this);
}

bool WorldEngine::IsBlocked(const Model& model, const Pose& before, const Placement& proposed) {
  if (contact_model == ContactModel::kOutlines) return contacts.IsBlocked(model, before, this);
  return proposed.Collision(model.world_base().GetGround()) != nullptr;
}

Model* WorldEngine::Make(World* world, Model* parent, const std::string& type, creator_t create) {
  STAGE_ASSERT(world && create && !world_deleted);
  const uint32_t id = next_model_id;
  Model* const model = create(world, parent, type);
  return FindModel(id) == model ? model : nullptr;
}

void WorldEngine::Forget(Model* model) {
  topology_version++;
  Erase(&models, model);
  names.NoteRemoved(*this);
  if (model->is_hidden_from_rangers()) std::erase(hidden_from_rangers, model);
  fiducials->Forget(model);
  Erase(&energy, model);
  STAGE_ASSERT(!std::ranges::binary_search(moving, model->GetId(), {}, &Model::GetId));
  StrikeOut(&update_callbacks_due, model);
  StrikeOut(&sensed, model);
  scheduler.Forget(model);
  for (Scheduler::Event& event : due)
    if (event.model == model) event = Scheduler::Event();
}

bool WorldEngine::ReportWorldLost(const char* what) const {
  messages::Report(LogLevel::kError, std::string("stage: a callback ") +
                                         (world_deleted ? "deleted" : "unloaded") +
                                         " the world while it was being " + what);
  return false;
}

WorldEngine::WorldEngine() : snapshot_buffers(std::make_unique<SnapshotBuffers>()) {
  UsePool(threads::MakeWorkerPool(1));
  fiducials = &fiducial_index;
  traffic = &messages_of_radios;
  lights = &light_index;
  tracer.SetRangerView([this] { return FindRangerView(); });
}

WorldEngine::~WorldEngine() = default;

bool WorldEngine::AsksForValidation() {
  const char* const text = std::getenv("STAGE_VALIDATE");
  return text && std::string_view(text) == "1";
}

void WorldEngine::UsePool(std::shared_ptr<threads::WorkerPool> workers) {
  STAGE_ASSERT(workers && workers->threads() >= 1);
  tracer.SetWorkers(workers.get());  // may throw std::bad_alloc
  workers_ = std::move(workers);
}

void WorldEngine::ShareThreadsOf(const WorldEngine& other) {
  max_threads_ = 0;
  UsePool(other.workers_);
}

void WorldEngine::ChooseThreads(unsigned limit) {
  STAGE_ASSERT(limit >= 1);
  if (limit == max_threads_) return;
  SetThreads(1);
  max_threads_ = limit;
  alone_ = workers_;
  all_ = nullptr;
  thread_choice_ = ThreadChoice();
}

void WorldEngine::ChooseThreadsFor(size_t count) {
  if (max_threads_ <= 1) return;
  if (thread_choice_.UseAll(count))
    UseAllThreads();
  else if (workers_ != alone_)
    UsePool(alone_);
}

void WorldEngine::UseAllThreads() {
  if (max_threads_ <= 1) return;
  if (!all_) all_ = threads::MakeWorkerPool(max_threads_);
  if (workers_ != all_) UsePool(all_);
}

void WorldEngine::SetThreads(unsigned count) {
  STAGE_ASSERT(count >= 1);
  max_threads_ = 0;
  if (count == workers_->threads()) return;
  UsePool(threads::MakeWorkerPool(count));
  if (workers_->threads() < count)
    messages::Warn("the system grants " + std::to_string(workers_->threads()) + " of " +
                   std::to_string(count) + " threads; continuing with them");
}

void WorldEngine::CheckFork() {
  if (forks_ == threads::CountForks()) return;
  forks_ = threads::CountForks();
  const unsigned limit = std::exchange(max_threads_, 0), count = workers_->threads();
  UsePool(threads::MakeWorkerPool(1));
  if (limit > 0)
    ChooseThreads(limit);
  else
    SetThreads(count);
}

void WorldEngine::ShareFrom(int count) {
  const size_t min_length = static_cast<size_t>(std::max(count, 1));
  constexpr size_t kManyReceivers = 200;  // fewer are served before other threads have started
  share_messages_from_ = min_length == 1 ? 1 : kManyReceivers;
  parallel_choice.SetMinLength(min_length);
  gather.SetMinLength(min_length);
  move.SetMinLength(min_length);
  callbacks.SetMinLength(min_length);
}

void WorldEngine::TraceBatch() {
  if (postponed_) std::rethrow_exception(std::exchange(postponed_, nullptr));
  if (scene.batch.fans().empty()) return;
  STAGE_ASSERT(!scene.tearing_down);
  CheckFork();
  RestoreRangerVisibilities();
  tracer.Trace();
}

void WorldEngine::TraceBatchAndPostponeThrowing() noexcept {
  try {
    TraceBatch();
  } catch (...) {
    tracer.Drop();
    postponed_ = std::current_exception();
  }
}

RunStatistics WorldEngine::Statistics() const {
  RunStatistics all = statistics;
  const sensing::TraceStatistics& traced = tracer.statistics();
  all.seconds.prefilter = traced.prefilter_seconds;
  all.seconds.trace = traced.trace_seconds;
  all.device_steps = traced.device_steps;
  all.device_rays = traced.device_rays;
  all.trace = traced.trace;
  all.device = traced.device;
  all.prefilter = traced.prefilter;
  all.threads = chooses_threads() && all_ ? all_->threads() : workers_->threads();
  return all;
}

void WorldEngine::AbandonStep(usec_t now) noexcept {
  tracer.Drop();
  sensed.clear();
  update_callbacks_due.clear();
  try {
    for (const Scheduler::Event& event : due)
      if (event.model || event.callback) scheduler.Add(now, event);  // Void if it has been done
  } catch (const std::bad_alloc&) {
    // These models will not update again; the world has run out of memory anyway.
  }
  due.clear();
}

void WorldEngine::EndStep() {
  STAGE_ASSERT(stepping && due.empty() && sensed.empty());
  STAGE_ASSERT(scene.batch.fans().empty());  // fans refer to the tables that are trimmed here
  gather.EndStep();
  move.EndStep();
  callbacks.EndStep();
  scene.grid.ExpireLayers();
  scene.tables.Trim();
}

void WorldEngine::WarnAboutUnsubscribed() {
  for (Model* model : models)
    if (auto* const robot = dynamic_cast<ModelPosition*>(model)) robot->WarnIfNotSubscribed();
}

void WorldEngine::RestoreRangerVisibilities() {
  std::erase_if(hidden_from_rangers, [](Model* model) { return model->RestoreRangerVisibility(); });
}

/// Clients may write to Model::vis at any time, so all bodies are asked before each batch.
sensing::BatchTracer::RangerView WorldEngine::FindRangerView() {
  const grid::Grid& grid = scene.grid;
  const auto count = static_cast<grid::BodyId>(grid.body_count());
  grid::BodyId first = 0;
  while (first < count && !(grid.body(first).model && grid.body(first).ranger_visible)) first++;
  if (first == count) return {};
  const double value = grid.body(first).model->vis.ranger_return;
  const auto fits = [&](grid::BodyId id) {
    const grid::Body& body = grid.body(id);
    if (!body.model) return true;
    const double found = body.model->vis.ranger_return;
    return body.ranger_visible ? found == value && !(found < 0) : found < 0;
  };
  constexpr size_t kGrain = 512;
  std::atomic<bool> is_uniform{true};
  workers()->Run(count, kGrain, [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end && is_uniform.load(std::memory_order_relaxed); i++)
      if (!fits(static_cast<grid::BodyId>(i))) is_uniform.store(false, std::memory_order_relaxed);
  });
  return {is_uniform, value};
}

}  // namespace Stg
