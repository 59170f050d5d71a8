// SPDX-License-Identifier: GPL-2.0-or-later
//
// A worker: a process that does runs of a sweep, one after the other, as it is told to.
//
// It is started as COMMAND FOLDER. Commands come in as lines on file descriptor 3, answers go out
// as lines on 4; what it prints is for people.
//
//   check INDEX         load the world of that run; answer "ok"
//   run INDEX ATTEMPT   do that run, write its record; answer "done INDEX"
//
// The answer is "error MESSAGE" where the world can't be loaded. At the end of the file the worker
// ends. Worlds stay loaded: a run with the values of the one before starts with a reset.

#ifndef STAGE_TOOLS_STAGE_SWEEP_WORKER_HH
#define STAGE_TOOLS_STAGE_SWEEP_WORKER_HH

#include <string>

namespace Stg::program {

constexpr int kCommandsFile = 3, kAnswersFile = 4;

/// What the program is called with to be a worker, in front of the folder.
constexpr char kWorkerCommand[] = "sweep-worker";

/// Returns the status to exit with. Throws std::runtime_error.
int RunWorker(const std::string& folder);

}  // namespace Stg::program

#endif
