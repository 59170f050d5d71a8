// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/coordinator.hh"

#include <poll.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>
#include <stdexcept>
#include <utility>

#include "messages/report.hh"
#include "stage/interrupt.hh"
#include "stage/sweep/worker.hh"

namespace Stg::program {

namespace {

constexpr double kCheckInterval = 0.05;  // seconds between checks of limits and progress
constexpr double kSync = 5;              // seconds of work that a system crash may lose
constexpr double kGroupCheckInterval =
    0.5;  // seconds between checks of the memory of child processes
constexpr double kDefaultLoadLimit = 600;   // default limit for loading a world in Check(), seconds
constexpr double kDefaultRunLimit = 86400;  // default limit for a run, seconds
constexpr size_t kMaxChecked = 8;           // maximum number of values per axis

std::string Describe(const RunSpec& spec) {
  std::string text = "run " + std::to_string(spec.index);
  for (const std::string& setting : SettingsOf(spec)) text += " " + setting;
  return text;
}

std::string LastOf(const WorkerExit& worker_exit) {
  return worker_exit.lines.empty() ? "" : ": " + worker_exit.lines.back();
}

std::string Unexpected(const std::string& answer, const std::string& expected) {
  return "replied '" + messages::Shortened(answer) + "', expected '" + expected + "'";
}

/// One run for each value of each axis, with the other axes at their first value.
std::set<uint64_t> RunsToCheck(const Plan& plan) {
  std::set<uint64_t> runs = {0};
  uint64_t stride = plan.Count();
  for (const Axis& axis : plan.axes) {
    stride /= axis.values.size();
    for (size_t i = 1; i < std::min(axis.values.size(), kMaxChecked); i++) runs.insert(i * stride);
  }
  return runs;
}

/// The command of a worker; empty selects this program.
std::vector<std::string> WordsOf(const std::string& command) {
  // `exec` replaces the shell, so that killing the process kills the worker.
  if (!command.empty()) return {"/bin/sh", "-c", "exec " + command + " \"$1\"", "sh"};
  std::error_code failed;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
  return {failed ? "stage" : program.string(), kWorkerCommand};
}

}  // namespace

Coordinator::Coordinator(const SweepFolder& folder, const Plan& plan,
                         const ExecutionOptions& execution, std::vector<uint64_t> todo)
    : folder_(folder),
      plan_(plan),
      execution_(execution),
      foreign_worker_(execution.worker.empty() ? plan.worker : execution.worker),
      todo_(std::move(todo)) {}

std::unique_ptr<WorkerProcess> Coordinator::StartWorker() const {
  return std::make_unique<WorkerProcess>(WordsOf(foreign_worker_), folder_.path());
}

void Coordinator::Check() {
  std::unique_ptr<WorkerProcess> worker;
  const std::set<uint64_t> runs = RunsToCheck(plan_);
  size_t count = 0;
  for (const uint64_t index : runs) {
    if (execution_.progress)
      line_.Print(" loading world " + std::to_string(++count) + " of " +
                  std::to_string(runs.size()));
    CheckOne(&worker, index);
    if (CaughtSignal() != 0) break;
  }
  line_.Erase();
}

/// Loads the world of a run. If the worker dies, retries in a new process up to --tries times,
/// because something else may have killed it.
void Coordinator::CheckOne(std::unique_ptr<WorkerProcess>* worker, uint64_t index) {
  std::optional<WorkerExit> worker_exit;
  for (int i = 0; i < execution_.tries && CaughtSignal() == 0; i++) {
    if (!*worker) *worker = StartWorker();
    worker_exit = TryToLoad(worker->get(), index);
    if (!worker_exit) return;
    worker->reset();
    if (!worker_exit->reason.empty()) break;  // Stage killed it, and would do so again
  }
  if (CaughtSignal() != 0 || !worker_exit) return;
  line_.Erase();
  throw std::runtime_error(Describe(RunAt(plan_, index)) + ": loading its world ended with '" +
                           Describe(*worker_exit) + "'" + LastOf(*worker_exit));
}

/// Returns how the worker died, or nothing if the world was loaded or a signal came. Throws
/// std::runtime_error if the worker reports that the world cannot be loaded.
std::optional<WorkerExit> Coordinator::TryToLoad(WorkerProcess* worker, uint64_t index) {
  const double since = WallClock(),
               limit = execution_.limit_seconds > 0 ? execution_.limit_seconds : kDefaultLoadLimit;
  worker->ForgetOutput();
  worker->Order("check " + std::to_string(index));
  while (CaughtSignal() == 0) {
    pollfd files[] = {{worker->answers_file(), POLLIN, 0}, {worker->output_file(), POLLIN, 0}};
    poll(files, 2, static_cast<int>(kCheckInterval * 1e3));
    worker->ReadOutput();
    if (const std::optional<std::string> answer = worker->Answer()) {
      if (*answer == "ok") return std::nullopt;
      if (!answer->starts_with("error "))
        worker->Kill(Unexpected(*answer, "ok"));
      else
        throw std::runtime_error(Describe(RunAt(plan_, index)) + ": " + answer->substr(6));
    }
    if (worker->HasEnded()) return worker->CollectExit();
    const std::string broken = BrokenLimit(*worker, since, limit);
    if (!broken.empty()) worker->Kill(broken);
    EnforceLimitsOfGroups({worker});
  }
  return std::nullopt;
}

void Coordinator::Run() {
  slots_.resize(std::min<size_t>(execution_.jobs, todo_.size()));
  begun_ = next_sync_ = WallClock();
  if (!foreign_worker_.empty() && !todo_.empty()) TryForeignWorker();
  while (done_ < todo_.size() && CaughtSignal() == 0) {
    for (Slot& slot : slots_)
      if (slot.index == kNone && HasWork()) AssignRun(&slot);
    Wait();
    for (Slot& slot : slots_)
      if (slot.process) ReadAnswers(&slot);
    CheckLimits();
  }
  slots_.clear();
  folder_.Sync();
  line_.Erase();
}

/// Reports a foreign command that is missing or no worker once, instead of failing every run.
void Coordinator::TryForeignWorker() { CheckOne(&slots_[0].process, todo_[0]); }

void Coordinator::AssignRun(Slot* slot) {
  if (!slot->process) slot->process = StartWorker();
  if (!retries_.empty()) {
    slot->index = retries_.front();
    retries_.pop_front();
  } else {
    slot->index = todo_[next_++];
  }
  slot->since = WallClock();
  slot->process->ForgetOutput();
  const auto attempts = attempts_.find(slot->index);
  const int attempt = attempts == attempts_.end() ? 1 : attempts->second + 1;
  slot->process->Order("run " + std::to_string(slot->index) + " " + std::to_string(attempt));
}

/// Waits for output of a worker, or until limits are due for a check.
void Coordinator::Wait() {
  std::vector<pollfd> files;
  for (const Slot& slot : slots_) {
    if (!slot.process) continue;
    files.push_back({slot.process->answers_file(), POLLIN, 0});
    files.push_back({slot.process->output_file(), POLLIN, 0});
  }
  poll(files.data(), files.size(), static_cast<int>(kCheckInterval * 1e3));
}

void Coordinator::ReadAnswers(Slot* slot) {
  slot->process->ReadOutput();
  const std::optional<std::string> answer = slot->process->Answer();
  if (answer)
    FinishRun(slot, *answer);
  else if (slot->process->HasEnded())
    HandleDeath(slot);
}

void Coordinator::FinishRun(Slot* slot, const std::string& answer) {
  const uint64_t index = slot->index;
  const std::string done = "done " + std::to_string(index);
  WorkerExit worker_exit;
  if (index != kNone && answer.starts_with("error ")) {
    worker_exit.reason = "its world can't be loaded";
    worker_exit.lines = {answer.substr(6)};
  } else if (index == kNone || answer != done) {
    // Other code may write to that descriptor, such as a controller that writes to all of them.
    slot->process->Kill(Unexpected(answer, index == kNone ? "nothing" : done));
    return;
  } else if (!folder_.HasRecord(index)) {
    slot->process->Kill("replied '" + done + "', but left no record");
    return;
  }
  slot->index = kNone;
  if (worker_exit.reason.empty())
    done_++;
  else
    Fail(index, worker_exit);
  if (execution_.fresh) slot->process.reset();
}

/// Handles the death of a slot's worker.
void Coordinator::HandleDeath(Slot* slot) {
  const uint64_t index = std::exchange(slot->index, kNone);
  const std::unique_ptr<WorkerProcess> process = std::move(slot->process);
  const WorkerExit worker_exit = process->CollectExit();
  if (index == kNone) return;  // it was idle
  // Stage killed it because of a limit or a wrong reply. Runs are repeatable, so a retry would end
  // in the same way.
  const bool was_killed = !worker_exit.reason.empty();
  if (!was_killed && folder_.HasRecord(index)) {
    done_++;  // it died after writing its record
    return;
  }
  if (++attempts_[index] >= execution_.tries || was_killed)
    Fail(index, worker_exit);
  else
    retries_.push_back(index);
}

void Coordinator::Fail(uint64_t index, const WorkerExit& worker_exit) {
  const RunSpec spec = RunAt(plan_, index);
  const auto attempts = attempts_.find(index);
  folder_.WriteRecord(index, FailureRecordOf(plan_, spec, worker_exit,
                                             attempts == attempts_.end() ? 1 : attempts->second));
  line_.Erase();
  messages::Report(LogLevel::kWarning, "stage: " + Describe(spec) + " has failed: " +
                                           Describe(worker_exit) + LastOf(worker_exit));
  done_++;
  failed_++;
}

/// Returns the reason to kill a worker that has worked since then, or an empty string.
std::string Coordinator::BrokenLimit(const WorkerProcess& worker, double since,
                                     double seconds) const {
  char reason[80] = "";
  if (WallClock() - since > seconds)
    std::snprintf(reason, sizeof reason, "took more than %g s", seconds);
  else if (execution_.limit_mb > 0 && worker.MemoryMb() > execution_.limit_mb)
    std::snprintf(reason, sizeof reason, "took more than %g MB of memory", execution_.limit_mb);
  return reason;
}

void Coordinator::EnforceLimits(Slot* slot) {
  if (slot->index == kNone || !slot->process) return;
  const double seconds = execution_.limit_seconds > 0 ? execution_.limit_seconds : kDefaultRunLimit;
  const std::string reason = BrokenLimit(*slot->process, slot->since, seconds);
  if (!reason.empty()) slot->process->Kill(reason);
}

/// Processes started by controllers count as well, but are checked less often.
void Coordinator::EnforceLimitsOfGroups(const std::vector<WorkerProcess*>& workers) {
  if (execution_.limit_mb == 0 || WallClock() < next_group_check_) return;
  std::set<pid_t> groups;
  for (const WorkerProcess* worker : workers) groups.insert(worker->group());
  const std::map<pid_t, double> memory = MemoryOfGroups(groups);
  char reason[120];
  std::snprintf(reason, sizeof reason,
                "took more than %g MB of memory, with the processes that it has started",
                execution_.limit_mb);
  for (WorkerProcess* worker : workers) {
    const auto found = memory.find(worker->group());
    if (found != memory.end() && found->second > execution_.limit_mb) worker->Kill(reason);
  }
  next_group_check_ = WallClock() + kGroupCheckInterval;
}

void Coordinator::CheckLimits() {
  const double now = WallClock();
  if (now < next_housekeeping_) return;
  next_housekeeping_ = now + kCheckInterval;
  std::vector<WorkerProcess*> workers;
  for (Slot& slot : slots_) {
    EnforceLimits(&slot);
    if (slot.process) workers.push_back(slot.process.get());
  }
  EnforceLimitsOfGroups(workers);
  if (now >= next_sync_) {
    folder_.Sync();
    next_sync_ = WallClock() + kSync;
  }
  if (execution_.progress) line_.Print(ProgressText(now));
}

std::string Coordinator::ProgressText(double now) const {
  const double elapsed = now - begun_, done = static_cast<double>(done_);
  char text[160];
  int length = std::snprintf(text, sizeof text, " %llu of %zu runs",
                             static_cast<unsigned long long>(done_), todo_.size());
  const auto add = [&](const char* format, auto... values) {
    length +=
        std::snprintf(text + length, sizeof text - static_cast<size_t>(length), format, values...);
  };
  if (failed_ > 0) add(", %llu failed", static_cast<unsigned long long>(failed_));
  if (done_ == 0 || elapsed <= 0) return text;
  add(", %.3g runs/s, ", done / elapsed);
  return text + DurationText((static_cast<double>(todo_.size()) - done) * elapsed / done) + " left";
}

}  // namespace Stg::program
