// SPDX-License-Identifier: GPL-2.0-or-later
//
// stage sweep

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

constexpr uint64_t kMostShown = 10;  // of a list that people read

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

int TellPlan(const Plan& plan) {
  std::string text = Describe(plan) + "\n";
  for (uint64_t index = 0; index < std::min(plan.Count(), kMostShown); index++)
    text += "  " + ReplayCommand(plan, RunAt(plan, index)) + "\n";
  if (plan.Count() > kMostShown) text += "  ...\n";
  PrintWhole(text);
  return 0;
}

/// "run 17 robots=10: SIGSEGV: last line", and the command.
std::string DescribeFailure(const Json& record) {
  std::string text = "  run " + record.at("index").dump();
  for (const auto& [name, value] : record.at("set").items())
    text += " " + name + "=" + value.get<std::string>();
  text += ": " + record.value("reason", "");
  if (!record.at("lines").empty()) text += ": " + record.at("lines").back().get<std::string>();
  return text + "\n    " + record.value("replay", "") + "\n";
}

bool HasFailed(const Json& record) { return record.value("status", "") == "failed"; }

Json RecordAt(const SweepFolder& folder, uint64_t index) {
  try {
    return Json::parse(folder.ReadRecord(index));
  } catch (const Json::exception& error) {
    throw std::runtime_error(folder.RecordFile(index) + ": not a record of a run");
  }
}

/// Failed records are short and say so near their beginning, but each file has to be opened.
std::vector<size_t> FailedOf(const SweepFolder& folder, const std::vector<bool>& finished) {
  std::vector<size_t> failed;
  for (size_t index = 0; index < finished.size(); index++)
    if (finished[index] && folder.ReadRecord(index).find("\"status\":\"failed\"") < 4096 &&
        HasFailed(RecordAt(folder, index)))
      failed.push_back(index);
  return failed;
}

int TellStatus(const SweepFolder& folder) {
  const Plan plan = folder.Read();
  const std::vector<bool> finished = folder.Finished(plan);
  const auto done = static_cast<uint64_t>(std::ranges::count(finished, true));
  const std::vector<size_t> failed = FailedOf(folder, finished);
  std::string text = folder.path() + ": " + Describe(plan) + "\n" + std::to_string(done) + " of " +
                     Number(plan.Count(), "run") + " finished, " + std::to_string(failed.size()) +
                     " of them failed\n";
  for (size_t i = 0; i < std::min<size_t>(failed.size(), kMostShown); i++)
    text += DescribeFailure(RecordAt(folder, failed[i]));
  if (failed.size() > kMostShown) text += "  ...\n";
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
    for (const size_t index : FailedOf(folder, finished)) {
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

int TellResult(const SweepFolder& folder, const Coordinator& coordinator, size_t todo,
               double seconds) {
  const uint64_t done = coordinator.done();
  std::string text =
      std::to_string(done) + " of " + Number(todo, "run") + " done in " + DurationText(seconds);
  if (coordinator.failed() > 0)
    text += ", " + std::to_string(coordinator.failed()) + " failed: stage sweep --status " +
            folder.path() + " names them";
  PrintWhole(text + "\n");
  if (done < todo) PrintWhole("to go on: stage sweep --resume " + folder.path() + "\n");
  FlushOutput();
  if (CaughtSignal() != 0) return DieOf(CaughtSignal());
  return coordinator.failed() > 0 ? 1 : 0;
}

/// Two parts of a sweep may be worked on at the same time; nobody works twice on the same.
std::string PartOf(const SweepOptions& options) {
  if (options.only)
    return std::to_string(options.only->first) + "-" + std::to_string(options.only->second);
  if (!options.shard) return "all";
  return std::to_string(options.shard->first) + "-of-" + std::to_string(options.shard->second);
}

int Work(const SweepFolder& folder, const Plan& plan, const SweepOptions& options) {
  const SweepLock lock(folder, PartOf(options));
  const double start = Now();
  std::vector<uint64_t> todo = ToDo(folder, plan, options);
  const size_t count = todo.size();
  Coordinator coordinator(folder, plan, options.effort, std::move(todo));
  CatchSignals();
  coordinator.Run();
  return TellResult(folder, coordinator, count, Now() - start);
}

/// A new sweep whose worlds can't be loaded leaves no folder.
int Begin(const SweepFolder& folder, const Plan& plan, const SweepOptions& options) {
  const bool is_new = !folder.HasPlan();
  if (!is_new && !options.shard && options.action != Action::kPlanOnly)
    throw UsageError("found a sweep in '" + folder.path() +
                     "', expected a new folder; to go on with that one: stage sweep --resume " +
                     folder.path());
  folder.Write(plan);
  if (is_new) try {
      Coordinator(folder, plan, options.effort, {}).Check();
    } catch (...) {
      std::filesystem::remove(folder.PlanFile());
      std::filesystem::remove(folder.path() + "/runs");
      std::filesystem::remove(folder.path());
      throw;
    }
  return options.action == Action::kPlanOnly ? 0 : Work(folder, plan, options);
}

int Resume(const SweepFolder& folder, const SweepOptions& options) {
  const Plan plan = folder.Read();
  if (DigestOf(plan.world) != plan.digest)
    throw std::runtime_error(plan.world +
                             " has changed since the sweep began, expected it as it was; for the "
                             "new one begin a new sweep");
  return Work(folder, plan, options);
}

}  // namespace

int Sweep(int argc, char* argv[]) {
  SweepOptions options = ParseSweepOptions(argc, argv);
  if (options.action == Action::kHelp) {
    PrintWhole(kSweepHelpText);
    return 0;
  }
  const SweepFolder folder(options.folder);
  if (options.action == Action::kStatus) return TellStatus(folder);
  if (options.action == Action::kResume) return Resume(folder, options);
  options.plan.digest = DigestOf(options.plan.world);
  if (options.action == Action::kDryRun) return TellPlan(options.plan);
  return Begin(folder, options.plan, options);
}

}  // namespace Stg::program
