// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/options.hh"

#include <getopt.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string_view>
#include <vector>

#include "stage/option_values.hh"
#include "stage/parse_number.hh"
#include "threads/processors.hh"
#include "worldfile/find_file.hh"

namespace Stg::program {

namespace {

using Action = SweepOptions::Action;
using Range = std::pair<uint64_t, uint64_t>;

enum Id : int {
  kArgs = 'a',
  kHelp = 'h',
  kOut = 'o',
  kQuestion = '?',
  kCommonSeeds = kFirstLongOption,
  kDryRun,
  kDuration,
  kFresh,
  kJobs,
  kLimitMb,
  kLimitSeconds,
  kLog,
  kLogCompression,
  kLogEvery,
  kLogModels,
  kLogRanges,
  kNoControllers,
  kNoProgress,
  kOnly,
  kOpencl,
  kPlanOnly,
  kProgress,
  kRayModel,
  kResume,
  kRetryFailed,
  kRuns,
  kSeed,
  kSet,
  kShard,
  kStatus,
  kThreads,
  kTries,
  kWorker
};

constexpr char kShortOptions[] = ":a:ho:?";
constexpr option kLongOptions[] = {
    {"args", required_argument, nullptr, kArgs},
    {"common-seeds", no_argument, nullptr, kCommonSeeds},
    {"dry-run", no_argument, nullptr, kDryRun},
    {"duration", required_argument, nullptr, kDuration},
    {"fresh", no_argument, nullptr, kFresh},
    {"help", no_argument, nullptr, kHelp},
    {"jobs", required_argument, nullptr, kJobs},
    {"limit-mb", required_argument, nullptr, kLimitMb},
    {"limit-seconds", required_argument, nullptr, kLimitSeconds},
    {"log", no_argument, nullptr, kLog},
    {"log-compression", required_argument, nullptr, kLogCompression},
    {"log-every", required_argument, nullptr, kLogEvery},
    {"log-models", required_argument, nullptr, kLogModels},
    {"log-ranges", required_argument, nullptr, kLogRanges},
    {"no-controllers", no_argument, nullptr, kNoControllers},
    {"no-progress", no_argument, nullptr, kNoProgress},
    {"only", required_argument, nullptr, kOnly},
    {"opencl", optional_argument, nullptr, kOpencl},
    {"out", required_argument, nullptr, kOut},
    {"plan-only", no_argument, nullptr, kPlanOnly},
    {"progress", no_argument, nullptr, kProgress},
    {"ray-model", required_argument, nullptr, kRayModel},
    {"resume", no_argument, nullptr, kResume},
    {"retry-failed", no_argument, nullptr, kRetryFailed},
    {"runs", required_argument, nullptr, kRuns},
    {"seed", required_argument, nullptr, kSeed},
    {"set", required_argument, nullptr, kSet},
    {"shard", required_argument, nullptr, kShard},
    {"status", no_argument, nullptr, kStatus},
    {"threads", required_argument, nullptr, kThreads},
    {"tries", required_argument, nullptr, kTries},
    {"worker", required_argument, nullptr, kWorker},
    {nullptr, 0, nullptr, 0},
};

// Options that define a sweep. They are refused for a folder that already has a plan.
constexpr int kPlanOptions[] = {kArgs,          kCommonSeeds, kDuration,  kLog,  kLogCompression,
                                kLogEvery,      kLogModels,   kLogRanges, kOut,  kRuns,
                                kNoControllers, kOpencl,      kRayModel,  kSeed, kSet,
                                kThreads,       kPlanOnly,    kDryRun};

std::string NameOf(int id) {
  for (const option* o = kLongOptions; o->name; o++)
    if (o->val == id) return std::string("--") + o->name;
  return "";
}

/// Parses two numbers with the separator between them.
std::optional<Range> ParsePair(const std::string& text, char separator) {
  const size_t at = std::min(text.find(separator), text.size());
  const auto first = ParseNumber<uint64_t>(text.substr(0, at));
  const auto second = ParseNumber<uint64_t>(text.substr(std::min(at + 1, text.size())));
  if (!first || !second) return std::nullopt;
  return Range{*first, *second};
}

Range ParseRange(int id, const std::string& text) {
  const std::optional<Range> range = ParsePair(text, ':');
  if (!range || range->first >= range->second || range->second > kMaxRuns)
    RefuseValue(NameOf(id), "FIRST:END, as in 0:100, which is 0 to 99", text);
  return *range;
}

Range ParseShard(const std::string& text) {
  const std::optional<Range> shard = ParsePair(text, '/');
  if (!shard || shard->first < 1 || shard->first > shard->second)
    RefuseValue("--shard", "K/N, from 1/N to N/N", text);
  return *shard;
}

class Parser {
 public:
  Parser(int argc, char* argv[]) : arguments_(argv, argv + argc) {
    arguments_.erase(arguments_.begin() + 1);
    arguments_.push_back(nullptr);
    options_.execution.progress = isatty(STDERR_FILENO) != 0;
    options_.plan.run.threads = 1;  // the cores are for workers
  }

