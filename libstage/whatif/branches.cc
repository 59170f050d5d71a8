// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/branches.hh"

#include <algorithm>
#include <utility>

#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "models/position.hh"
#include "world/world.hh"
#include "worlds/world_pool.hh"

namespace Stg {

void Scenario::BeforeStep(World&, uint32_t) {}
bool Scenario::AfterStep(World&, uint32_t, double*) { return false; }

namespace {

WorldPoolOptions PoolOptionsOf(const BranchOptions& options) {
  WorldPoolOptions of_pool;
  of_pool.threads = options.threads;
  of_pool.device = options.device;
  of_pool.branch = true;
  return of_pool;
}

void Apply(const Command& command, ModelPosition* position) {
  switch (command.kind) {
    case Command::kSetSpeed:
      return position->SetSpeed(command.x, command.y, command.a);
    case Command::kGoTo:
      return position->GoTo(command.x, command.y, command.a);
    case Command::kSetAcceleration:
      return position->SetAcceleration(command.x, command.y, command.a);
    case Command::kStop:
      return position->Stop();
  }
}

}  // namespace

struct Branches::Impl {
  struct Copy;
  struct Row {
    Branch seen;
    Snapshot state;
    uint64_t seed = 0;
    bool reseed = false;     // reseed before the branch's next step
    size_t applied = 0;      // number of commands carried out so far
    Copy* latest = nullptr;  // copy whose world was last in this state
  };
  /// A thread's world of the pool.
  struct Copy {
    uint32_t id;
    uint64_t times_made = 0;        // value of WorldPool::times_made() when it was last used
    const Row* resident = nullptr;  // row whose latest state the world is in
  };

  Impl(const World& prototype, uint32_t count, const BranchOptions& wanted)
      : options(wanted), pool(prototype, {}, PoolOptionsOf(wanted)), rows(count) {
    pool.Resize(std::vector<uint64_t>(pool.threads(), prototype.seed()));
    for (uint32_t id = 0; id < pool.threads(); id++) copies.push_back({id});
    ready = pool.IsReady() && pool.At(0);
  }

  static void ClearQuit(World* world) {
    world->SetQuitTime(0);
    world->CancelQuit();
  }
  World* WorldOf(Copy* copy);
  World* ExistingWorldOf(const Copy& copy);
  bool LoadState(Row* row, Copy* copy);
  void SaveState(Row* row, Copy* copy);
  void Step(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario, Copy* copy);
  bool StepOnce(Row* row, uint32_t branch, Scenario* scenario, Copy* copy);
  void ApplyCommands(Row* row, World* world);
  void RecordSightings(Row* row, const World& world) const;
  static void Fail(Row* row, Copy* copy, const std::string& why);
  /// Restores the branch in the copy's world, calls f(), and stores the resulting state.
  template <typename F>
  void WithWorld(Row* row, Copy* copy, F f);

