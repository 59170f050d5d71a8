// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a sweep is to run: every combination of its axes' values, each so many times.

#ifndef STAGE_TOOLS_STAGE_SWEEP_PLAN_HH
#define STAGE_TOOLS_STAGE_SWEEP_PLAN_HH

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "recording/recorder.hh"
#include "stage.hh"

namespace Stg::program {

/// Of --set NAME=VALUE,VALUE
struct Axis {
  std::string name;
  std::vector<std::string> values;  ///< at least one
};

struct Plan {
  std::string world;             ///< an absolute path
  std::string digest;            ///< of the texts that the world is read from
  std::vector<Axis> axes;        ///< the last one varies fastest
  uint64_t first = 0, last = 1;  ///< runs of each combination: numbers first..last-1
  uint64_t seed = 1;             ///< of the sweep
  bool common_seeds = false;     ///< run n has the same seed in every combination
  usec_t duration = 0;           ///< 0: the world's quit_time
  std::string controller_args;
  std::string worker;  ///< a command, for a shell, whose processes do the runs; empty: this program
  RunOptions run;      ///< threads, device, ray model, controllers; the rest is not used
  std::optional<recording::LogOptions> log;  ///< its file is not used

  uint64_t RunsEach() const { return last - first; }
  /// Runs in all.
  uint64_t Count() const;
};

/// One run of a sweep.
struct RunSpec {
  uint64_t index = 0;  ///< in the plan
  uint64_t run = 0;    ///< of those with the same values
  uint64_t seed = 0;   ///< below 2^53, which every reader of JSON knows exactly
  std::vector<std::pair<std::string, std::string>> set;  ///< names and values
};

constexpr uint64_t kMostRuns = 100'000'000;

/// NAME=VALUE,VALUE: commas within quotes or brackets belong to a value. Throws UsageError.
Axis ParseAxis(const std::string& text);

/// `index` below the plan's Count().
RunSpec RunAt(const Plan& plan, uint64_t index);
/// As for RunOptions::settings.
std::vector<std::string> SettingsOf(const RunSpec& spec);
RunOptions RunOptionsOf(const Plan& plan, const RunSpec& spec);
/// A line for a shell that does that run alone.
std::string ReplayCommand(const Plan& plan, const RunSpec& spec);

/// Of the world file and all that it includes. Throws LoadError.
std::string DigestOf(const std::string& world);

std::string ToJson(const Plan& plan);
/// Throws std::runtime_error, in one line, for what is no plan of this version.
Plan ReadPlan(const std::string& json);

}  // namespace Stg::program

#endif
