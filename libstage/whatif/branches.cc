// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/branches.hh"

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>

#include "messages/report.hh"
#include "models/position.hh"
#include "whatif/branches_impl.hh"

namespace Stg {

bool Scenario::NeedsWorld() const { return true; }
void Scenario::BeforeStep(World&, uint32_t) {}
bool Scenario::AfterStep(World&, uint32_t, double*) { return false; }
bool Scenario::Watch(const Sighting*, uint32_t, double*) { return false; }

namespace {

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
  row->models = nullptr;
  row->state = Snapshot();
  row->origin.reset();
  copy->resident = nullptr;
}

void Branches::Impl::Refuse(Row* row, Copy* copy, const CommandRefused& refused) {
  Fail(row, copy, refused.why);
  row->seen.refused = true;
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
  row->origin.reset();
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
  } catch (const CommandRefused& refused) {
    Refuse(row, copy, refused);
  } catch (...) {
    Fail(row, copy, DescribeException());
  }
}

void Branches::Impl::Step(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario,
                          bool needs_world, Copy* copy) {
  uint64_t left = steps;
  try {
    if (!needs_world && row->can_be_row && BecomeRow(row, branch))
      left = StepRow(row, branch, steps, scenario);
    if (left == 0) return;
    BecomeSnapshot(row, branch, copy);
  } catch (const CommandRefused& refused) {
    return Refuse(row, copy, refused);
  } catch (...) {
    return Fail(row, copy, DescribeException());
  }
  if (row->seen.state != Branch::kAlive) return;
  WithWorld(row, copy, [&] {
    for (uint64_t i = 0; i < left; i++)
      if (!StepOnce(row, branch, scenario, needs_world, copy)) return;
  });
}

/// Steps the branch once. Returns false if it has ended.
bool Branches::Impl::StepOnce(Row* row, uint32_t branch, Scenario* scenario, bool needs_world,
                              Copy* copy) {
  World* const world = ExistingWorldOf(*copy);
  if (!world) return false;
  ApplyCommands(row, world);
  row->check.CheckReplaced(*world);
  if (needs_world) scenario->BeforeStep(*world, branch);
  row->check.BeginStep(*world, row->seen.steps);
  world->Update();
  if (!ExistingWorldOf(*copy)) return false;
  row->check.EndStep(*world);
  row->seen.steps++;
  RecordSightings(row, *world);
  bool ends = world->TestQuit();
  if (needs_world) ends |= scenario->AfterStep(*world, branch, &row->seen.score);
  if (scenario) ends |= scenario->Watch(LatestOf(*row), branch, &row->seen.score);
  if (ends) row->seen.state = Branch::kEnded;
  ClearQuit(world);
  return !ends;
}

void Branches::Impl::StepOnHost(const std::vector<Rest>& rest, Scenario* scenario,
                                bool needs_world) {
  for (const Rest& of : rest) FetchRow(of.branch);
  pool.Run(rest.size(), [&](size_t i, unsigned thread) {
    Step(&rows[rest[i].branch], rest[i].branch, rest[i].steps, scenario, needs_world,
         &copies[thread]);
  });
}

