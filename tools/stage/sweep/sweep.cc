// SPDX-License-Identifier: GPL-2.0-or-later
//
// The command `stage sweep`.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "messages/report.hh"
#include "stage/interrupt.hh"
#include "stage/option_values.hh"
#include "stage/process.hh"
#include "stage/status_line.hh"
#include "stage/sweep/commands.hh"
#include "stage/sweep/coordinator.hh"
#include "stage/sweep/folder.hh"
#include "stage/sweep/help.hh"
#include "stage/sweep/options.hh"

namespace Stg::program {

namespace {

using Action = SweepOptions::Action;
using Json = nlohmann::ordered_json;

constexpr uint64_t kMaxShown = 10;  // maximum length of a list for people

std::string Number(uint64_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

/// "4 combinations of robots (2) and world.resolution (2), 100 runs each"
std::string Describe(const Plan& plan) {
  std::string axes;
  for (const Axis& axis : plan.axes) {
    if (!axes.empty()) axes += &axis == &plan.axes.back() ? " and " : ", ";
    axes += axis.name + " (" + std::to_string(axis.values.size()) + ")";
  }
  const std::string runs = Number(plan.Count(), "run");
  if (axes.empty()) return runs;
  return runs + ": " + Number(plan.Count() / plan.RunsEach(), "combination") + " of " + axes +
         ", " + Number(plan.RunsEach(), "run") + " each";
}

int PrintPlan(const Plan& plan) {
  std::string text = Describe(plan) + "\n";
  for (uint64_t index = 0; index < std::min(plan.Count(), kMaxShown); index++)
    text += "  " + ReplayCommand(plan, RunAt(plan, index)) + "\n";
  if (plan.Count() > kMaxShown) text += "  ...\n";
  PrintWhole(text);
  return 0;
}

/// Returns "run 17 robots=10: SIGSEGV: last line" and the replay command.
std::string DescribeFailure(const Json& record) {
  const auto text_of = [](const Json& value) {
    return value.is_string() ? value.get<std::string>() : value.dump();
  };
  std::string text = "  run " + record.at("index").dump();
  for (const auto& [name, value] : record.at("set").items())
    text += " " + name + "=" + text_of(value);
  text += ": " + text_of(record.value("reason", Json("")));
  if (!record.at("lines").empty()) text += ": " + text_of(record.at("lines").back());
  return messages::PrintableLines(text) + "\n    " + text_of(record.value("replay", Json(""))) +
         "\n";
}

bool HasFailed(const Json& record) { return record.value("status", "") == "failed"; }

/// Failed records are short and say so near the start, but every file must be opened.
std::vector<size_t> FailedOf(const SweepFolder& folder, const Plan& plan,
                             const std::vector<bool>& finished) {
  std::vector<size_t> failed;
  for (size_t index = 0; index < finished.size(); index++)
    if (finished[index] && folder.ReadRecord(index).find("\"status\":\"failed\"") < 4096 &&
        HasFailed(folder.Record(plan, index)))
      failed.push_back(index);
  return failed;
}

int PrintStatus(const SweepFolder& folder) {
  const Plan plan = folder.Read();
  const std::vector<bool> finished = folder.Finished(plan);
  const auto done = static_cast<uint64_t>(std::ranges::count(finished, true));
  const std::vector<size_t> failed = FailedOf(folder, plan, finished);
  std::string text = folder.path() + ": " + Describe(plan) + "\n" + std::to_string(done) + " of " +
                     Number(plan.Count(), "run") + " finished, " + std::to_string(failed.size()) +
                     " of them failed\n";
  for (size_t i = 0; i < std::min<size_t>(failed.size(), kMaxShown); i++)
    text += DescribeFailure(folder.Record(plan, failed[i]));
  if (failed.size() > kMaxShown) text += "  ...\n";
  if (done < plan.Count())
    text += "next: stage sweep --resume " + folder.path() + "\n";
  else
    text += "next: stage merge " + folder.path() + " -o all.csv\n";
  PrintWhole(text);
  return 0;
}

bool IsMine(const SweepOptions& options, uint64_t index) {
  if (options.only && (index < options.only->first || index >= options.only->second)) return false;
  return !options.shard || index % options.shard->second == options.shard->first - 1;
}

std::vector<uint64_t> ToDo(const SweepFolder& folder, const Plan& plan,
                           const SweepOptions& options) {
  std::vector<bool> finished = folder.Finished(plan);
  if (options.retry_failed) {
    for (const size_t index : FailedOf(folder, plan, finished)) {
      if (!IsMine(options, index)) continue;
      std::filesystem::remove(folder.RecordFile(index));
      finished[index] = false;
    }
  }
  std::vector<uint64_t> todo;
  for (size_t index = 0; index < finished.size(); index++)
    if (!finished[index] && IsMine(options, index)) todo.push_back(index);
  return todo;
}

int PrintResult(const SweepFolder& folder, const Coordinator& coordinator, size_t todo,
                double seconds) {
  const uint64_t done = coordinator.done();
  std::string text =
      std::to_string(done) + " of " + Number(todo, "run") + " done in " + DurationText(seconds);
  if (coordinator.failed() > 0)
    text += ", " + std::to_string(coordinator.failed()) + " failed: stage sweep --status " +
            folder.path() + " names them";
  PrintWhole(text + "\n");
  if (done < todo) PrintWhole("continue with: stage sweep --resume " + folder.path() + "\n");
  FlushOutput();
  if (CaughtSignal() != 0) return RaiseDefault(CaughtSignal());
  return coordinator.failed() > 0 ? 1 : 0;
}

/// Name of the lock: different parts of a sweep may run at the same time, but no part twice.
std::string PartOf(const SweepOptions& options) {
  if (options.only)
    return std::to_string(options.only->first) + "-" + std::to_string(options.only->second);
  if (!options.shard) return "all";
  return std::to_string(options.shard->first) + "-of-" + std::to_string(options.shard->second);
}

/// A range of --only beyond the last run is a mistake. More shards than runs are valid, because a
/// job array need not know the number of runs.
void RejectEmptyPart(const Plan& plan, const SweepOptions& options) {
  if (options.only && options.only->first >= plan.Count())
    throw UsageError("--only: found " + std::to_string(options.only->first) + ":" +
                     std::to_string(options.only->second) + ", but the sweep has " +
                     Number(plan.Count(), "run") + ", expected numbers below " +
                     std::to_string(plan.Count()));
}

int PrintNothingToDo(const SweepFolder& folder, const Plan& plan, const SweepOptions& options) {
  const bool no_part = options.shard && options.shard->first > plan.Count();
  PrintWhole(no_part ? "nothing to do: the sweep has only " + Number(plan.Count(), "run") + "\n"
                     : "nothing to do: all runs " +
                           std::string(options.shard || options.only ? "of this part " : "") +
                           "are finished; stage sweep --status " + folder.path() +
                           " shows how they ended\n");
  return 0;
}

int Work(const SweepFolder& folder, const Plan& plan, const SweepOptions& options) {
  RejectEmptyPart(plan, options);
  const SweepLock lock(folder, PartOf(options));
  const double start = WallClock();
  std::vector<uint64_t> todo = ToDo(folder, plan, options);
  const size_t count = todo.size();
  if (todo.empty()) return PrintNothingToDo(folder, plan, options);
  Coordinator coordinator(folder, plan, options.execution, std::move(todo));
  coordinator.Run();
  return PrintResult(folder, coordinator, count, WallClock() - start);
}

/// Checks a new sweep before anything runs. If its worlds cannot be loaded, or a signal comes,
/// removes the plan and any folder created for it.
void CheckBeforeRunning(const SweepFolder& folder, const Plan& plan,
                        const ExecutionOptions& execution, bool was_made) {
  const auto clear = [&] {
    std::error_code ignored;
    for (const std::string& name : {folder.PlanFile(), folder.path() + "/runs"})
      std::filesystem::remove(name, ignored);
    if (was_made) std::filesystem::remove(folder.path(), ignored);
  };
  try {
    Coordinator(folder, plan, execution, {}).Check();
  } catch (...) {
    clear();
    throw;
  }
  if (CaughtSignal() != 0) clear();
}

int Begin(const SweepFolder& folder, const Plan& plan, const SweepOptions& options) {
  const bool was_made = folder.Make(), is_new = !folder.HasPlan();
  if (!is_new && !options.shard && options.action != Action::kPlanOnly)
    throw UsageError("found a sweep in '" + folder.path() +
                     "', expected a new folder; continue that one with: stage sweep --resume " +
                     folder.path());
  CatchSignals();
  folder.Write(plan);
  if (is_new) CheckBeforeRunning(folder, plan, options.execution, was_made);
  if (CaughtSignal() != 0) return RaiseDefault(CaughtSignal());
  return options.action == Action::kPlanOnly ? 0 : Work(folder, plan, options);
}

int Resume(const SweepFolder& folder, const SweepOptions& options) {
  const Plan plan = folder.Read();
  if (DigestOf(plan.world) != plan.digest)
    throw std::runtime_error(plan.world +
                             " has changed since the sweep began; start a new sweep to use it");
  CatchSignals();
  return Work(folder, plan, options);
}

}  // namespace

int Sweep(int argc, char* argv[]) {
  SweepOptions options = ParseSweepOptions(argc, argv);
  if (options.action == Action::kHelp) {
    PrintWhole(SweepHelpText());
    return 0;
  }
  const SweepFolder folder(options.folder);
  if (options.action == Action::kStatus) return PrintStatus(folder);
  if (options.action == Action::kResume) return Resume(folder, options);
  options.plan.digest = DigestOf(options.plan.world);
  if (options.action == Action::kDryRun) return PrintPlan(options.plan);
  return Begin(folder, options.plan, options);
}

}  // namespace Stg::program
