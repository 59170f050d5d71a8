// SPDX-License-Identifier: GPL-2.0-or-later
//
// The record of a run of a sweep: one line of JSON.

#ifndef STAGE_TOOLS_STAGE_SWEEP_RECORD_HH
#define STAGE_TOOLS_STAGE_SWEEP_RECORD_HH

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "stage/sweep/plan.hh"

namespace Stg::program {

/// `wall_seconds`: spent in steps.
std::string RecordOf(const Plan& plan, const RunSpec& spec, World* world, double wall_seconds,
                     int attempt);

/// How a process has ended.
struct Death {
  int wait_status = 0;             ///< see waitpid()
  std::string reason;              ///< where Stage itself has ended it; otherwise empty
  std::vector<std::string> lines;  ///< the last ones that it has printed
};
std::string FailureRecordOf(const Plan& plan, const RunSpec& spec, const Death& death,
                            int attempts);
/// Throws std::runtime_error, in one line, if the record is none of that run of the plan: another
/// run's, or without what every record has.
void CheckRecord(const nlohmann::ordered_json& record, const Plan& plan, uint64_t index);

/// "SIGSEGV", "exit status 3", or the reason.
std::string Describe(const Death& death);

}  // namespace Stg::program

#endif
