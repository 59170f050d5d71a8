// SPDX-License-Identifier: GPL-2.0-or-later
//
// The record of a run of a sweep: one line of JSON.

#ifndef STAGE_TOOLS_STAGE_SWEEP_RECORD_HH
#define STAGE_TOOLS_STAGE_SWEEP_RECORD_HH

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "stage/sweep/plan.hh"

namespace Stg::program {

/// Names and values of metrics; a metric may have no value.
using OwnMetrics = std::vector<std::pair<std::string, std::optional<double>>>;

/// `wall_seconds`: time spent in steps. `own`: metrics of a foreign worker, in addition to those of
/// the world.
std::string RecordOf(const Plan& plan, const RunSpec& spec, World* world, double wall_seconds,
                     int attempt, const OwnMetrics& own = {});

/// How a process ended.
struct WorkerExit {
  int wait_status = 0;             ///< see waitpid()
  std::string reason;              ///< why Stage ended it; otherwise empty
  std::vector<std::string> lines;  ///< the last lines that it printed
};
std::string FailureRecordOf(const Plan& plan, const RunSpec& spec, const WorkerExit& worker_exit,
                            int attempts);
/// Throws std::runtime_error with one line if the record belongs to another run or misses a field
/// that every record has.
void CheckRecord(const nlohmann::ordered_json& record, const Plan& plan, uint64_t index);

/// Returns "SIGSEGV", "exit status 3", or the reason.
std::string Describe(const WorkerExit& worker_exit);

}  // namespace Stg::program

#endif
