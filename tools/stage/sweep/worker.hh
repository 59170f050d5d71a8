// SPDX-License-Identifier: GPL-2.0-or-later
//
// A worker: a process that executes runs of a sweep, one after the other, on command.
//
// It is started as COMMAND FOLDER. It reads commands as lines from file descriptor 3 and answers
// with lines on 4. Its standard output and error are for people.
//
//   check INDEX         loads the world of that run; answers "ok"
//   run INDEX ATTEMPT   executes that run and writes its record; answers "done INDEX"
//
// The answer is "error MESSAGE" if the world cannot be loaded. The worker ends at the end of its
// input. A run with the same values as the previous one resets the world instead of loading it.

#ifndef STAGE_TOOLS_STAGE_SWEEP_WORKER_HH
#define STAGE_TOOLS_STAGE_SWEEP_WORKER_HH

#include <string>

namespace Stg::program {

constexpr int kCommandsFile = 3, kAnswersFile = 4;

/// Argument that makes the program a worker; the folder follows.
constexpr char kWorkerCommand[] = "sweep-worker";

/// Returns the exit status. Throws std::runtime_error.
int RunWorker(const std::string& folder);

}  // namespace Stg::program

#endif
