// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/engine.hh"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <new>
#include <utility>

#include "messages/report.hh"

namespace Stg {

double WallClock() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

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

void WorldEngine::SetThreads(unsigned threads) {
  if (threads != workers_->threads()) {
    workers_.reset(new sensing::WorkerPool(threads));
    if (workers_->threads() < threads)
      messages::Warn("the system grants " + std::to_string(workers_->threads()) + " of " +
                     std::to_string(threads) + " threads; going on with them");
  }
  thread_data_.resize(workers_->threads());
  statistics.threads = workers_->threads();
}

void WorldEngine::NoticeFork() {
  if (forks_ == sensing::CountForks()) return;
  forks_ = sensing::CountForks();
  const unsigned threads = workers_->threads();
  workers_.reset(new sensing::WorkerPool(1));
  SetThreads(threads);
}

void WorldEngine::ShareFrom(int count) {
  const size_t fewest = static_cast<size_t>(std::max(count, 1));
  sharing_ = PathChooser(fewest == 1);
  gather_phase_.SetFewest(fewest);
  move_phase_.SetFewest(fewest);
  callback_phase_.SetFewest(fewest);
}

void WorldEngine::SetPrefilter(std::unique_ptr<sensing::Prefilter> prefilter, bool always) {
  prefilter_ = std::move(prefilter);
  chooser_ = PathChooser(always);
  scene.grid.TrackChanges(prefilter_ != nullptr);
  statistics.device = prefilter_ ? prefilter_->DeviceName() : "";
}

void WorldEngine::TraceBatch() {
  if (postponed_) std::rethrow_exception(std::exchange(postponed_, nullptr));
  sensing::RayBatch& batch = scene.batch;
  if (batch.fans().empty()) return;
  NoticeFork();
  RefreshHidden();
  batch.Close(scene.tables);

  const bool can = prefilter_ && batch.FitsDevice();
  const bool choose = can && path_ == Path::kFaster;
  const bool on_device =
      can && (choose ? chooser_.UseDevice(batch.ray_count()) : path_ == Path::kDevice);
  if (choose && chooser_.IsLook() && Look(on_device)) return EndBatch();
  device_in_use_ = on_device;
  if (!on_device) workers_->HoldProcessors(true);
  const double start = WallClock();
  const sensing::HitLists lists = on_device ? Prefilter(batch.ray_count()) : sensing::HitLists();
  const double walked = WallClock();
  TraceFans(lists);
  const double traced = WallClock();
  if (choose) chooser_.Report(traced - start);
  statistics.seconds.prefilter += walked - start;
  statistics.seconds.trace += traced - walked;

  EndBatch();
}

void WorldEngine::TraceBatchAndPostponeThrowing() noexcept {
  try {
    TraceBatch();
  } catch (...) {
    EndBatch();
    postponed_ = std::current_exception();
  }
}

void WorldEngine::EndBatch() {
  scene.batch.Clear();
  scene.batch_number++;
}

void WorldEngine::AbandonStep(usec_t now) noexcept {
  EndBatch();
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

/// Every so many runs of a batch are for a look, the others go the usual way.
struct WorldEngine::Looks {
  const std::vector<sensing::FanRun>& runs;
  size_t of;

  size_t count() const { return (runs.size() + of - 1) / of; }
  const sensing::FanRun& operator[](size_t i) const { return runs[i * of]; }
  size_t other_count() const { return runs.size() - count(); }
  const sensing::FanRun& Other(size_t i) const { return runs[i + i / (of - 1) + 1]; }
};

/// Traces the batch, with a part of it to see how long that takes on the path that seems to be the
/// slower one: all of it would cost much time. False if there is no such part: there are too few
/// fans, or what part of the time a part would take cannot be told.
bool WorldEngine::Look(bool at_device) {
  // A device of its own takes about as long for few rays as for many.
  if (at_device != prefilter_->UsesHost()) return false;
  constexpr size_t kSharesOfAThread = 8, kMost = 8;
  const std::vector<sensing::FanRun>& runs = fan_order_.Of(scene.batch);
  const size_t of = std::min(kMost, runs.size() / (kSharesOfAThread * workers_->threads()));
  if (of < 2) return false;
  const Looks looks{runs, of};
  if (CountRays(looks) == 0) return false;
  if (at_device) KeepOthersFromDevice(looks);
  TraceLooks(looks, at_device);
  return true;
}

void WorldEngine::KeepOthersFromDevice(const Looks& looks) {
  for (size_t i = 0; i < looks.other_count(); i++) {
    const sensing::FanRun& run = looks.Other(i);
    for (uint32_t k = 0; k < run.count; k++) scene.batch.KeepFromDevice(run.first + k);
  }
}

void WorldEngine::TraceLooks(const Looks& looks, bool at_device) {
  const uint64_t rays = CountRays(looks), all = scene.batch.ray_count();
  const double sent_before = statistics.prefilter.send_seconds;
  const double start = WallClock();
  const sensing::HitLists lists = Prefilter(at_device ? rays : all), none;
  const double walked = WallClock();
  TraceRuns(at_device ? lists : none, looks.count(), [&](size_t i) { return looks[i]; });
  const double looked = WallClock();
  TraceRuns(at_device ? none : lists, looks.other_count(),
            [&](size_t i) { return looks.Other(i); });
  statistics.seconds.prefilter += walked - start;
  statistics.seconds.trace += WallClock() - walked;
  if (!prefilter_) return;  // it has just been lost
  if (!at_device) return chooser_.Report(looked - walked, rays);
  // What it takes to send the grid does not depend on how many rays there are.
  const double send = statistics.prefilter.send_seconds - sent_before;
  const double parts = static_cast<double>(all) / static_cast<double>(rays);
  chooser_.Report(send + (looked - start - send) * parts);
}

uint64_t WorldEngine::CountRays(const Looks& looks) const {
  uint64_t rays = 0;
  for (size_t i = 0; i < looks.count(); i++) rays += CountRays(looks[i]);
  return rays;
}

void WorldEngine::EndStep() {
  gather_phase_.EndStep();
  move_phase_.EndStep();
  callback_phase_.EndStep();
  scene.grid.AgeLayers();
  scene.tables.Trim();
}

/// `rays`: of the fans that are not left to the host.
sensing::HitLists WorldEngine::Prefilter(uint64_t rays) {
  // Threads that wait would be in the way of a device that is the host's own processor; until the
  // next batch, for it also takes what is sent ahead.
  workers_->HoldProcessors(!prefilter_->UsesHost());
  try {
    const sensing::HitLists lists =
        prefilter_->Walk(scene.grid, scene.tables, scene.batch, workers_.get());
    statistics.device_steps++;
    statistics.device_rays += rays;
    statistics.prefilter = prefilter_->statistics();
    return lists;
  } catch (const sensing::PrefilterError& error) {
    LoseDevice(error);
    return sensing::HitLists();
  }
}

/// While callbacks run that leave the grid alone: bodies have moved, and mostly stay where they are
/// until the next batch.
void WorldEngine::SendAhead() {
  if (!prefilter_ || !device_in_use_) return;
  try {
    prefilter_->SendAhead(scene.grid);
  } catch (const sensing::PrefilterError& error) {
    LoseDevice(error);
  }
}

void WorldEngine::LoseDevice(const sensing::PrefilterError& error) {
  messages::Warn(messages::Shortened(prefilter_->DeviceName()) + " failed (" +
                 messages::Shortened(error.what(), messages::kLongestDetail) +
                 "); going on without it");
  SetPrefilter(nullptr, false);
}

void WorldEngine::TraceFans(const sensing::HitLists& lists) {
  const std::vector<sensing::FanRun>& runs = fan_order_.Of(scene.batch);
  TraceRuns(lists, runs.size(), [&](size_t i) { return runs[i]; });
}

/// Traces the runs at(0) to at(count - 1).
template <typename At>
void WorldEngine::TraceRuns(const sensing::HitLists& lists, size_t count, At at) {
  // Waking threads takes as long as tracing some hundred rays.
  constexpr uint32_t kTooFewRays = 500;
  const size_t grain = scene.batch.ray_count() < kTooFewRays ? count : workers_->Grain(count, 32);
  const sensing::Tracer tracer(scene.grid);
  workers_->Run(count, grain, [&](size_t begin, size_t end, unsigned thread) {
    for (size_t i = begin; i < end; i++) TraceRun(tracer, at(i), lists, &thread_data_[thread]);
  });
  for (ThreadData& data : thread_data_) {
    statistics.trace.rays += data.counters.rays;
    statistics.trace.potential_hits += data.counters.potential_hits;
    statistics.trace.resumed += data.counters.resumed;
    data.counters = sensing::TraceCounters();
  }
}

void WorldEngine::TraceRun(const sensing::Tracer& tracer, const sensing::FanRun& run,
                           const sensing::HitLists& lists, ThreadData* mine) const {
  const std::span<const sensing::Fan> fans = scene.batch.fans().subspan(run.first, run.count);
  for (const sensing::Fan& fan : fans) fan.sink->ExpectHits(fan.tag);
  const size_t rays = CountRays(run);
  if (mine->hits.size() < rays) mine->hits.resize(rays);
  tracer.TraceFans(scene.batch, fans.data(), run.count, lists, mine->hits.data(), &mine->counters);
  const sensing::RayHit* hits = mine->hits.data();
  for (const sensing::Fan& fan : fans) {
    fan.sink->TakeHits(fan.tag, hits, fan.record.samples);
    hits += fan.record.samples;
  }
}

size_t WorldEngine::CountRays(const sensing::FanRun& run) const {
  size_t rays = 0;
  for (const sensing::Fan& fan : scene.batch.fans().subspan(run.first, run.count))
    rays += fan.record.samples;
  return rays;
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
                              [this] { SendAhead(); });
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