  SweepOptions Parse() {
    const int count = static_cast<int>(arguments_.size()) - 1;
    int id;
    while ((id = getopt_long(count, arguments_.data(), kShortOptions, kLongOptions, nullptr)) !=
           -1) {
      given_.insert(id);
      Apply(id, optarg ? optarg : "");
      if (options_.action == Action::kHelp) return options_;
    }
    std::vector<std::string> words(arguments_.begin() + optind, arguments_.end() - 1);
    if (options_.action == Action::kResume || options_.action == Action::kStatus)
      TakeFolder(words);
    else
      TakeWorld(words);
    if (options_.execution.jobs == 0) options_.execution.jobs = UsualJobs();
    return options_;
  }

 private:
  void Apply(int id, const std::string& value) {
    Plan& plan = options_.plan;
    switch (id) {
      case kArgs:
        plan.controller_args = value;
        break;
      case kCommonSeeds:
        plan.common_seeds = true;
        break;
      case kDuration:
        plan.duration = ParseDuration(NameOf(id), value);
        break;
      case kNoControllers:
        plan.run.controllers = false;
        break;
      case kOpencl:
        plan.run.opencl = true;
        plan.run.device = value;
        break;
      case kRayModel:
        plan.run.ray_model = ParseRayModel(NameOf(id), value);
        break;
      case kRuns:
        std::tie(plan.first, plan.last) = ParseRange(id, value);
        break;
      case kSeed:
        plan.seed = ParseSeed(NameOf(id), value);
        break;
      case kSet:
        plan.axes.push_back(ParseAxis(value));
        break;
      case kThreads:
        plan.run.threads = ParseThreads(NameOf(id), value);
        break;
      case kLog:
      case kLogCompression:
      case kLogEvery:
      case kLogModels:
      case kLogRanges:
        ApplyLog(id, value);
        break;
      default:
        ApplyEffort(id, value);
    }
  }

  void ApplyLog(int id, const std::string& value) {
    if (!options_.plan.log) options_.plan.log.emplace();
    recording::LogOptions& log = *options_.plan.log;
    if (id == kLogCompression) log.compression = ParseCompression(NameOf(id), value);
    if (id == kLogEvery) log.every = ParseDuration(NameOf(id), value);
    if (id == kLogModels) log.robots = ParseNames(NameOf(id), value);
    if (id == kLogRanges) log.ranges = ParseRanges(NameOf(id), value);
  }

  void ApplyEffort(int id, const std::string& value) {
    ExecutionOptions& execution = options_.execution;
    switch (id) {
      case kFresh:
        execution.fresh = true;
        break;
      case kJobs:
        execution.jobs = static_cast<unsigned>(ParseThreads(NameOf(id), value));
        break;
      case kLimitMb:
        execution.limit_mb = ParseWithin(NameOf(id), 1, 1e9, "MB of memory, from 1 to 1e9", value);
        break;
      case kLimitSeconds:
        execution.limit_seconds =
            ParseWithin(NameOf(id), 0.001, 1e9, "seconds, from 0.001 to 1e9", value);
        break;
      case kTries:
        execution.tries =
            static_cast<int>(ParseWithin(NameOf(id), 1, 100, "a number from 1 to 100", value));
        break;
      case kWorker:
        if (value.empty()) RefuseValue("--worker", "a command", value);
        execution.worker = value;
        break;
      case kProgress:
      case kNoProgress:
        execution.progress = id == kProgress;
        break;
      default:
        ApplyAction(id, value);
    }
  }

  void ApplyAction(int id, const std::string& value) {
    switch (id) {
      case kOut:
        if (value.empty()) RefuseValue("--out", "the name of a folder", value);
        options_.folder = value;
        break;
      case kOnly:
        options_.only = ParseRange(id, value);
        break;
      case kShard:
        options_.shard = ParseShard(value);
        break;
      case kRetryFailed:
        options_.retry_failed = true;
        break;
      case kDryRun:
        Choose(Action::kDryRun);
        break;
      case kPlanOnly:
        Choose(Action::kPlanOnly);
        break;
      case kResume:
        Choose(Action::kResume);
        break;
      case kStatus:
        Choose(Action::kStatus);
        break;
      case kHelp:
        options_.action = Action::kHelp;
        break;
      default:
        if (id == kQuestion && optopt == '?')
          options_.action = Action::kHelp;
        else
          RefuseOption(id, kLongOptions, arguments_[static_cast<size_t>(optind - 1)]);
    }
  }

  void Choose(Action action) {
    if (options_.action != Action::kRun && options_.action != action)
      throw UsageError("expected one of --resume, --status, --dry-run and --plan-only");
    options_.action = action;
  }

  void TakeFolder(const std::vector<std::string>& words) {
    const char* const name = options_.action == Action::kResume ? "--resume" : "--status";
    if (words.size() != 1)
      throw UsageError(std::string(name) + ": found " + std::to_string(words.size()) +
                       " folders, expected one: that of the sweep");
    for (const int id : kPlanOptions)
      if (given_.count(id) > 0)
        throw UsageError(NameOf(id) + " does not go with " + name + ": the plan is already fixed");
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

  std::vector<char*> arguments_;  // a copy, because getopt reorders it
  std::set<int> given_;
  SweepOptions options_;
};

}  // namespace

SweepOptions ParseSweepOptions(int argc, char* argv[]) { return Parser(argc, argv).Parse(); }

}  // namespace Stg::program
