// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/options.hh"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <tuple>
#include <vector>

#include "stage/command_line.hh"
#include "stage/option_values.hh"
#include "stage/parse_number.hh"
#include "threads/processors.hh"
#include "worldfile/find_file.hh"

namespace Stg::program {

namespace {

using Action = SweepOptions::Action;
using Range = std::pair<uint64_t, uint64_t>;

using Text = const std::string&;

/// Parses two numbers with the separator between them.
std::optional<Range> ParsePair(const std::string& text, char separator) {
  const size_t at = std::min(text.find(separator), text.size());
  const auto first = ParseNumber<uint64_t>(text.substr(0, at));
  const auto second = ParseNumber<uint64_t>(text.substr(std::min(at + 1, text.size())));
  if (!first || !second) return std::nullopt;
  return Range{*first, *second};
}

Range ParseRange(Text name, Text text) {
  const std::optional<Range> range = ParsePair(text, ':');
  if (!range || range->first >= range->second || range->second > kMaxRuns)
    RefuseValue(name, "FIRST:END, as in 0:100, which is 0 to 99", text);
  return *range;
}

Range ParseShard(Text name, Text text) {
  const std::optional<Range> shard = ParsePair(text, '/');
  if (!shard || shard->first < 1 || shard->first > shard->second)
    RefuseValue(name, "K/N, from 1/N to N/N", text);
  return *shard;
}

/// Jobs have the limits of threads.
unsigned ParseJobs(Text name, Text text) {
  const RunOption& limits = FindRunOption("threads");
  RunOptions options;
  if (!limits.Parse(text, &options)) RefuseValue(name, limits.Expected(), text);
  return static_cast<unsigned>(options.threads);
}

class Parser {
 public:
  Parser() {
    options_.execution.progress = isatty(STDERR_FILENO) != 0;
    options_.plan.run.threads = 1;  // the cores are for workers
  }

  SweepOptions Parse(int argc, char* argv[]) {
    std::vector<char*> arguments(argv, argv + argc);
    arguments.erase(arguments.begin() + 1);
    const std::vector<CommandOption> plan_options = PlanOptions();
    std::vector<CommandOption> all = ExecutionOptions();
    all.insert(all.end(), plan_options.begin(), plan_options.end());
    const auto done = [this] { return options_.action == Action::kHelp; };
    const CommandLine line = ParseCommandLine(arguments, all, done);
    if (done()) return options_;
    if (options_.action == Action::kResume || options_.action == Action::kStatus)
      TakeFolder(line, plan_options);
    else
      TakeWorld(line.operands);
    if (options_.execution.jobs == 0) options_.execution.jobs = UsualJobs();
    return options_;
  }

 private:
  /// Options that define a sweep. They are refused for a folder that already has a plan.
  std::vector<CommandOption> PlanOptions() {
    Plan& plan = options_.plan;
    const auto log = [&plan] { return &(plan.log ? *plan.log : plan.log.emplace()); };
    std::vector<CommandOption> options = {
        {"args", required_argument, Store(&plan.controller_args), 'a'},
        {"common-seeds", no_argument, Set(&plan.common_seeds, true)},
        {"dry-run", no_argument, Choose(Action::kDryRun)},
        {"log", no_argument, [log](Text, Text) { log(); }},
        {"out", required_argument, StoreNonEmpty(&options_.folder, "the name of a folder"), 'o'},
        {"plan-only", no_argument, Choose(Action::kPlanOnly)},
        {"runs", required_argument,
         [&plan](Text name, Text value) {
           std::tie(plan.first, plan.last) = ParseRange(name, value);
         }},
    };
    for (const std::vector<CommandOption>& some :
         {LogCommandOptions(log), RunCommandOptions(&plan.run)})
      options.insert(options.end(), some.begin(), some.end());
    // A sweep's settings have several values each.
    std::ranges::find(options, std::string_view("set"), &CommandOption::name)->action =
        [&plan](Text, Text value) { plan.axes.push_back(ParseAxis(value)); };
    return options;
  }