void Branches::Impl::ApplyCommands(Row* row, World* world) {
  const std::vector<Command>& commands = row->seen.commands;
  for (; row->applied < commands.size() && commands[row->applied].step <= row->seen.steps;
       row->applied++) {
    const Command& command = commands[row->applied];
    Model* const model = world->FindModel(command.model);
    CommandCheck::Check(command, model);
    Apply(command, static_cast<ModelPosition*>(model));
    row->check.Note(command, *world);
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

// ---- branches that are rows ---------------------------------------------------------------------

/// Branches that start from one snapshot share its origin, if it is one of the last that were used.
std::shared_ptr<Branches::Impl::Origin> Branches::Impl::OriginOf(const Snapshot& from) {
  const auto known = std::ranges::find_if(
      recent, [&](const auto& origin) { return origin->snapshot.IsCopyOf(from); });
  if (known != recent.end()) {
    std::rotate(known, known + 1, recent.end());
    return recent.back();
  }
  if (recent.size() == kRecent) recent.erase(recent.begin());
  return recent.emplace_back(std::make_shared<Origin>(from));
}

const RowModels* Branches::Impl::ModelsOf(const rows::Scene& scene) {
  const std::lock_guard lock(making_models);
  std::unique_ptr<const RowModels>& known = models[&scene];
  if (!known) known = std::make_unique<RowModels>(scene, options.watched);
  return known.get();
}

/// Reads the state of the branch for rows, if no other branch has done so. Returns false if rows
/// cannot hold it.
bool Branches::Impl::ReadOrigin(Row* row) {
  if (!options.rows || !row->can_be_row) return false;
  if (!row->origin) row->origin = std::make_shared<Origin>(row->state);
  Origin& origin = *row->origin;
  std::call_once(origin.once, [&] {
    if (!origin.row) origin.row = PoolAccess::ReadSnapshot(pool, origin.snapshot);
  });
  return row->can_be_row = bool(origin.row);
}

/// Puts the row of the branch into the state of its origin.
void Branches::Impl::RestoreRow(const Row& row, uint32_t branch, bool reseeds) {
  PoolAccess::Restore(pool, IdOf(branch), row.origin->row);
  if (reseeds) PoolAccess::Reseed(pool, IdOf(branch), row.seed);
}

/// Makes the branch a row of the pool. Returns false if rows cannot hold its state.
bool Branches::Impl::BecomeRow(Row* row, uint32_t branch) {
  if (row->models) return true;
  if (!ReadOrigin(row)) return false;
  RestoreRow(*row, branch, row->reseed);
  row->reseed = false;
  row->models = ModelsOf(row->origin->row.rows->scene());
  row->at = {};
  row->state = Snapshot();
  row->origin.reset();
  row->latest = nullptr;
  return true;
}

/// The state of a branch that is a row. Throws WorldFailure.
Snapshot Branches::Impl::TakeOf(uint32_t branch) {
  Snapshot state;
  PoolAccess::Take(pool, IdOf(branch), &state, options.keep);
  return state;
}

void Branches::Impl::BecomeSnapshot(Row* row, uint32_t branch, Copy* copy) {
  if (!row->models) return;
  messages::Collector collector;
  row->state = TakeOf(branch);
  row->models = nullptr;
  row->origin.reset();
  if (row->state.empty())
    Fail(row, copy, collector.lines.empty() ? "can't be kept" : collector.lines.back());
}

/// Returns false if a command that is due needs a World. Throws CommandRefused.
bool Branches::Impl::ApplyCommands(Row* row, const PoolRow& at) {
  const std::vector<Command>& commands = row->seen.commands;
  for (; row->applied < commands.size() && commands[row->applied].step <= row->seen.steps;
       row->applied++) {
    if (!row->models->CanApply(commands[row->applied])) return false;
    row->models->Apply(commands[row->applied], at.rows, at.row);
  }
  return true;
}

/// Steps a branch that is a row, and returns the number of steps that are left and need a World.
/// Nobody sees readings between the steps; but a scenario may end the branch after each of them,
/// and its state then has the readings unless they are omitted.
uint64_t Branches::Impl::StepRow(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario) {
  const PoolRow at = PoolAccess::RowToChange(pool, IdOf(branch));
  const uint64_t omitted = options.keep == Snapshot::kLean ? 1 : 0;
  uint64_t left = steps;
  while (left > 0 && row->seen.state == Branch::kAlive) {
    if (!ApplyCommands(row, at)) {
      row->can_be_row = false;
      break;
    }
    left--;
    PoolAccess::StepRow(pool, IdOf(branch), (scenario ? 0 : left) + omitted);
    row->seen.steps++;
    BeginSightings(row);
    row->models->Watch(*at.rows, at.row, &row->seen.sightings);
    if (scenario && scenario->Watch(LatestOf(*row), branch, &row->seen.score))
      row->seen.state = Branch::kEnded;
  }
  steps_in_rows += steps - left;
  return row->seen.state == Branch::kAlive ? left : 0;
}

// ---- interface ----------------------------------------------------------------------------------

Branches::Branches(const World& prototype, uint32_t count, const BranchOptions& options)
    : impl_(new Impl(prototype, count, options)) {}

Branches::~Branches() = default;

bool Branches::IsReady() const { return impl_->ready; }

uint32_t Branches::count() const { return static_cast<uint32_t>(impl_->rows.size()); }

unsigned Branches::threads() const { return static_cast<unsigned>(impl_->copies.size()); }

void Branches::Resize(uint32_t count) {
  for (Impl::Copy& copy : impl_->copies) copy.resident = nullptr;
  impl_->Resize(count);
}

std::string Branches::WhyNotClosed() const {
  if (!impl_->options.rows) return "the options say so";
  return PoolAccess::WhyNoRows(impl_->pool);
}

uint64_t Branches::steps_in_rows() const { return impl_->steps_in_rows; }

std::string Branches::StepDevice() const {
  return impl_->uses_device ? impl_->pool.StepDevice() : "";
}

std::string Branches::WhyNotOnDevice() const {
  if (!impl_->uses_device)
    return impl_->pool.StepDevice().empty() ? "the options name no device" : "it has failed";
  const std::string reason = WhyNotClosed();
  return reason.empty() ? PoolAccess::WhyNotOnDevice(impl_->pool) : reason;
}

uint64_t Branches::steps_on_device() const { return impl_->steps_on_device; }

const Branch& Branches::operator[](uint32_t branch) const { return impl_->rows[branch].seen; }

void Branches::Impl::Start(uint32_t branch, std::shared_ptr<Origin> from) {
  Row& row = rows[branch];
  Branch& seen = row.seen;
  seen.steps = 0;
  seen.score = 0;
  seen.commands.clear();
  seen.sightings.clear();
  seen.refused = false;
  row.check.Clear();
  row.models = nullptr;
  row.state = from ? from->snapshot : Snapshot();
  row.origin = std::move(from);
  row.can_be_row = true;
  row.records = true;
  row.needs_end = true;
  row.reseed = false;
  row.applied = 0;
  row.latest = nullptr;
}

void Branches::Restore(uint32_t branch, const Snapshot& from) {
  const bool can_start = impl_->ready && !from.empty();
  impl_->Start(branch, can_start ? impl_->OriginOf(from) : nullptr);
  Branch& seen = impl_->rows[branch].seen;
  seen.state = can_start ? Branch::kAlive : Branch::kFailed;
  seen.error = !impl_->ready  ? "there is no world to branch from"
               : from.empty() ? "the snapshot was never taken, or World::Take() has refused it"
                              : "";
}

void BranchAccess::Restore(Branches& branches, uint32_t branch, std::shared_ptr<Origin> from,
                           bool records) {
  branches.impl_->Start(branch, std::move(from));
  branches.impl_->rows[branch].records = records;
  branches.impl_->rows[branch].needs_end = false;
  Branch& seen = branches.impl_->rows[branch].seen;
  seen.state = Branch::kAlive;
  seen.error.clear();
}

void Branches::Restore(uint32_t branch, const Snapshot& from, uint64_t seed) {
  Restore(branch, from);
  impl_->rows[branch].seed = seed;
  impl_->rows[branch].reseed = true;
}

void Branches::Give(uint32_t branch, const Command& command) {
  Impl::Row& row = impl_->rows[branch];
  if (row.seen.state != Branch::kAlive) return;
  if (command.step < row.seen.steps)
    return Impl::Refuse(&row, &impl_->copies[0], {CommandCheck::TooLate(command, row.seen.steps)});
  std::vector<Command>& commands = row.seen.commands;
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
  if (steps == 0) return;
  const bool needs_world = scenario && scenario->NeedsWorld();
  std::vector<uint32_t> alive;
  for (uint32_t branch = 0; branch < count(); branch++)
    if (impl_->rows[branch].seen.state == Branch::kAlive) alive.push_back(branch);
  std::vector<Impl::Rest> rest;
  if (impl_->uses_device && !needs_world)
    rest = impl_->StepOnDevice(alive, steps, scenario);
  else
    for (const uint32_t branch : alive) rest.push_back({branch, steps});
  impl_->StepOnHost(rest, scenario, needs_world);
}

bool Branches::Visit(uint32_t branch, const std::function<void(World&)>& visit) {
  Impl::Row& row = impl_->rows[branch];
  Impl::Copy& copy = impl_->copies[0];
  impl_->FetchRow(branch);
  try {
    impl_->BecomeSnapshot(&row, branch, &copy);
  } catch (...) {
    Impl::Fail(&row, &copy, DescribeException());
  }
  if (row.state.empty()) return false;
  impl_->WithWorld(&row, &copy, [&] { visit(*impl_->pool.At(copy.id)); });
  return row.seen.state != Branch::kFailed;
}

Snapshot Branches::StateOf(uint32_t branch) const {
  if (!impl_->rows[branch].models) return impl_->rows[branch].state;
  const std::lock_guard lock(impl_->taking);
  impl_->FetchRow(branch);
  try {
    return impl_->TakeOf(branch);
  } catch (...) {
    return Snapshot();
  }
}

}  // namespace Stg
