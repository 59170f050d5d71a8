// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/engine.hh"

#include <algorithm>
#include <exception>
#include <new>
#include <utility>

#include "messages/report.hh"

namespace Stg {

namespace {

bool IsBefore(const Model* model, uint32_t id) { return model->GetId() < id; }

/// Out of a list in the order of creation.
template <typename M>
void EraseFrom(std::vector<M*>* list, const Model* model) {
  const auto found = std::lower_bound(list->begin(), list->end(), model->GetId(), IsBefore);
  if (found != list->end() && *found == model) list->erase(found);
}

void StrikeOut(std::vector<Model*>* list, const Model* model) {
  for (Model*& entry : *list)
    if (entry == model) entry = nullptr;
}

}  // namespace

Model* WorldEngine::FindModel(uint32_t id) const {
  const auto found = std::lower_bound(models.begin(), models.end(), id, IsBefore);
  return found != models.end() && (*found)->GetId() == id ? *found : nullptr;
}

void WorldEngine::KeepForNow(std::list<std::shared_ptr<void>> data) noexcept {
  orphans.splice(orphans.end(), data);  // takes no memory
}

void WorldEngine::LetOrphansGo() {
  if (!IsIdle()) return;
  // What is freed may free more.
  const std::list<std::shared_ptr<void>> gone = std::exchange(orphans, {});
}

void WorldEngine::Forget(Model* model) {
  family_changes++;
  EraseFrom(&models, model);
  names.NoteRemoved(*this);
  if (model->is_hidden_from_rangers()) std::erase(hidden_from_rangers, model);
  fiducials.Forget(model);
  EraseFrom(&energy, model);
  StrikeOut(&update_callbacks_due, model);
  StrikeOut(&sensed, model);
  scheduler.Forget(model);
  for (Scheduler::Event& event : due)
    if (event.model == model) event = Scheduler::Event();
}

bool WorldEngine::TellLost(const char* what) const {
  messages::Report(LogLevel::kError, std::string("stage: a callback ") +
                                         (deserted ? "deleted" : "unloaded") +
                                         " the world while it was being " + what);
  return false;
}

WorldEngine::WorldEngine() { Employ(new threads::WorkerPool(1)); }

void WorldEngine::Employ(threads::WorkerPool* workers) {
  std::unique_ptr<threads::WorkerPool, LetGo> mine(workers);
  tracer.SetWorkers(workers);  // may lack memory
  workers_ = std::move(mine);
}

void WorldEngine::SetThreads(unsigned count) {
  if (count == workers_->threads()) return;
  Employ(new threads::WorkerPool(count));
  if (workers_->threads() < count)
    messages::Warn("the system grants " + std::to_string(workers_->threads()) + " of " +
                   std::to_string(count) + " threads; going on with them");
}

void WorldEngine::NoticeFork() {
  if (forks_ == threads::CountForks()) return;
  forks_ = threads::CountForks();
  const unsigned count = workers_->threads();
  Employ(new threads::WorkerPool(1));
  SetThreads(count);
}

void WorldEngine::ShareFrom(int count) {
  const size_t fewest = static_cast<size_t>(std::max(count, 1));
  sharing_ = sensing::PathChooser(fewest == 1);
  gather_phase_.SetFewest(fewest);
  move_phase_.SetFewest(fewest);
  callback_phase_.SetFewest(fewest);
}

void WorldEngine::TraceBatch() {
  if (postponed_) std::rethrow_exception(std::exchange(postponed_, nullptr));
  if (scene.batch.fans().empty()) return;
  NoticeFork();
  RefreshHidden();
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
  all.threads = workers_->threads();
  return all;
}

void WorldEngine::AbandonStep(usec_t now) noexcept {
  tracer.Drop();
  sensed.clear();
  update_callbacks_due.clear();
  try {
    for (const Scheduler::Event& event : due)
      if (event.model || event.callback) scheduler.Add(now, event);  // void if it has happened
  } catch (const std::bad_alloc&) {
    // These models update no more. There is too little memory for the world anyhow.
  }
  due.clear();
}

void WorldEngine::EndStep() {
  gather_phase_.EndStep();
  move_phase_.EndStep();
  callback_phase_.EndStep();
  scene.grid.AgeLayers();
  scene.tables.Trim();
}

void WorldEngine::ChooseSharing() {
  // Larger steps are worth sharing, and not worth trying without.
  constexpr double kSmallStep = 0.5e-3;
  compares_sharing_ = workers_->threads() > 1 && shared_seconds_ < kSmallStep;
  shares_ = !compares_sharing_ || sharing_.UseDevice(due.size() + moving.size());
}

void WorldEngine::ReportSharing(double seconds) {
  if (compares_sharing_) sharing_.Report(seconds);
  if (shares_) shared_seconds_ = seconds;
}

size_t WorldEngine::MoveTogether(size_t first) {
  if (!shares_) return 0;
  return move_phase_.Move(moving.data() + first, moving.size() - first, &scene, workers_.get());
}

size_t WorldEngine::UpdateTogether(size_t first, World* world) {
  if (!shares_) return 0;
  return gather_phase_.Update(due.data() + first, due.size() - first, world, workers_.get());
}

size_t WorldEngine::CallTogether(size_t first) {
  if (!shares_) return 0;
  return callback_phase_.Call(update_callbacks_due.data() + first,
                              update_callbacks_due.size() - first, workers_.get(),
                              [this] { tracer.SendAhead(); });
}

void WorldEngine::RefreshHidden() {
  std::erase_if(hidden_from_rangers, [](Model* model) { return model->ShowAgainToRangers(); });
}

void WorldEngine::ForgetRays(const Model* finder) {
  // A model that is deleted while its rays wait: the whole batch is traced first, so that the other
  // sensors' readings are not lost.
  for (const sensing::Fan& fan : scene.batch.fans()) {
    if (fan.finder != finder) continue;
    TraceBatch();
    return;
  }
}

}  // namespace Stg
