// SPDX-License-Identifier: GPL-2.0-or-later

#include "batch.hh"

#include <algorithm>
#include <cstring>
#include <set>

#include "array_groups.hh"
#include "gil.hh"
#include "signals.hh"
#include "world/world.hh"
#include "worlds/pool_access.hh"
#include "worlds/world_states.hh"

namespace Stg::python {

namespace {

/// Creates a pool of copies of the worlds. Throws Failure.
std::unique_ptr<WorldPool> PoolOf(const std::vector<Simulation*>& prototypes,
                                  const std::vector<uint64_t>& seeds,
                                  const std::vector<uint32_t>& variants, unsigned threads,
                                  const std::optional<std::string>& device,
                                  const std::vector<std::string>& placed, bool branch) {
  const std::set<Simulation*> once(prototypes.begin(), prototypes.end());
  std::vector<std::unique_ptr<Source::Use>> uses;
  for (Simulation* const prototype : once) uses.push_back(std::make_unique<Source::Use>(prototype));
  const ErrorCollector collector;
  WorldPoolOptions options;
  options.threads = threads;
  options.device_steps = device.has_value();
  options.device_choice = device.value_or("");
  options.placed = placed;
  options.branch = branch;
  std::vector<const World*> worlds;
  for (Simulation* const prototype : prototypes) worlds.push_back(&prototype->world());
  auto pool = std::make_unique<WorldPool>(worlds, seeds, variants, options);
  if (!pool->IsReady()) throw Failure{Kind::kStage, collector.Last("the world can't be copied")};
  return pool;
}

std::unique_ptr<WorldPool> AnotherPool(Batch* other, const WorldPool& pool,
                                       const std::vector<uint64_t>& seeds) {
  const Source::Use use(other);
  return std::make_unique<WorldPool>(pool, seeds);
}

}  // namespace

Batch::Batch(const std::vector<Simulation*>& prototypes, const std::vector<uint64_t>& seeds,
             const std::vector<uint32_t>& variants, unsigned threads,
             const std::optional<std::string>& device, const std::vector<std::string>& placed,
             bool branch)
    : pool_(PoolOf(prototypes, seeds, variants, threads, device, placed, branch)) {
  MakeWorlds();
}

Batch::Batch(Batch* other, const std::vector<uint64_t>& seeds)
    : pool_(AnotherPool(other, *other->pool_, seeds)) {
  MakeWorlds();
}

/// Throws Failure if a world cannot be made.
void Batch::MakeWorlds() {
  const GilRelease no_gil;
  pool_->Make(pool_->All());
  for (uint32_t i = 0; i < size(); i++)
    if (!pool_->Failure(i).empty()) throw Failure{Kind::kWorld, pool_->Failure(i)};
}

void Batch::MakeCrowd(const std::vector<Crowd::Robots>& robots, bool shares_scene) {
  crowd_ = std::make_shared<Crowd>(weak_from_this(), robots, size(), false);
  if (!device().empty() && shares_scene && !PoolAccess::HasControlsOnHost(*pool_))
    device_crowd_ = std::make_shared<DeviceCrowd>(shared_from_this(), crowd_);
}

void Batch::SetPrototype(uint32_t variant, Simulation* prototype, const Crowd::Robots& robots,
                         const std::vector<rows::VariedNumber>& varied) {
  const Use use(this);
  const Source::Use use_of_prototype(prototype);
  const World& world = prototype->world();
  if (const std::string why = crowd_->WhyNoRoom(world, robots); !why.empty())
    throw Failure{Kind::kStage, "the scene doesn't fit into this batch, because " + why};
  const GilRelease no_gil;
  const ErrorCollector collector;
  if (!PoolAccess::SetPrototype(*pool_, variant, world, varied))
    throw Failure{Kind::kStage, collector.Last("the world can't be copied")};
  crowd_->SetRobots(variant, robots);
}

World* Batch::WorldAt(size_t index) const {
  return PoolAccess::Borrow(*pool_, static_cast<uint32_t>(index));
}

Model* Batch::Find(size_t index, const ModelKey& key) const {
  World* const world = WorldAt(index);
  return world ? world->FindModel(key.id) : nullptr;
}

/// Throws Failure if the world does not exist.
void Batch::Look(uint32_t index, const std::function<void(World& world)>& look) const {
  if (!pool_->Look(index, look))
    throw Failure{Kind::kGone, "there is no world number " + std::to_string(index)};
}

/// Fills in the arrays of worlds after each round.
class Batch::Gatherer : public StepObserver {
 public:
  explicit Gatherer(Batch* batch) : batch_(*batch) {}

