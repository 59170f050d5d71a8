// SPDX-License-Identifier: GPL-2.0-or-later
//
// The coordinator's handle of a worker process.

#ifndef STAGE_TOOLS_STAGE_SWEEP_WORKER_PROCESS_HH
#define STAGE_TOOLS_STAGE_SWEEP_WORKER_PROCESS_HH

#include <sys/types.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "stage/sweep/lines.hh"
#include "stage/sweep/record.hh"

namespace Stg::program {

/// A worker and the processes that its controllers start. They form a process group that is killed
/// as a whole. No function blocks longer than a few seconds.
class WorkerProcess {
 public:
  /// Starts the worker. Throws std::runtime_error if the system refuses.
  WorkerProcess(const std::vector<std::string>& command, const std::string& folder);
  /// Kills the process group.
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// Descriptors for poll(): replies and printed output. -1, which poll() ignores, after the worker
  /// has closed them.
  int answers_file() const { return answers_ended_at_ > 0 ? -1 : answers_; }
  int output_file() const { return output_ended_ ? -1 : output_; }
  /// The process group's id, as in getpgid().
  pid_t group() const { return pid_; }

  /// Sends a line. A worker that is dead or reads nothing will not reply.
  void Order(const std::string& command);
  /// Returns the next complete line of the reply, if any. Returns nothing after a kill.
  std::optional<std::string> Answer();
  /// Reads some of the printed output and keeps the last lines.
  void ReadOutput();
  /// Drops the output so far, so that it is not attributed to a later run.
  void ForgetOutput() { printed_.clear(); }

  /// True if no further answers will arrive, apart from lines read already. Kills a worker that has
  /// closed its answers but does not end.
  bool HasEnded();
  /// Kills the rest of the process group and returns how the worker ended.
  WorkerExit CollectExit();
  /// Kills the process group. CollectExit() returns the first `reason`.
  void Kill(const std::string& reason);
  /// Resident memory of the worker alone, in MB (2^20 bytes).
  double MemoryMb() const;

 private:
  bool IsDead() const;
  void Reap();

  pid_t pid_;  // -1 after waitpid()
  int commands_, answers_, output_;
  LineReader reader_;
  std::string printed_;
  std::string reason_;
  int wait_status_ = 0;
  double answers_ended_at_ = 0;  // WallClock() when its answers ended; 0: still open
  double killed_at_ = 0;         // WallClock() when it was killed; 0: not killed
  bool output_ended_ = false;
};

/// Memory of the given process groups that have several processes, in MB (2^20 bytes), by group id.
/// Shared pages count once. Reads /proc for all processes of the machine.
std::map<pid_t, double> MemoryOfGroups(const std::set<pid_t>& groups);

}  // namespace Stg::program

#endif
