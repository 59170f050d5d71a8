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

constexpr double kHousekeeping = 0.05;  // seconds between two looks at limits and progress
constexpr double kSync = 5;             // a crash of the system loses so many seconds
constexpr size_t kMostChecked = 8;      // values of an axis

std::string Describe(const RunSpec& spec) {
  std::string text = "run " + std::to_string(spec.index);
  for (const std::string& setting : SettingsOf(spec)) text += " " + setting;
  return text;
}

std::string LastOf(const Death& death) {
  return death.lines.empty() ? "" : ": " + death.lines.back();
}

/// One run for each value of each axis, the other axes at their first value.
std::set<uint64_t> RunsToCheck(const Plan& plan) {
  std::set<uint64_t> runs = {0};
  uint64_t stride = plan.Count();
  for (const Axis& axis : plan.axes) {
    stride /= axis.values.size();
    for (size_t i = 1; i < std::min(axis.values.size(), kMostChecked); i++) runs.insert(i * stride);
  }
  return runs;
}

/// The command of a worker; empty: this program's own.
std::vector<std::string> WordsOf(const std::string& command) {
  // The shell is replaced, so that what is killed is the worker.
  if (!command.empty()) return {"/bin/sh", "-c", "exec " + command + " \"$1\"", "sh"};
  std::error_code failed;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
  return {failed ? "stage" : program.string(), kWorkerCommand};
}

}  // namespace

Coordinator::Coordinator(const SweepFolder& folder, const Plan& plan, const Effort& effort,
                         std::vector<uint64_t> todo)
    : folder_(folder),
      plan_(plan),
      effort_(effort),
      foreign_worker_(effort.worker.empty() ? plan.worker : effort.worker),
      todo_(std::move(todo)) {}

std::unique_ptr<WorkerProcess> Coordinator::Hire() const {
  return std::make_unique<WorkerProcess>(WordsOf(foreign_worker_), folder_.path());
}

void Coordinator::Check() {
  const std::unique_ptr<WorkerProcess> worker = Hire();
  for (const uint64_t index : RunsToCheck(plan_)) {
    CheckOne(worker.get(), index);
    if (CaughtSignal() != 0) return;
  }
}

void Coordinator::CheckOne(WorkerProcess* worker, uint64_t index) {
  worker->ForgetOutput();
  worker->Order("check " + std::to_string(index));
  while (CaughtSignal() == 0) {
    pollfd files[] = {{worker->answers_file(), POLLIN, 0}, {worker->output_file(), POLLIN, 0}};
    const bool quiet = poll(files, 2, 250) <= 0;
    worker->ReadOutput();
    if (const std::optional<std::string> answer = worker->Answer()) {
      if (answer->starts_with("error "))
        throw std::runtime_error(Describe(RunAt(plan_, index)) + ": " + answer->substr(6));
      return;
    }
    if (!quiet || worker->HasEnded()) {
      if (!worker->HasEnded()) continue;
      const Death death = worker->Bury();
      throw std::runtime_error(Describe(RunAt(plan_, index)) + ": loading its world ended with " +
                               Describe(death) + LastOf(death));
    }
  }
}

void Coordinator::Run() {
  slots_.resize(std::min<size_t>(effort_.jobs, todo_.size()));
  begun_ = next_sync_ = Now();
  if (!foreign_worker_.empty() && !todo_.empty()) TryForeignWorker();
  while (done_ < todo_.size() && CaughtSignal() == 0) {
    for (Slot& slot : slots_)
      if (slot.index == kNone && HasWork()) Employ(&slot);
    Wait();
    for (Slot& slot : slots_)
      if (slot.process) Listen(&slot);
    Housekeep();
  }
  slots_.clear();
  folder_.Sync();
  line_.Erase();
}

/// A command that is no worker, or not on this machine, is an error, not a failure of every run.
void Coordinator::TryForeignWorker() {
  slots_[0].process = Hire();
  CheckOne(slots_[0].process.get(), todo_[0]);
}