  bool TakesPartInSteps() const override { return false; }
  void AfterRound(uint32_t id, uint64_t, uint64_t, Outcome) override {
    batch_.crowd_->Gather(batch_, id);
  }
  void BetweenRounds() override { signals_.Poll(); }

 protected:
  Batch& batch_;

 private:
  SignalChecks signals_;
};

/// A gatherer that also applies the commands before each step of a world.
class Batch::Stepper : public Gatherer {
 public:
  using Gatherer::Gatherer;

  bool TakesPartInSteps() const override { return true; }
  void BeforeStep(uint32_t id, uint64_t) override { batch_.crowd_->Command(batch_, id); }
  uint64_t StepsAtOnce(uint32_t, uint64_t) override { return UINT64_MAX; }
};

/// Sets the commands before the first step of each moment, and copies the arrays after the last.
class Batch::Recorder : public StepObserver {
 public:
  Recorder(Batch* batch, const double* commands, uint64_t steps, const std::vector<Record>& records,
           bool* recorded)
      : batch_(*batch),
        commands_(commands),
        steps_(steps),
        records_(records),
        recorded_(recorded) {}

  void BeforeStep(uint32_t id, uint64_t step) override {
    if (step % steps_ == 0) SetCommands(id, step / steps_);
    batch_.crowd_->Command(batch_, id);
  }
  uint64_t StepsAtOnce(uint32_t, uint64_t step) override { return steps_ - step % steps_; }
  void AfterStep(uint32_t id, uint64_t step) override {
    if ((step + 1) % steps_ != 0) return;
    batch_.crowd_->Gather(batch_, id);
    Copy(id, step / steps_);
  }
  void AfterRound(uint32_t id, uint64_t first, uint64_t end, Outcome outcome) override {
    if (outcome == kMadeAllSteps) return;
    batch_.crowd_->Gather(batch_, id);
    if (outcome == kHasFailed) return;
    for (uint64_t moment = first / steps_; moment < end / steps_; moment++) {
      if (recorded_[Place(id, moment)]) continue;
      SetCommands(id, moment);
      Copy(id, moment);
    }
  }
  void BetweenRounds() override { signals_.Poll(); }

  void SetCommands(uint32_t id, uint64_t moment) {
    if (!commands_) return;
    const size_t numbers = 3 * batch_.crowd_->size();
    batch_.crowd_->SetCommands(id, commands_ + Place(id, moment) * numbers);
  }
  void Copy(uint32_t id, uint64_t moment) {
    const size_t place = Place(id, moment);
    for (const Record& record : records_)
      std::memcpy(record.to + place * record.bytes_per_world,
                  record.live + id * record.bytes_per_world, record.bytes_per_world);
    recorded_[place] = true;
  }

 private:
  /// Index of the world's row in an array of all moments.
  size_t Place(uint32_t id, uint64_t moment) const {
    return static_cast<size_t>(moment) * batch_.size() + id;
  }

