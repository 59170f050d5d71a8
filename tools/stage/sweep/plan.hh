// SPDX-License-Identifier: GPL-2.0-or-later
//
// The definition of a sweep: every combination of its axes' values, several runs each.

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

/// One --set NAME=VALUE,VALUE.
struct Axis {
  std::string name;
  std::vector<std::string> values;  ///< at least one
};

struct Plan {
  std::string world;             ///< absolute path
  std::string digest;            ///< digest of the texts that the world is read from
  std::vector<Axis> axes;        ///< the last one varies fastest
  uint64_t first = 0, last = 1;  ///< run numbers per combination: first..last-1
  bool common_seeds = false;     ///< run n has the same seed in every combination
  std::string controller_args;
  std::string worker;  ///< shell command of a foreign worker; empty: this program
  RunOptions run;      ///< options of all runs; its seed is the base seed of the sweep
  std::optional<recording::LogOptions> log;  ///< its file name is not used

  uint64_t RunsEach() const { return last - first; }
  /// Total number of runs.
  uint64_t Count() const;
};

/// One run of a sweep.
struct RunSpec {
  uint64_t index = 0;  ///< index in the plan
  uint64_t run = 0;    ///< number among the runs with equal values
  uint64_t seed = 0;   ///< below 2^53, which JSON represents exactly
  std::vector<std::pair<std::string, std::string>> set;  ///< (name, value) of each axis
};

constexpr uint64_t kMaxRuns = 100'000'000;

/// Parses NAME=VALUE,VALUE. Commas within quotes or brackets belong to a value. Throws UsageError.
Axis ParseAxis(const std::string& text);

/// Throws std::runtime_error if the plan has no run with that index.
RunSpec RunAt(const Plan& plan, uint64_t index);
/// Returns the values in the format of RunOptions::settings.
std::vector<std::string> SettingsOf(const RunSpec& spec);
RunOptions RunOptionsOf(const Plan& plan, const RunSpec& spec);
/// A shell command that repeats this run alone.
std::string ReplayCommand(const Plan& plan, const RunSpec& spec);

/// Digest of the world file and all its includes. Throws LoadError.
std::string DigestOf(const std::string& world);

std::string ToJson(const Plan& plan);
/// Throws std::runtime_error with one line if the text is not a plan of this version.
Plan ReadPlan(const std::string& json);

}  // namespace Stg::program

#endif