  const BranchOptions options;
  WorldPool pool;  // one world per thread
  std::vector<Row> rows;
  std::vector<Copy> copies;  // one per thread
  bool ready = false;
};

/// Returns the copy's world, made again if a controller has deleted or unloaded it, or null if that
/// fails.
World* Branches::Impl::WorldOf(Copy* copy) {
  World* const world = pool.AtOrMake(copy->id);
  if (copy->times_made != pool.times_made(copy->id)) copy->resident = nullptr;
  copy->times_made = pool.times_made(copy->id);
  return world;
}

/// Returns the copy's world, or null if a controller has deleted or unloaded it.
World* Branches::Impl::ExistingWorldOf(const Copy& copy) {
  World* const world = pool.At(copy.id);
  return world && world->GetWorldFile() ? world : nullptr;
}

void Branches::Impl::Fail(Row* row, Copy* copy, const std::string& why) {
  row->seen.state = Branch::kFailed;
  row->seen.error = why;
  row->state = Snapshot();
  copy->resident = nullptr;
}

bool Branches::Impl::LoadState(Row* row, Copy* copy) {
  World* const world = WorldOf(copy);
  if (!world) {
    Fail(row, copy, "the world can't be copied any more");
    return false;
  }
  // With lean snapshots, the state held by the world still has readings that a restored one lacks.
  if (copy->resident == row && row->latest == copy && options.keep == Snapshot::kFull) return true;
  copy->resident = nullptr;
  messages::Collector collector;
  if (!world->Restore(row->state)) {
    Fail(row, copy, collector.lines.empty() ? "can't be restored" : collector.lines.back());
    return false;
  }
  if (row->reseed) world->Reseed(row->seed);
  row->reseed = false;
  return true;
}

void Branches::Impl::SaveState(Row* row, Copy* copy) {
  World* const world = ExistingWorldOf(*copy);
  if (!world) return Fail(row, copy, "its world has been deleted or unloaded");
  messages::Collector collector;
  if (world->Take(&row->state, options.keep)) {
    copy->resident = row;
    row->latest = copy;
    return;
  }
  Fail(row, copy, collector.lines.empty() ? "can't be kept" : collector.lines.back());
}

template <typename F>
void Branches::Impl::WithWorld(Row* row, Copy* copy, F f) {
  try {
    if (!LoadState(row, copy)) return;
    f();
    SaveState(row, copy);
  } catch (...) {
    Fail(row, copy, DescribeException());
  }
}

void Branches::Impl::Step(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario,
                          Copy* copy) {
  WithWorld(row, copy, [&] {
    for (uint64_t i = 0; i < steps; i++)
      if (!StepOnce(row, branch, scenario, copy)) return;
  });
}

/// Steps the branch once. Returns false if it has ended.
bool Branches::Impl::StepOnce(Row* row, uint32_t branch, Scenario* scenario, Copy* copy) {
  World* const world = ExistingWorldOf(*copy);
  if (!world) return false;
  ApplyCommands(row, world);
  if (scenario) scenario->BeforeStep(*world, branch);
  world->Update();
  if (!ExistingWorldOf(*copy)) return false;
  row->seen.steps++;
  RecordSightings(row, *world);
  bool ends = world->TestQuit();
  if (scenario) ends |= scenario->AfterStep(*world, branch, &row->seen.score);
  if (ends) row->seen.state = Branch::kEnded;
  ClearQuit(world);
  return !ends;
}

void Branches::Impl::ApplyCommands(Row* row, World* world) {
  const std::vector<Command>& commands = row->seen.commands;
  for (; row->applied < commands.size() && commands[row->applied].step <= row->seen.steps;
       row->applied++) {
    const Command& command = commands[row->applied];
    if (auto* position = dynamic_cast<ModelPosition*>(world->FindModel(command.model)))
      Apply(command, position);
  }
}

void Branches::Impl::RecordSightings(Row* row, const World& world) const {
  for (const uint32_t id : options.watched) {
    const Model* const model = world.FindModel(id);
    Sighting sighting = {Pose(), Velocity(), false};
    if (model) {
      sighting.pose = model->GetGlobalPose();
      sighting.stalled = model->Stalled();
      if (auto* position = dynamic_cast<const ModelPosition*>(model))
        sighting.velocity = position->GetVelocity();
    }
    row->seen.sightings.push_back(sighting);
  }
}

Branches::Branches(const World& prototype, uint32_t count, const BranchOptions& options)
    : impl_(new Impl(prototype, count, options)) {}

Branches::~Branches() = default;

bool Branches::IsReady() const { return impl_->ready; }

uint32_t Branches::count() const { return static_cast<uint32_t>(impl_->rows.size()); }

unsigned Branches::threads() const { return static_cast<unsigned>(impl_->copies.size()); }

void Branches::Resize(uint32_t count) {
  for (Impl::Copy& copy : impl_->copies) copy.resident = nullptr;
  impl_->rows.resize(count);
}

const Branch& Branches::operator[](uint32_t branch) const { return impl_->rows[branch].seen; }

void Branches::Restore(uint32_t branch, const Snapshot& from) {
  Impl::Row& row = impl_->rows[branch];
  Branch& seen = row.seen;
  seen.state = from.empty() || !impl_->ready ? Branch::kFailed : Branch::kAlive;
  seen.error = !impl_->ready  ? "there is no world to branch from"
               : from.empty() ? "the snapshot was never taken"
                              : "";
  seen.steps = 0;
  seen.score = 0;
  seen.commands.clear();
  seen.sightings.clear();
  row.state = from;
  row.reseed = false;
  row.applied = 0;
  row.latest = nullptr;
}

void Branches::Restore(uint32_t branch, const Snapshot& from, uint64_t seed) {
  Restore(branch, from);
  impl_->rows[branch].seed = seed;
  impl_->rows[branch].reseed = true;
}

void Branches::Give(uint32_t branch, const Command& command) {
  std::vector<Command>& commands = impl_->rows[branch].seen.commands;
  if (command.step < impl_->rows[branch].seen.steps) return;
  const auto place =
      std::upper_bound(commands.begin(), commands.end(), command,
                       [](const Command& a, const Command& b) { return a.step < b.step; });
  commands.insert(place, command);
}

void Branches::Retire(uint32_t branch) {
  Branch& seen = impl_->rows[branch].seen;
  if (seen.state == Branch::kAlive) seen.state = Branch::kRetired;
}

void Branches::Step(uint64_t steps, Scenario* scenario) {
  std::vector<uint32_t> alive;
  for (uint32_t branch = 0; branch < count(); branch++)
    if (impl_->rows[branch].seen.state == Branch::kAlive) alive.push_back(branch);
  impl_->pool.Run(alive.size(), [&](size_t i, unsigned thread) {
    impl_->Step(&impl_->rows[alive[i]], alive[i], steps, scenario, &impl_->copies[thread]);
  });
}

bool Branches::Visit(uint32_t branch, const std::function<void(World&)>& visit) {
  Impl::Row& row = impl_->rows[branch];
  if (row.state.empty()) return false;
  Impl::Copy& copy = impl_->copies[0];
  impl_->WithWorld(&row, &copy, [&] { visit(*impl_->pool.At(copy.id)); });
  return row.seen.state != Branch::kFailed;
}

Snapshot Branches::StateOf(uint32_t branch) const { return impl_->rows[branch].state; }

}  // namespace Stg
