// SPDX-License-Identifier: GPL-2.0-or-later
//
// The coordinator's end of a worker.

#ifndef STAGE_TOOLS_STAGE_SWEEP_WORKER_PROCESS_HH
#define STAGE_TOOLS_STAGE_SWEEP_WORKER_PROCESS_HH

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stage/sweep/lines.hh"
#include "stage/sweep/record.hh"

namespace Stg::program {

class WorkerProcess {
 public:
  /// Starts it. Throws std::runtime_error if the system refuses.
  WorkerProcess(const std::vector<std::string>& command, const std::string& folder);
  /// Kills it if it still runs.
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// What poll() may wait for: answers, and what it prints.
  int answers_file() const { return answers_; }
  int output_file() const { return output_; }

  void Order(const std::string& command);
  /// What it has answered. Nothing: not yet.
  std::optional<std::string> Answer();
  /// Takes in what it has printed; the last lines are kept. False once it has closed that.
  bool ReadOutput();
  /// Nothing was printed that a failure of a later run would be blamed on.
  void ForgetOutput() { printed_.clear(); }

  /// Whether there will be no more answers. One may still be there.
  bool HasEnded();
  /// Waits until it is gone.
  Death Bury();
  /// `reason`: what Bury() is to say.
  void Kill(const std::string& reason);
  double MemoryMb() const;

 private:
  pid_t pid_;
  int commands_, answers_, output_;
  LineReader reader_;
  std::string printed_;
  std::string reason_;
  bool silent_ = false;  // it has closed its answers
};

}  // namespace Stg::program

#endif