  std::vector<CommandOption> ExecutionOptions() {
    program::ExecutionOptions& execution = options_.execution;
    return {
        {"fresh", no_argument, Set(&execution.fresh, true)},
        {"help", no_argument, Set(&options_.action, Action::kHelp), 'h'},
        {"jobs", required_argument,
         [&execution](Text name, Text value) { execution.jobs = ParseJobs(name, value); }},
        {"limit-mb", required_argument,
         [&execution](Text name, Text value) {
           execution.limit_mb = ParseWithin(name, 1, 1e9, "MB of memory, from 1 to 1e9", value);
         }},
        {"limit-seconds", required_argument,
         [&execution](Text name, Text value) {
           execution.limit_seconds =
               ParseWithin(name, 0.001, 1e9, "seconds, from 0.001 to 1e9", value);
         }},
        {"no-progress", no_argument, Set(&execution.progress, false)},
        {"only", required_argument,
         [this](Text name, Text value) { options_.only = ParseRange(name, value); }},
        {"progress", no_argument, Set(&execution.progress, true)},
        {"resume", no_argument, Choose(Action::kResume)},
        {"retry-failed", no_argument, Set(&options_.retry_failed, true)},
        {"shard", required_argument,
         [this](Text name, Text value) { options_.shard = ParseShard(name, value); }},
        {"status", no_argument, Choose(Action::kStatus)},
        {"tries", required_argument,
         [&execution](Text name, Text value) {
           execution.tries =
               static_cast<int>(ParseWithin(name, 1, 100, "a number from 1 to 100", value));
         }},
        {"worker", required_argument, StoreNonEmpty(&execution.worker, "a command")},
    };
  }

  CommandOption::Action Choose(Action action) {
    return [this, action](Text, Text) {
      if (options_.action != Action::kRun && options_.action != action)
        throw UsageError("expected one of --resume, --status, --dry-run and --plan-only");
      options_.action = action;
    };
  }

  void TakeFolder(const CommandLine& line, const std::vector<CommandOption>& plan_options) {
    const std::vector<std::string>& words = line.operands;
    const char* const name = options_.action == Action::kResume ? "--resume" : "--status";
    if (words.size() != 1)
      throw UsageError(std::string(name) + ": found " + std::to_string(words.size()) +
                       " folders, expected one: that of the sweep");
    for (const std::string& given : line.given)
      if (std::ranges::count(plan_options, given.substr(2), &CommandOption::name) > 0)
        throw UsageError(given + " does not go with " + name + ": the plan is already fixed");
    options_.folder = words[0];
  }

  void TakeWorld(const std::vector<std::string>& words) {
    if (words.size() != 1)
      throw UsageError("sweep: found " + std::to_string(words.size()) +
                       " world files, expected one");
    if (options_.folder.empty() && options_.action != Action::kDryRun)
      throw UsageError("sweep: expected -o FOLDER for the results");
    options_.plan.worker = options_.execution.worker;
    const std::string found =
        worldfile::FindFile("", words[0]);  // also finds worlds that come with Stage
    options_.plan.world =
        std::filesystem::absolute(found.empty() ? words[0] : found).lexically_normal().string();
    std::set<std::string> names;
    for (const Axis& axis : options_.plan.axes)
      if (!names.insert(axis.name).second)
        throw UsageError("--set: found " + axis.name + " twice, expected all its values in one");
    if (options_.plan.Count() > kMaxRuns)
      throw UsageError("sweep: found more than " + std::to_string(kMaxRuns) +
                       " runs, expected fewer");
  }

  unsigned UsualJobs() const {
    return std::max(
        1u, threads::CountUsableProcessors() / static_cast<unsigned>(options_.plan.run.threads));
  }

  SweepOptions options_;
};

}  // namespace

SweepOptions ParseSweepOptions(int argc, char* argv[]) { return Parser().Parse(argc, argv); }

}  // namespace Stg::program