  Batch& batch_;
  const double* const commands_;
  const uint64_t steps_;
  const std::vector<Record>& records_;
  bool* const recorded_;
  SignalChecks signals_;
};

/// Steps worlds of several variants on the device, with arrays on the host. Commands that
/// controllers may replace are given before each step.
void Batch::StepVariants(const Indices& which, uint64_t steps) {
  const bool are_replaced = std::ranges::any_of(which, [&](uint32_t id) {
    const rows::Scene* const scene = PoolAccess::SceneOf(*pool_, id);
    return scene && !scene->controls.groups.empty();
  });
  Gatherer gatherer(this);
  for (uint64_t done = 0; done < steps; done += are_replaced ? 1 : steps) {
    pool_->ForEach(which, [&](uint32_t id) {
      if (pool_->Failure(id).empty()) crowd_->Command(*this, id);
    });
    pool_->Step(which, are_replaced ? 1 : steps, &gatherer);
  }
}

void Batch::Step(const Indices& which, uint64_t steps) {
  const Use use(this);
  const GilRelease no_gil;
  logs_.empty() ? StepWorlds(which, steps) : StepLogged(which, steps);
}

void Batch::StepWorlds(const Indices& which, uint64_t steps) {
  if (device_crowd_) return device_crowd_->Step(which, steps);
  if (!device().empty()) return StepVariants(which, steps);
  Stepper stepper(this);
  pool_->Step(which, steps, &stepper);
}

void Batch::Rollout(const double* commands, size_t moments, uint64_t steps,
                    const std::vector<Record>& records, bool* recorded) {
  const Use use(this);
  const GilRelease no_gil;
  Recorder recorder(this, commands, steps, records, recorded);
  if (logs_.empty()) return pool_->Step(pool_->All(), moments * steps, &recorder, steps);
  for (size_t moment = 0; moment < moments; moment++) {
    pool_->ForEach(pool_->All(), [&](uint32_t id) { recorder.SetCommands(id, moment); });
    StepLogged(pool_->All(), steps);
    for (const uint32_t id : pool_->All())
      if (pool_->Failure(id).empty()) recorder.Copy(id, moment);
  }
}

void Batch::Reset(const Indices& which, const std::optional<std::vector<uint64_t>>& given,
                  const std::optional<std::vector<uint32_t>>& variants,
                  const std::optional<PoolAccess::OwnValues>& values) {
  const Use use(this);
  const GilRelease no_gil;
  std::vector<uint64_t> seeds = given.value_or(std::vector<uint64_t>());
  if (!given)
    for (const uint32_t index : which) seeds.push_back(pool_->seeds()[index]);
  if (device_crowd_) return device_crowd_->Reset(which, seeds, variants, values);
  if (variants && values)
    PoolAccess::Reset(*pool_, which, seeds, *variants, values->data, values->most);
  else if (variants)
    pool_->Reset(which, seeds, *variants);
  else
    pool_->Reset(which, seeds);
  pool_->ForEach(which, [&](uint32_t index) {
    crowd_->ClearCommands(index);
    crowd_->Gather(*this, index);
  });
}

void Batch::CarryToVariant(uint32_t variant, const PoolAccess::OwnValues& values) {
  const Use use(this);
  const GilRelease no_gil;
  device_crowd_->CarryToVariant(variant, values);
}

std::vector<std::vector<double>> Batch::ValuesOfAll() {
  const Use use(this);
  std::vector<std::vector<double>> values;
  for (uint32_t id = 0; id < size(); id++) values.push_back(PoolAccess::Values(*pool_, id));
  return values;
}

std::vector<double> Batch::ValuesOf(uint32_t index) {
  const Use use(this);
  if (index >= size()) throw nb::index_error("found another number than that of a world");
  return PoolAccess::Values(*pool_, index);
}

/// Updates the arrays of these worlds.
void Batch::Gather(const Indices& which) {
  if (device_crowd_) return device_crowd_->Update();
  pool_->ForEach(which, [&](uint32_t index) { crowd_->Gather(*this, index); });
}

void Batch::Restore(const Indices& which, const Snapshot& from) {
  const Use use(this);
  const GilRelease no_gil;
  pool_->Restore(which, from);
  Gather(which);
}

void Batch::Reseed(const std::vector<uint64_t>& seeds) {
  const Use use(this);
  const GilRelease no_gil;
  pool_->ForEach(pool_->All(), [&](uint32_t id) {
    if (PoolAccess::RowToChange(*pool_, id))
      PoolAccess::Reseed(*pool_, id, seeds[id]);
    else if (World* const world = WorldAt(id))
      world->Reseed(seeds[id]);
  });
}

Snapshot Batch::Take(uint32_t index) {
  const Use use(this);
  const GilRelease no_gil;
  const ErrorCollector collector;
  Snapshot snapshot;
  bool taken = false;
  Look(index, [&](const World& world) { taken = world.Take(&snapshot); });
  if (!taken) throw Failure{Kind::kStage, collector.Last("no snapshot can be taken")};
  return snapshot;
}

std::vector<uint64_t> Batch::StateHashes() {
  const Use use(this);
  const GilRelease no_gil;
  return pool_->StateHashes(pool_->All());
}

namespace {

/// Calls f, and turns a StateError into a Failure.
template <typename F>
void WithStates(F f) {
  try {
    f();
  } catch (const StateError& error) {
    throw Failure{Kind::kStage, error.why};
  }
}

}  // namespace

size_t Batch::CountStateWords(const Indices& which, const std::vector<uint64_t>& keys) {
  const Use use(this);
  const GilRelease no_gil;
  size_t words = 0;
  WithStates([&] { words = WorldStates(pool_.get(), keys).CountWords(which); });
  return words;
}

void Batch::SaveStates(const Indices& which, const std::vector<uint64_t>& keys, size_t width,
                       uint64_t* to) {
  const Use use(this);
  const GilRelease no_gil;
  WithStates([&] { WorldStates(pool_.get(), keys).Save(which, width, to); });
}

void Batch::LoadStates(const Indices& which, const std::vector<uint64_t>& keys, size_t width,
                       const uint64_t* from) {
  const Use use(this);
  const GilRelease no_gil;
  WithStates(
      [&] { WorldStates(pool_.get(), keys).Load(which, width, from, device_crowd_ != nullptr); });
  Gather(which);
}

std::shared_ptr<Simulation> Batch::Fork(uint32_t index) {
  const Use use(this);
  std::shared_ptr<Simulation> copy;
  Look(index, [&](const World& world) { copy = Simulation::CopyOf(world); });
  return copy;
}

void Batch::Teleport(const double* poses, const bool* which) {
  const Use use(this);
  const GilRelease no_gil;
  if (device_crowd_)
    return device_crowd_->Teleport({poses, 3 * size() * crowd_->size() * sizeof *poses},
                                   {which, size() * crowd_->size()});
  const size_t robots = crowd_->size();
  const auto is_moved = [&](uint32_t id) {
    const bool* const first = which + id * robots;
    return std::find(first, first + robots, true) != first + robots;
  };
  Indices moved = pool_->All();
  std::erase_if(moved, std::not_fn(is_moved));
  pool_->ForEach(moved, [&](uint32_t id) {
    const size_t first = id * robots;
    crowd_->Teleport(*this, id, poses + 3 * first, which + first);
    crowd_->Gather(*this, id);
  });
}

void Batch::Place(const PlacedIds& models, const double* poses, const bool* which) {
  const Use use(this);
  const GilRelease no_gil;
  pool_->ForEach(pool_->All(), [&](uint32_t id) {
    const auto& ids = models[pool_->Variant(id)];
    for (size_t i = 0; i < ids.size(); i++) {
      const size_t number = id * ids.size() + i;
      const double* const to = poses + 3 * number;
      if (which[number] && ids[i]) pool_->Place(id, *ids[i], to[0], to[1], to[2]);
    }
  });
}

void Batch::FindPlaces(const PlacedIds& models, double* poses) {
  const Use use(this);
  const GilRelease no_gil;
  pool_->ForEach(pool_->All(), [&](uint32_t id) {
    const auto& ids = models[pool_->Variant(id)];
    for (size_t i = 0; i < ids.size(); i++) {
      rows::Planar place{kNaN, kNaN, kNaN};
      if (ids[i]) PoolAccess::FindPlace(*pool_, id, *ids[i], &place);
      double* const to = poses + 3 * (id * ids.size() + i);
      to[0] = place.x;
      to[1] = place.y;
      to[2] = place.a;
    }
  });
}

bool Batch::ResetFlagged(const rows::RowInput& flags) {
  const Use use(this);
  const GilRelease no_gil;
  if (!device_crowd_->CanResetFlagged()) return false;
  device_crowd_->ResetFlagged(flags);
  return true;
}

void Batch::TeleportFlagged(const rows::RowInput& poses, const rows::RowInput& which) {
  const Use use(this);
  const GilRelease no_gil;
  device_crowd_->Teleport(poses, which);
}

std::vector<uint64_t> Batch::Seeds() {
  const Use use(this);
  return pool_->seeds();
}

std::vector<uint32_t> Batch::Variants() {
  const Use use(this);
  std::vector<uint32_t> variants;
  for (uint32_t i = 0; i < size(); i++) variants.push_back(pool_->Variant(i));
  return variants;
}

std::map<uint32_t, std::string> Batch::Failures() {
  const Use use(this);
  std::map<uint32_t, std::string> failures;
  for (uint32_t i = 0; i < size(); i++)
    if (!pool_->Failure(i).empty()) failures[i] = pool_->Failure(i);
  return failures;
}

std::vector<std::string> Batch::Reasons() {
  const Use use(this);
  std::vector<std::string> reasons;
  for (uint32_t i = 0; i < size(); i++) reasons.push_back(pool_->WhyNotClosed(i));
  return reasons;
}

size_t Batch::CountObjects() {
  const Use use(this);
  size_t count = 0;
  for (uint32_t i = 0; i < size(); i++) count += PoolAccess::HasWorld(*pool_, i);
  return count;
}

void Batch::SetFailures(const std::map<uint32_t, std::string>& failures) {
  const Use use(this);
  for (const auto& [index, text] : failures)
    if (index < size()) pool_->SetFailure(index, text);
}

Batch::Metrics Batch::MetricsOfAll() {
  const Use use(this);
  Metrics metrics;
  for (size_t i = 0; i < size(); i++) {
    const auto id = static_cast<uint32_t>(i);
    const World* const world = PoolAccess::HasWorld(*pool_, id) ? WorldAt(i) : nullptr;
    if (!world) continue;  // worlds in rows have no metrics
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
