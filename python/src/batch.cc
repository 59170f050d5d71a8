// SPDX-License-Identifier: GPL-2.0-or-later

#include "batch.hh"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include "array_groups.hh"
#include "gil.hh"
#include "models/exception_origin.hh"
#include "signals.hh"

namespace Stg::python {

CopySource Batch::SourceOf(Simulation* prototype) {
  const Use use(prototype);
  const ErrorCollector collector;
  CopySource source(prototype->world(), true);
  if (source.empty()) throw Failure{Kind::kStage, collector.Last("the world can't be copied")};
  return source;
}

CopySource Batch::SourceOf(Batch* other) {
  const Use use(other);
  return other->source_;
}

Batch::Batch(Simulation* prototype, const std::vector<uint64_t>& seeds, unsigned threads)
    : Batch(SourceOf(prototype), seeds, threads) {}

Batch::Batch(Batch* other, const std::vector<uint64_t>& seeds)
    : Batch(SourceOf(other), seeds, other->threads()) {}

Batch::Batch(CopySource source, const std::vector<uint64_t>& seeds, unsigned threads)
    : source_(std::move(source)),
      worlds_(seeds.size()),
      seeds_(seeds),
      failures_(seeds.size()),
      pool_(threads),
      round_counters_(pool_.threads()) {
  const GilRelease no_gil;
  ForEach(All(), [&](size_t i, unsigned) { Load(i); });
  for (const std::string& failure : failures_) {
    if (failure.empty()) continue;
    for (const WorldHandle& world : worlds_) delete world.get();
    throw Failure{Kind::kWorld, failure};
  }
}

Batch::~Batch() {
  for (const WorldHandle& world : worlds_) delete world.get();
}

void Batch::MakeCrowd(const std::vector<uint32_t>& robots) {
  std::vector<ModelKey> keys;
  for (const uint32_t id : robots) keys.push_back({id, 0});
  crowd_ = std::make_shared<Crowd>(weak_from_this(), keys, size(), false);
}

World* Batch::WorldAt(size_t index) const { return worlds_[index].get(); }

Model* Batch::Find(size_t index, const ModelKey& key) const {
  World* const world = WorldAt(index);
  return world ? world->FindModel(key.id) : nullptr;
}

Batch::Indices Batch::All() const {
  Indices all(size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

World& Batch::WorldOf(uint32_t index) const {
  World* const world = index < size() ? WorldAt(index) : nullptr;
  if (!world) throw Failure{Kind::kGone, "there is no world number " + std::to_string(index)};
  return *world;
}

void Batch::Fail(size_t index, const std::string& why) { failures_[index] = why; }

template <typename F>
void Batch::ForEach(const Indices& which, F f) {
  pool_.Run(which.size(), 1, [&](size_t begin, size_t end, unsigned thread) {
    for (size_t i = begin; i < end; i++) {
      try {
        f(which[i], thread);
      } catch (const Failure& failure) {
        Fail(which[i], failure.text);
      } catch (...) {
        Fail(which[i], DescribeException());
      }
    }
  });
}

/// Replaces the world with a newly loaded copy.
void Batch::Load(size_t index) {
  delete WorldAt(index);
  worlds_[index] = WorldHandle();
  failures_[index].clear();
  if (crowd_) crowd_->Forget(index);
  RunOptions options = source_.options();
  options.seed = seeds_[index];
  const ErrorCollector collector;
  World* const world = source_.Make(options).release();
  if (!world) throw Failure{Kind::kWorld, collector.Last("the world can't be copied")};
  world->SetQuitTime(0);
  worlds_[index] = WorldHandle(world);
}

/// Resets the world to the state after loading with its seed; loads it if that is not possible.
void Batch::ResetWorld(size_t index) {
  World* const world = WorldAt(index);
  if (!world || !initial_state_ || !world->RestartFrom(*initial_state_, seeds_[index]))
    return Load(index);
  failures_[index].clear();
}

/// Loads the first of these worlds and takes its initial state, for the resets of all worlds.
void Batch::CaptureInitialState(const Indices& which) {
  if (which.empty() || std::exchange(tried_initial_state_, true)) return;
  ForEach({which[0]}, [&](size_t index, unsigned) {
    Load(index);
    initial_state_ = WorldAt(index)->CaptureInitialState();
  });
}

/// Steps a world. Returns false if it quits or is deleted before the last step.
bool Batch::StepWorld(size_t index, uint64_t steps) {
  for (uint64_t i = 0; i < steps; i++) {
    crowd_->Command(*this, index);
    World* const world = WorldAt(index);
    if (!world->Update()) continue;
    if (!WorldAt(index)) Fail(index, "a controller has deleted the world");
    return false;
  }
  return true;
}

/// Makes steps like StepWorld(), and then fills in the arrays, even if a step throws.
bool Batch::StepAndGather(size_t index, uint64_t steps) {
  bool active = false;
  try {
    active = StepWorld(index, steps);
  } catch (...) {
    crowd_->Gather(*this, index);
    throw;
  }
  crowd_->Gather(*this, index);
  return active;
}

/// All worlds are in lock-step at the end of a round, where Ctrl-C is handled. A round takes about
/// 50 ms, which a user does not notice. Shorter rounds would be slower, because each world starts a
/// round with cold caches.
template <typename F>
void Batch::RunInRounds(const Indices& which, uint64_t count, uint64_t steps, F work) {
  constexpr double kSeconds = 0.05;
  SignalChecks signals;
  for (uint64_t done = 0; done < count;) {
    const double fit = step_seconds_ > 0 ? kSeconds / (step_seconds_ * static_cast<double>(steps) *
                                                       static_cast<double>(which.size()))
                                         : 1;
    const uint64_t now = std::min(static_cast<uint64_t>(std::clamp(fit, 1.0, 1e9)), count - done);
    const double start = threads::WallClock();
    for (RoundCounter& counter : round_counters_) counter.active = 0;
    ForEach(which, [&](size_t index, unsigned thread) {
      if (failures_[index].empty() && WorldAt(index) && work(index, done, now))
        round_counters_[thread].active++;
    });
    done += now;
    MeasureStep(threads::WallClock() - start, now * steps);
    if (done < count) signals.Poll();
  }
}

/// Updates the time per step after a round of `seconds`. Worlds that have ended or failed take no
/// time; if all have, the estimate stays as it is.
void Batch::MeasureStep(double seconds, uint64_t steps) {
  size_t active = 0;
  for (const RoundCounter& counter : round_counters_) active += counter.active;
  if (active > 0) step_seconds_ = seconds / static_cast<double>(active * steps);
}

void Batch::Step(const Indices& which, uint64_t steps) {
  const Use use(this);
  const GilRelease no_gil;
  RunInRounds(which, steps, 1,
              [&](size_t index, uint64_t, uint64_t now) { return StepAndGather(index, now); });
}

void Batch::Rollout(const double* commands, size_t moments, uint64_t steps,
                    const std::vector<Record>& records, bool* recorded) {
  const Use use(this);
  const GilRelease no_gil;
  RunInRounds(All(), moments, steps, [&](size_t index, uint64_t first, uint64_t now) {
    const size_t row = 3 * crowd_->size();
    bool active = true;
    for (uint64_t moment = first; moment < first + now; moment++) {
      if (commands) crowd_->SetCommands(index, commands + (moment * size() + index) * row);
      active = StepAndGather(index, steps);
      if (!failures_[index].empty()) return false;
      for (const Record& record : records)
        std::memcpy(record.to + (moment * size() + index) * record.bytes_per_world,
                    record.live + index * record.bytes_per_world, record.bytes_per_world);
      recorded[moment * size() + index] = true;
    }
    return active;
  });
}

void Batch::Reset(const Indices& which, const std::vector<uint64_t>& seeds) {
  const Use use(this);
  const GilRelease no_gil;
  for (size_t i = 0; i < which.size(); i++) seeds_[which[i]] = seeds[i];
  CaptureInitialState(which);
  ForEach(which, [&](size_t index, unsigned) {
    ResetWorld(index);
    crowd_->ClearCommands(index);
  });
  ForEach(which, [&](size_t index, unsigned) { crowd_->Gather(*this, index); });
}

void Batch::Restore(const Indices& which, const Snapshot& from) {
  const Use use(this);
  const GilRelease no_gil;
  ForEach(which, [&](size_t index, unsigned) {
    if (!WorldAt(index)) Load(index);
    World& world = WorldOf(static_cast<uint32_t>(index));
    const ErrorCollector collector;
    if (!world.Restore(from))
      throw Failure{Kind::kStage, collector.Last("the snapshot doesn't fit")};
    world.CancelQuit();
    failures_[index].clear();
    crowd_->Gather(*this, index);
  });
}

Snapshot Batch::Take(uint32_t index) {
  const Use use(this);
  const World& world = WorldOf(index);
  const GilRelease no_gil;
  const ErrorCollector collector;
  Snapshot snapshot;
  if (!world.Take(&snapshot))
    throw Failure{Kind::kStage, collector.Last("no snapshot can be taken")};
  return snapshot;
}

std::vector<uint64_t> Batch::StateHashes() {
  const Use use(this);
  const GilRelease no_gil;
  std::vector<uint64_t> hashes(size());
  ForEach(All(), [&](size_t index, unsigned) {
    if (const World* const world = WorldAt(index)) hashes[index] = world->StateHash();
  });
  return hashes;
}

std::shared_ptr<Simulation> Batch::Fork(uint32_t index) {
  const Use use(this);
  return Simulation::CopyOf(WorldOf(index));
}

void Batch::Teleport(const double* poses, const bool* which) {
  const Use use(this);
  for (size_t i = 0; i < size(); i++) {
    crowd_->Teleport(*this, i, poses + 3 * i * crowd_->size(), which + i * crowd_->size());
    crowd_->Gather(*this, i);
  }
}

std::vector<uint64_t> Batch::Seeds() {
  const Use use(this);
  return seeds_;
}

std::map<uint32_t, std::string> Batch::Failures() {
  const Use use(this);
  std::map<uint32_t, std::string> failures;
  for (uint32_t i = 0; i < size(); i++)
    if (!failures_[i].empty()) failures[i] = failures_[i];
  return failures;
}

void Batch::SetFailures(const std::map<uint32_t, std::string>& failures) {
  const Use use(this);
  for (const auto& [index, text] : failures)
    if (index < size()) Fail(index, text);
}

Batch::Metrics Batch::MetricsOfAll() {
  const Use use(this);
  Metrics metrics;
  for (size_t i = 0; i < size(); i++) {
    const World* const world = WorldAt(i);
    if (!world) continue;
    for (const NamedMetric& metric : world->Metrics()) {
      auto known = std::ranges::find(metrics, metric.name, &Metrics::value_type::first);
      if (known == metrics.end()) {
        metrics.emplace_back(metric.name, std::vector<double>(size(), kNaN));
        known = metrics.end() - 1;
      }
      known->second[i] = metric.value;
    }
  }
  return metrics;
}

}  // namespace Stg::python
