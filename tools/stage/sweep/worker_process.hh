// SPDX-License-Identifier: GPL-2.0-or-later
//
// The coordinator's end of a worker.

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

/// A worker and the processes that its controllers start: one process group, which is killed as a
/// whole. No function waits longer than a few seconds, whatever the worker does.
class WorkerProcess {
 public:
  /// Starts it. Throws std::runtime_error if the system refuses.
  WorkerProcess(const std::vector<std::string>& command, const std::string& folder);
  /// Kills its process group.
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// The files that poll() may wait for: replies, and printed text. -1, which poll() ignores, once
  /// the worker has closed them.
  int answers_file() const { return silent_since_ > 0 ? -1 : answers_; }
  int output_file() const { return output_ended_ ? -1 : output_; }
  /// The process group, as in getpgid().
  pid_t group() const { return pid_; }

  /// Sends a line. A worker that is gone, or that takes no lines, does not reply.
  void Order(const std::string& command);
  /// The next line of its reply, if it is whole. Nothing from a worker that was killed.
  std::optional<std::string> Answer();
  /// Takes in a part of what it has printed; the last lines are kept.
  void ReadOutput();
  /// Drops what was printed, so that a later run that fails is not blamed for it.
  void ForgetOutput() { printed_.clear(); }

  /// Whether there will be no more answers; one that was taken in may still be there. Kills a
  /// worker that has closed its answers and does not end.
  bool HasEnded();
  /// Kills what is left of its process group, and says how the worker itself has ended.
  Death Bury();
  /// Kills the process group. Bury() gives the first `reason`.
  void Kill(const std::string& reason);
  /// Resident memory of the worker alone, in MB (2^20 bytes).
  double MemoryMb() const;

 private:
  bool IsDead() const;
  void Reap();

  pid_t pid_;  // -1: it was waited for
  int commands_, answers_, output_;
  LineReader reader_;
  std::string printed_;
  std::string reason_;
  int wait_status_ = 0;
  double silent_since_ = 0;  // Now() when its answers ended; 0: they go on
  double killed_since_ = 0;  // Now() when it was killed; 0: it was not
  bool output_ended_ = false;
};

/// Memory of those process groups that have several processes, in MB (2^20 bytes), by their
/// numbers. What processes share is counted once. Looks at all processes of the machine.
std::map<pid_t, double> MemoryOfGroups(const std::set<pid_t>& groups);

}  // namespace Stg::program

#endif
