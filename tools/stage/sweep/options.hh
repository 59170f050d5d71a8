// SPDX-License-Identifier: GPL-2.0-or-later
//
// The command line of `stage sweep`.

#ifndef STAGE_TOOLS_STAGE_SWEEP_OPTIONS_HH
#define STAGE_TOOLS_STAGE_SWEEP_OPTIONS_HH

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "stage/sweep/coordinator.hh"
#include "stage/sweep/plan.hh"

namespace Stg::program {

struct SweepOptions {
  enum class Action { kRun, kResume, kStatus, kDryRun, kPlanOnly, kHelp };

  Action action = Action::kRun;
  std::string folder;
  Plan plan;  ///< for kRun, kDryRun and kPlanOnly; without its digest
  ExecutionOptions execution;
  std::optional<std::pair<uint64_t, uint64_t>> shard;  ///< (number from 1, number of shards)
  std::optional<std::pair<uint64_t, uint64_t>> only;   ///< run indices, the second excluded
  bool retry_failed = false;
};

/// argv[1] is "sweep". Throws UsageError.
SweepOptions ParseSweepOptions(int argc, char* argv[]);

}  // namespace Stg::program

#endif
