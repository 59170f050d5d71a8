// SPDX-License-Identifier: GPL-2.0-or-later

#include "batch.hh"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <utility>

#include "gil.hh"
#include "signals.hh"

namespace Stg::python {

namespace {

RunOptions OptionsOfWorlds(const World& prototype) {
  RunOptions options = prototype.options();
  options.threads = 1;
  options.opencl = false;  // they share the prototype's device
  return options;
}

}  // namespace

Batch::Batch(std::shared_ptr<Simulation> prototype, const std::vector<uint64_t>& seeds,
             unsigned threads)
    : prototype_(std::move(prototype)),
      image_(prototype_->world().Image()),
      options_(OptionsOfWorlds(prototype_->world())),
      worlds_(seeds.size()),
      seeds_(seeds),
      failures_(seeds.size()),
      pool_(threads) {
  const GilRelease no_gil;
  ForEach(All(), [&](size_t i) { Load(i); });
  for (const std::string& failure : failures_)
    if (!failure.empty()) throw Failure{Kind::kWorld, failure};
}

Batch::~Batch() {
  for (size_t i = 0; i < size(); i++) delete WorldAt(i);
}

void Batch::MakeCrowd(const std::vector<uint32_t>& robots) {
  std::vector<ModelKey> keys;
  for (const uint32_t id : robots) keys.push_back({id, 0});
  crowd_ = std::make_shared<Crowd>(weak_from_this(), keys, size(), false);
}

World* Batch::WorldAt(size_t index) const {
  return worlds_[index] && World::Exists(worlds_[index]) ? worlds_[index] : nullptr;
}

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
  pool_.Run(which.size(), 1, [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) {
      try {
        f(which[i]);
      } catch (const Failure& failure) {
        Fail(which[i], failure.text);
      } catch (...) {
        Fail(which[i], DescribeThrown());
      }
    }
  });
}

/// A new world that is a copy is there faster than an old one is loaded again.
void Batch::Load(size_t index) {
  delete WorldAt(index);
  worlds_[index] = nullptr;
  failures_[index].clear();
  if (crowd_) crowd_->Forget(index);
  RunOptions options = options_;
  options.seed = seeds_[index];
  options.listed = false;
  auto world = std::make_unique<World>(options);
  if (const World* const prototype = prototype_->WorldAt(0)) world->UseDeviceOf(*prototype);
  const Complaints complaints;
  const bool loaded = world->LoadCopy(image_);
  if (!World::Exists(world.get())) static_cast<void>(world.release());
  if (!loaded) throw Failure{Kind::kWorld, complaints.Last("the world can't be copied")};
  world->SetQuitTime(0);
  worlds_[index] = world.release();
}

/// False if it makes no more steps.
bool Batch::StepWorld(size_t index, uint64_t steps) {
  for (uint64_t i = 0; i < steps; i++) {
    crowd_->Command(index);
    if (!worlds_[index]->Update()) continue;
    if (!WorldAt(index)) Fail(index, "a controller has deleted the world");
    return false;
  }
  return true;
}

/// A round takes about as long as somebody who presses Ctrl-C waits without noticing. All worlds
/// are then as far as each other. Rounds of few steps would cost: a world's memory is in no cache
/// when its turn comes.
template <typename F>
void Batch::InRounds(const Indices& which, uint64_t count, uint64_t steps, F work) {
  constexpr double kSeconds = 0.05;
  constexpr uint64_t kMost = 1000;  // if there is nothing to go by
  SignalChecks signals;
  for (uint64_t done = 0; done < count;) {
    const double steps_of_all = static_cast<double>(CountGoing(which) * steps);
    const double fit = steps_of_all == 0   ? kMost
                       : step_seconds_ > 0 ? kSeconds / (step_seconds_ * steps_of_all)
                                           : 1;
    const uint64_t now = std::min(static_cast<uint64_t>(std::clamp(fit, 1.0, 1e9)), count - done);
    const double start = threads::WallClock();
    ForEach(which, [&](size_t index) {
      if (failures_[index].empty() && WorldAt(index)) work(index, done, now);
    });
    done += now;
    if (steps_of_all > 0)
      step_seconds_ = (threads::WallClock() - start) / (steps_of_all * static_cast<double>(now));
    if (done < count) signals.Look();
  }
}

size_t Batch::CountGoing(const Indices& which) const {
  return static_cast<size_t>(std::ranges::count_if(which, [&](size_t index) {
    const World* const world = WorldAt(index);
    return failures_[index].empty() && world && !world->TestQuit();
  }));
}

void Batch::Step(const Indices& which, uint64_t steps) {
  const Use use(this);
  const GilRelease no_gil;
  InRounds(which, steps, 1, [&](size_t index, uint64_t, uint64_t now) {
    StepWorld(index, now);
    crowd_->Gather(index);
  });
}

void Batch::Rollout(const double* commands, size_t moments, uint64_t steps,
                    const std::vector<Record>& records) {
  const Use use(this);
  const GilRelease no_gil;
  InRounds(All(), moments, steps, [&](size_t index, uint64_t first, uint64_t now) {
    const size_t row = 3 * crowd_->size();
    for (uint64_t moment = first; moment < first + now; moment++) {
      if (commands) crowd_->SetCommands(index, commands + (moment * size() + index) * row);
      StepWorld(index, steps);
      crowd_->Gather(index);
      for (const Record& record : records)
        std::memcpy(record.to + (moment * size() + index) * record.bytes_per_world,
                    record.live + index * record.bytes_per_world, record.bytes_per_world);
    }
  });
}

void Batch::Reset(const Indices& which, const std::vector<uint64_t>& seeds) {
  const Use use(this);
  const GilRelease no_gil;
  for (size_t i = 0; i < which.size(); i++) seeds_[which[i]] = seeds[i];
  ForEach(which, [&](size_t index) {
    Load(index);
    crowd_->ClearCommands(index);
  });
  ForEach(which, [&](size_t index) { crowd_->Gather(index); });
}

void Batch::Restore(const Indices& which, const Snapshot& from) {
  const Use use(this);
  const GilRelease no_gil;
  ForEach(which, [&](size_t index) {
    if (!WorldAt(index)) Load(index);
    const Complaints complaints;
    if (!worlds_[index]->Restore(from))
      throw Failure{Kind::kStage, complaints.Last("the snapshot doesn't fit")};
    worlds_[index]->CancelQuit();
    failures_[index].clear();
    crowd_->Gather(index);
  });
}

Snapshot Batch::Take(uint32_t index) {
  const Use use(this);
  const World& world = WorldOf(index);
  const GilRelease no_gil;
  const Complaints complaints;
  Snapshot snapshot;
  if (!world.Take(&snapshot))
    throw Failure{Kind::kStage, complaints.Last("no snapshot can be taken")};
  return snapshot;
}

std::vector<uint64_t> Batch::StateHashes() {
  const Use use(this);
  const GilRelease no_gil;
  std::vector<uint64_t> hashes(size());
  ForEach(All(), [&](size_t index) {
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
    crowd_->Teleport(i, poses + 3 * i * crowd_->size(), which + i * crowd_->size());
    crowd_->Gather(i);
  }
}

}  // namespace Stg::python
