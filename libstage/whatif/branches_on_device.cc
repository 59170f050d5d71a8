// SPDX-License-Identifier: GPL-2.0-or-later
//
// Branches whose rows a device steps. A state from which several branches start is sent once and
// copied there. Launches end where commands are due, and after each step if models are watched; the
// host then gets the poses, velocities and stalls of these only. If nobody asks for the states of
// branches that have ended, the device makes many steps before the host looks at all of them; those
// after the end of a branch are wasted. After an error of the device, the host starts branches from
// their origins again and repeats their steps.

#include <algorithm>
#include <atomic>
#include <map>
#include <optional>
#include <span>
#include <utility>

#include "messages/report.hh"
#include "rows/row_bridge.hh"
#include "whatif/branches_impl.hh"

namespace Stg {

namespace {

/// Columns that a new seed changes; see Rows::CopyRandomNumbers().
constexpr rows::ColumnSet kRandomNumbers = 1u << ROW_SEED | 1u << ROW_RANDOM | 1u << ROW_NOISE;
/// Number of branches from which on sending their common state saves more than it costs.
constexpr size_t kFewBranches = 4;
/// Steps of a launch, which should not take too long.
constexpr uint64_t kMostSteps = 64;
/// Branches that a thread watches at a time.
constexpr size_t kGrain = 64;
/// Steps that are made before the host looks at them, at most.
constexpr size_t kMostAhead = 16;

}  // namespace

// ---- steps --------------------------------------------------------------------------------------

/// Steps of branches that are in the same rows.
class Branches::Impl::DeviceRun {
 public:
  DeviceRun(Impl* of, rows::Rows* in, const std::vector<uint32_t>& branches, uint64_t steps,
            Scenario* scenario);
  /// Adds branches that a command makes leave the device to `rest`. Throws rows::RowDeviceError.
  void Run(std::vector<Rest>* rest);

 private:
  struct Member {
    uint32_t branch, place;
    Row* row;
  };

  bool Watches() const { return scenario_ || !of_.options.watched.empty(); }
  void RestoreStarts();
  void GiveCommands(std::vector<Rest>* rest);
  void GiveCommandsAhead(uint64_t made);
  bool TryAddCommands(const Member& member);
  bool AddCommands(const Member& member, uint64_t step);
  bool CanApplyAhead(const Command& command) const;
  void AddCommand(const row_given_t& given, size_t first);
  uint64_t StepsOfLaunch() const;
  uint64_t StepsAhead() const;
  void Launch(uint64_t steps);
  void LaunchWatched(uint64_t steps, uint32_t unseen);
  void StepMembers(uint64_t steps, uint32_t unseen);
  void NoteFailures(const std::vector<ControlFailure>& failures);
  void Watch(uint64_t steps);
  void Watch(const Member& member, const double* numbers);
  void RemoveEnded();

