// SPDX-License-Identifier: GPL-2.0-or-later
//
// Distributes the runs of a sweep to workers, and restarts runs whose worker died.

#ifndef STAGE_TOOLS_STAGE_SWEEP_COORDINATOR_HH
#define STAGE_TOOLS_STAGE_SWEEP_COORDINATOR_HH

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "stage/status_line.hh"
#include "stage/sweep/folder.hh"
#include "stage/sweep/plan.hh"
#include "stage/sweep/worker_process.hh"

namespace Stg::program {

/// How a sweep is executed; does not affect its results.
struct ExecutionOptions {
  unsigned jobs = 0;         ///< number of workers; at least 1 once resolved
  bool fresh = false;        ///< a separate process for each run
  double limit_seconds = 0;  ///< real time per run; 0: a day, and ten minutes for loading
  double limit_mb = 0;       ///< of a worker and its children, in 2^20 bytes; 0: no limit
  int tries = 3;             ///< a run fails if this many of its workers die
  std::string worker;        ///< a command that overrides the plan's; empty: the plan's
  bool progress = false;     ///< show a line on standard error
};

class Coordinator {
 public:
  /// `todo`: indices of the runs, in the order of execution.
  Coordinator(const SweepFolder& folder, const Plan& plan, const ExecutionOptions& execution,
              std::vector<uint64_t> todo);

  /// Loads the worlds of some runs first, covering each value of an axis up to a limit. Throws
  /// std::runtime_error for the first that fails. Returns early on a signal.
  void Check();
  /// Returns when all runs are done or a signal comes. Throws std::runtime_error with one line.
  void Run();

  uint64_t done() const { return done_; }  ///< runs with a record, including failed ones
  uint64_t failed() const { return failed_; }

 private:
  static constexpr uint64_t kNone = UINT64_MAX;
  struct Slot {
    std::unique_ptr<WorkerProcess> process;
    uint64_t index = kNone;  ///< current run
    double since = 0;
  };

  void CheckOne(std::unique_ptr<WorkerProcess>* worker, uint64_t index);
  std::optional<WorkerExit> TryToLoad(WorkerProcess* worker, uint64_t index);
  std::string BrokenLimit(const WorkerProcess& worker, double since, double seconds) const;
  std::unique_ptr<WorkerProcess> StartWorker() const;
  void TryForeignWorker();
  bool HasWork() const { return !retries_.empty() || next_ < todo_.size(); }
  void AssignRun(Slot* slot);
  void Wait();
  void ReadAnswers(Slot* slot);
  void FinishRun(Slot* slot, const std::string& answer);
  void HandleDeath(Slot* slot);
  void Fail(uint64_t index, const WorkerExit& worker_exit);
  void EnforceLimits(Slot* slot);
  void EnforceLimitsOfGroups(const std::vector<WorkerProcess*>& workers);
  void CheckLimits();
  std::string ProgressText(double now) const;

  const SweepFolder& folder_;
  const Plan& plan_;
  const ExecutionOptions& execution_;
  const std::string foreign_worker_;  // a command; empty: this program
  std::vector<uint64_t> todo_;
  size_t next_ = 0;                   // index into todo_
  std::deque<uint64_t> retries_;      // runs whose worker died
  std::map<uint64_t, int> attempts_;  // per run, the number of workers that died
  std::vector<Slot> slots_;
  uint64_t done_ = 0, failed_ = 0;
  double begun_ = 0, next_housekeeping_ = 0, next_sync_ = 0, next_group_check_ = 0;
  StatusLine line_;
};

}  // namespace Stg::program

#endif