void Coordinator::Employ(Slot* slot) {
  if (!slot->process) slot->process = Hire();
  if (!again_.empty()) {
    slot->index = again_.front();
    again_.pop_front();
  } else {
    slot->index = todo_[next_++];
  }
  slot->since = Now();
  slot->process->ForgetOutput();
  const auto attempts = attempts_.find(slot->index);
  const int attempt = attempts == attempts_.end() ? 1 : attempts->second + 1;
  slot->process->Order("run " + std::to_string(slot->index) + " " + std::to_string(attempt));
}

/// Until a worker says something.
void Coordinator::Wait() {
  std::vector<pollfd> files;
  for (const Slot& slot : slots_) {
    if (!slot.process) continue;
    files.push_back({slot.process->answers_file(), POLLIN, 0});
    files.push_back({slot.process->output_file(), POLLIN, 0});
  }
  poll(files.data(), files.size(), static_cast<int>(kHousekeeping * 1e3));
}

void Coordinator::Listen(Slot* slot) {
  slot->process->ReadOutput();
  const std::optional<std::string> answer = slot->process->Answer();
  if (answer)
    Settle(slot, *answer);
  else if (slot->process->HasEnded())
    Mourn(slot);
}

void Coordinator::Settle(Slot* slot, const std::string& answer) {
  const uint64_t index = std::exchange(slot->index, kNone);
  if (answer.starts_with("error ")) {
    Death death;
    death.reason = "its world can't be loaded";
    death.lines = {answer.substr(6)};
    Fail(index, death);
  } else if (answer != "done " + std::to_string(index)) {
    throw std::runtime_error("a worker has answered '" + messages::Shortened(answer) +
                             "', expected 'done " + std::to_string(index) + "'");
  } else {
    done_++;
  }
  if (effort_.fresh) slot->process.reset();
}

/// The worker is dead.
void Coordinator::Mourn(Slot* slot) {
  const uint64_t index = std::exchange(slot->index, kNone);
  const std::unique_ptr<WorkerProcess> process = std::move(slot->process);
  const Death death = process->Bury();
  if (index == kNone) return;  // it had nothing to do
  std::error_code missing;
  if (std::filesystem::file_size(folder_.RecordFile(index), missing) > 0 && !missing) {
    done_++;  // it died after its work
    return;
  }
  const bool limited = !death.reason.empty();  // as it would be again
  if (++attempts_[index] >= effort_.tries || limited)
    Fail(index, death);
  else
    again_.push_back(index);
}

void Coordinator::Fail(uint64_t index, const Death& death) {
  const RunSpec spec = RunAt(plan_, index);
  const auto attempts = attempts_.find(index);
  folder_.WriteRecord(index, FailureRecordOf(plan_, spec, death,
                                             attempts == attempts_.end() ? 1 : attempts->second));
  line_.Erase();
  messages::Report(LogLevel::kWarning,
                   "stage: " + Describe(spec) + " has failed: " + Describe(death) + LastOf(death));
  done_++;
  failed_++;
}

void Coordinator::EnforceLimits(Slot* slot) {
  if (slot->index == kNone || !slot->process) return;
  char reason[80] = "";
  if (effort_.limit_seconds > 0 && Now() - slot->since > effort_.limit_seconds)
    std::snprintf(reason, sizeof reason, "took more than %g s", effort_.limit_seconds);
  else if (effort_.limit_mb > 0 && slot->process->MemoryMb() > effort_.limit_mb)
    std::snprintf(reason, sizeof reason, "took more than %g MB of memory", effort_.limit_mb);
  if (*reason) slot->process->Kill(reason);
}

void Coordinator::Housekeep() {
  const double now = Now();
  if (now < next_housekeeping_) return;
  next_housekeeping_ = now + kHousekeeping;
  for (Slot& slot : slots_) EnforceLimits(&slot);
  if (now >= next_sync_) {
    folder_.Sync();
    next_sync_ = Now() + kSync;
  }
  if (effort_.progress) line_.Print(ProgressText(now));
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