  Impl& of_;
  rows::Rows& rows_;
  rows::DeviceRows* const device_;
  const RowModels& models_;
  Scenario* const scenario_;
  uint64_t left_;
  bool goes_ahead_ = true;       // the host may look at several steps at once
  std::vector<Member> members_;  // that are alive
  std::vector<uint32_t> places_;
  std::vector<row_given_t> given_;
};

Branches::Impl::DeviceRun::DeviceRun(Impl* of, rows::Rows* in,
                                     const std::vector<uint32_t>& branches, uint64_t steps,
                                     Scenario* scenario)
    : of_(*of),
      rows_(*in),
      device_(PoolAccess::OnDevice(of->pool, in)),
      models_(*of->rows[branches[0]].models),
      scenario_(scenario),
      left_(steps) {
  for (const uint32_t branch : branches) {
    Row* const row = &of_.rows[branch];
    members_.push_back({branch, static_cast<uint32_t>(row->at.row), row});
    goes_ahead_ &= !row->needs_end;
    std::vector<Sighting>& sightings = row->seen.sightings;
    const size_t needed =
        sightings.size() + (row->records ? steps : 1) * of_.options.watched.size();
    if (Watches() && needed > sightings.capacity())
      sightings.reserve(std::max(needed, 2 * sightings.capacity()));
  }
}

void Branches::Impl::DeviceRun::Run(std::vector<Rest>* rest) {
  goes_ahead_ &= Watches() && !device_->has_controls_on_host();
  if (Watches()) device_->Watch(models_.watched_movers(), goes_ahead_ ? kMostAhead : 1);
  RestoreStarts();
  while (left_ > 0) {
    GiveCommands(rest);
    if (members_.empty()) break;
    Launch(StepsOfLaunch());
  }
  device_->device().Finish();
}

/// Sends the states of branches that have just been restored: those of origins with the random
/// numbers of branches that are reseeded, and whole ones.
void Branches::Impl::DeviceRun::RestoreStarts() {
  std::vector<const rows::Rows*> starts;
  std::vector<uint32_t> whole, places[2], start_of[2];
  std::map<const Origin*, uint32_t> known;
  const Origin* last = nullptr;
  uint32_t number = 0;
  for (const Member& member : members_) {
    Row::Start& start = member.row->start;
    if (!std::exchange(start.is_pending, false)) continue;
    const Origin* const origin = member.row->origin.get();
    if (origin != last) {
      const auto [at, is_new] = known.try_emplace(origin, static_cast<uint32_t>(starts.size()));
      if (is_new) starts.push_back(origin->row.rows.get());
      number = at->second;
      last = origin;
    }
    if (start.is_whole) {
      whole.push_back(member.place);
    } else {
      places[start.reseeds].push_back(member.place);
      start_of[start.reseeds].push_back(number);
    }
  }
  if (starts.empty()) return;
  PoolAccess::NoteDeviceSteps(of_.pool, &rows_);
  device_->Restore(places[0], starts, start_of[0], rows_, 0);
  device_->Restore(places[1], starts, start_of[1], rows_, kRandomNumbers);
  const std::vector<uint32_t> any(whole.size(), 0);
  device_->Restore(whole, std::span(starts).first(1), any, rows_, rows::kAllColumns);
}

/// Gives all commands that are due.
void Branches::Impl::DeviceRun::GiveCommands(std::vector<Rest>* rest) {
  given_.clear();
  std::erase_if(members_, [&](const Member& member) {
    if (TryAddCommands(member)) return false;
    if (member.row->seen.state == Branch::kAlive) rest->push_back({member.branch, left_});
    return true;
  });
  if (given_.empty()) return;
  PoolAccess::NoteDeviceSteps(of_.pool, &rows_);
  device_->Give(given_);
}

/// Gives the commands that are due after so many steps that the host has not looked at.
void Branches::Impl::DeviceRun::GiveCommandsAhead(uint64_t made) {
  given_.clear();
  for (const Member& member : members_) AddCommands(member, member.row->seen.steps + made);
  device_->Give(given_);
}

/// Returns false if the branch leaves the device, because a command that is due needs a World or is
/// refused.
bool Branches::Impl::DeviceRun::TryAddCommands(const Member& member) {
  const size_t first = given_.size();
  try {
    if (AddCommands(member, member.row->seen.steps)) return true;
    member.row->can_be_row = false;
  } catch (const CommandRefused& refused) {
    given_.resize(first);
    Refuse(member.row, &of_.copies[0], refused);
  }
  return false;
}

/// Adds the commands that are due at a step. Returns false if one of them needs a World. Throws
/// CommandRefused.
bool Branches::Impl::DeviceRun::AddCommands(const Member& member, uint64_t step) {
  const Branch& seen = member.row->seen;
  const size_t first = given_.size();
  for (size_t& next = member.row->applied;
       next < seen.commands.size() && seen.commands[next].step <= step; next++) {
    if (!models_.CanApply(seen.commands[next])) return false;
    if (const auto given = models_.Given(seen.commands[next], member.place))
      AddCommand(*given, first);
    if (device_->has_controls_on_host()) models_.Apply(seen.commands[next], &rows_, member.place);
  }
  return true;
}

/// Adds a command, which replaces an earlier one to the same robot.
void Branches::Impl::DeviceRun::AddCommand(const row_given_t& given, size_t first) {
  for (size_t i = first; i < given_.size(); i++)
    if (given_[i].mover == given.mover) {
      given_[i] = given;
      return;
    }
  given_.push_back(given);
}

/// Number of steps until a command is due, or the host looks at them.
uint64_t Branches::Impl::DeviceRun::StepsOfLaunch() const {
  if (Watches()) return StepsAhead();
  uint64_t steps = std::min(left_, kMostSteps);
  for (const Member& member : members_) {
    const Branch& seen = member.row->seen;
    if (member.row->applied < seen.commands.size())
      steps = std::min(steps, seen.commands[member.row->applied].step - seen.steps);
  }
  return steps;
}

/// False if a command that is not due yet needs a World or will be refused.
bool Branches::Impl::DeviceRun::CanApplyAhead(const Command& command) const {
  try {
    return models_.CanApply(command);
  } catch (const CommandRefused&) {
    return false;
  }
}

/// Number of steps until a command cannot be given ahead, or the host looks at them.
uint64_t Branches::Impl::DeviceRun::StepsAhead() const {
  if (!goes_ahead_) return 1;
  uint64_t steps = std::min<uint64_t>(left_, device_->moments());
  for (const Member& member : members_) {
    const Branch& seen = member.row->seen;
    for (size_t next = member.row->applied;
         next < seen.commands.size() && seen.commands[next].step - seen.steps < steps; next++)
      if (!CanApplyAhead(seen.commands[next])) steps = seen.commands[next].step - seen.steps;
  }
  return steps;
}

/// Makes steps. A scenario may end a branch after each step, and its state then has the readings
/// unless they are omitted; see StepRow().
void Branches::Impl::DeviceRun::Launch(uint64_t steps) {
  left_ -= steps;
  const uint64_t omitted = of_.options.keep == Snapshot::kLean ? 1 : 0;
  const uint64_t unseen = std::min<uint64_t>((scenario_ ? 0 : left_) + omitted, INT32_MAX);
  places_.clear();
  for (const Member& member : members_) places_.push_back(member.place);
  if (Watches()) {
    LaunchWatched(steps, static_cast<uint32_t>(unseen));
    Watch(steps);
  } else {
    StepMembers(steps, static_cast<uint32_t>(unseen));
    for (const Member& member : members_)
      if (member.row->seen.state == Branch::kAlive) member.row->seen.steps += steps;
    of_.steps_on_device += places_.size() * steps;
    of_.steps_in_rows += places_.size() * steps;
    device_->device().Finish();
  }
  RemoveEnded();
}

/// Makes steps, each of which is noted.
void Branches::Impl::DeviceRun::LaunchWatched(uint64_t steps, uint32_t unseen) {
  for (uint64_t step = 0; step < steps; step++) {
    if (step > 0) GiveCommandsAhead(step);
    StepMembers(1, unseen);
    device_->NoteWatched(places_, step);
  }
}

void Branches::Impl::DeviceRun::StepMembers(uint64_t steps, uint32_t unseen) {
  NoteFailures(PoolAccess::StepOnDevice(of_.pool, of_.IdOf(members_[0].branch), places_,
                                        static_cast<uint32_t>(steps), unseen));
}

/// Makes branches fail whose controllers have.
void Branches::Impl::DeviceRun::NoteFailures(const std::vector<ControlFailure>& failures) {
  for (const ControlFailure& failure : failures) {
    Branch& seen = members_[failure.index].row->seen;
    seen.steps += failure.step;
    seen.state = Branch::kFailed;
    seen.error = failure.why;
  }
}

/// Looks at the last steps of all members.
void Branches::Impl::DeviceRun::Watch(uint64_t steps) {
  const std::span<const double> numbers = device_->ReadWatched(steps);
  const size_t of_step = numbers.size() / steps, of_world = of_step / rows_.size();
  std::atomic<uint64_t> made{0};
  of_.pool.Run((members_.size() + kGrain - 1) / kGrain, [&](size_t part, unsigned) {
    const size_t end = std::min((part + 1) * kGrain, members_.size());
    uint64_t of_part = 0;
    for (size_t i = part * kGrain; i < end; i++)
      for (uint64_t step = 0; step < steps; step++) {
        if (step > 0 && members_[i].row->seen.state != Branch::kAlive) break;
        Watch(members_[i], numbers.data() + step * of_step + members_[i].place * of_world);
        of_part++;
      }
    made += of_part;
  });
  of_.steps_on_device += made;
  of_.steps_in_rows += made;
}

/// Looks at a step of a member.
void Branches::Impl::DeviceRun::Watch(const Member& member, const double* numbers) {
  Branch& seen = member.row->seen;
  if (seen.state != Branch::kAlive) return;
  seen.steps++;
  try {
    of_.BeginSightings(member.row);
    models_.Watch(numbers, &seen.sightings);
    if (scenario_ && scenario_->Watch(of_.LatestOf(*member.row), member.branch, &seen.score))
      seen.state = Branch::kEnded;
  } catch (...) {
    seen.state = Branch::kFailed;
    seen.error = DescribeException();
  }
}

void Branches::Impl::DeviceRun::RemoveEnded() {
  std::erase_if(members_, [&](const Member& member) {
    const Branch& seen = member.row->seen;
    if (seen.state == Branch::kFailed) Fail(member.row, &of_.copies[0], std::string(seen.error));
    return seen.state != Branch::kAlive;
  });
}

// ---- branches -----------------------------------------------------------------------------------

/// True if the device can step the row that the branch can become.
bool Branches::Impl::CanEnter(const Row& row) {
  return row.can_be_row && row.origin &&
         PoolAccess::WhyNotOnDevice(pool, row.origin->row.rows->shared_scene()).empty();
}

/// The branches that the device can step, all of which are in rows then; the others are added to
/// `rest`.
std::vector<uint32_t> Branches::Impl::ChooseForDevice(const std::vector<uint32_t>& alive,
                                                      uint64_t steps, std::vector<Rest>* rest) {
  if (std::ranges::any_of(alive, [&](uint32_t branch) { return !rows[branch].models; }))
    ForEach(alive, [&](uint32_t, Row* row, Copy*) {
      if (!row->models) ReadOrigin(row);
    });
  std::vector<uint32_t> chosen, entering;
  std::map<const Origin*, size_t> from;
  for (const uint32_t branch : alive) {
    const Row& row = rows[branch];
    if (row.seen.state != Branch::kAlive) continue;
    const bool enters = !row.models && CanEnter(row);
    if (enters) entering.push_back(branch);
    if (enters) from[row.origin.get()]++;
    if (enters || (row.models && row.at))
      chosen.push_back(branch);
    else
      rest->push_back({branch, steps});
  }
  if (entering.empty()) return chosen;
  ForEach(entering, [&](uint32_t branch, Row* row, Copy*) {
    EnterRow(row, branch, from.at(row->origin.get()) < kFewBranches);
  });
  std::erase_if(chosen, [&](uint32_t branch) { return rows[branch].seen.state != Branch::kAlive; });
  return chosen;
}

/// Makes the branch a row, the state of which is sent before its next step.
void Branches::Impl::EnterRow(Row* row, uint32_t branch, bool whole) {
  const SnapshotRow& from = row->origin->row;
  row->at = PoolAccess::Enter(pool, IdOf(branch), from);
  whole || PoolAccess::HasControlsOnHost(pool)
      ? row->at.rows->Copy(row->at.row, *from.rows, 0)
      : row->at.rows->CopyRandomNumbers(row->at.row, *from.rows, 0);
  if (row->reseed) RowBridge::Reseed(row->at.rows, row->at.row, row->seed);
  row->start = {true, whole, row->reseed, row->seen.steps, row->applied};
  row->reseed = false;
  row->models = ModelsOf(from.rows->scene());
  row->state = Snapshot();
  row->latest = nullptr;
}

/// Steps branches on the device. Returns the steps that the host must make.
std::vector<Branches::Impl::Rest> Branches::Impl::StepOnDevice(const std::vector<uint32_t>& alive,
                                                               uint64_t steps, Scenario* scenario) {
  std::vector<Rest> of_host;
  const std::vector<uint32_t> chosen = ChooseForDevice(alive, steps, &of_host);
  std::vector<std::pair<rows::Rows*, std::vector<uint32_t>>> groups;
  std::vector<uint64_t> ends;
  for (const uint32_t branch : chosen) {
    ends.push_back(rows[branch].seen.steps + steps);
    rows::Rows* const in = rows[branch].at.rows;
    auto group = std::ranges::find(groups, in, [](const auto& known) { return known.first; });
    if (group == groups.end()) group = groups.insert(group, {in, {}});
    group->second.push_back(branch);
  }
  std::vector<Rest> rest;
  try {
    for (const auto& [in, branches] : groups)
      DeviceRun(this, in, branches, steps, scenario).Run(&rest);
  } catch (const rows::RowDeviceError& error) {
    TakeOver(error.what());
    rest.clear();
    for (size_t i = 0; i < chosen.size(); i++)
      if (rows[chosen[i]].seen.state == Branch::kAlive && rows[chosen[i]].seen.steps < ends[i])
        rest.push_back({chosen[i], ends[i] - rows[chosen[i]].seen.steps});
  }
  rest.insert(rest.end(), of_host.begin(), of_host.end());
  return rest;
}

// ---- errors of the device -----------------------------------------------------------------------

/// Brings all branches to the state that the device has lost, and uses it no more.
void Branches::Impl::TakeOver(const std::string& why) {
  messages::Report(LogLevel::kWarning, "stage: branches go on without the device, because " + why);
  uses_device = false;
  PoolAccess::AbandonDevice(pool);
  std::vector<uint32_t> lost;
  for (uint32_t branch = 0; branch < rows.size(); branch++) {
    Row& row = rows[branch];
    if (!row.models || !row.at) continue;
    if (row.seen.state == Branch::kFailed)  // in the step in which the device was lost
      Fail(&row, &copies[0], std::string(row.seen.error));
    else
      lost.push_back(branch);
  }
  ForEach(lost, [&](uint32_t branch, Row* row, Copy*) { Repeat(row, branch); });
}

/// Starts a branch from its origin, and repeats its commands and steps on the host.
void Branches::Impl::Repeat(Row* row, uint32_t branch) {
  RestoreRow(*row, branch, row->start.reseeds);
  const PoolRow at = PoolAccess::RowToChange(pool, IdOf(branch));
  const uint64_t omitted = options.keep == Snapshot::kLean ? 1 : 0;
  size_t next = row->start.applied;
  const auto apply = [&](uint64_t step) {
    for (; next < row->applied && row->seen.commands[next].step <= step; next++)
      row->models->Apply(row->seen.commands[next], at.rows, at.row);
  };
  for (uint64_t step = row->start.step; step < row->seen.steps; step++) {
    apply(step);
    PoolAccess::StepRow(pool, IdOf(branch), row->seen.steps - 1 - step + omitted);
  }
  apply(row->seen.steps);
  row->applied = next;  // without commands that were given ahead
  row->at = {};
}

/// Brings the newest state of a branch to the host.
void Branches::Impl::FetchRow(uint32_t branch) {
  if (!uses_device || !rows[branch].models) return;
  try {
    PoolAccess::RowToRead(pool, IdOf(branch));
  } catch (const rows::RowDeviceError& error) {
    TakeOver(error.what());
  }
}

}  // namespace Stg
