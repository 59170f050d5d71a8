// SPDX-License-Identifier: GPL-2.0-or-later
//
// Has the runs of a sweep done by workers, and begins anew with those whose workers die.

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

/// How a sweep is done, which is no part of what it is.
struct Effort {
  unsigned jobs = 0;   ///< workers; at least 1 once it is settled
  bool fresh = false;  ///< a process of its own for each run
  double limit_seconds =
      0;                  ///< wall clock, of one run; 0: a day, and ten minutes to load its world
  double limit_mb = 0;    ///< memory of a worker and its children, in 2^20 bytes; 0: no limit
  int tries = 3;          ///< a run whose workers die so often has failed
  std::string worker;     ///< a command instead of the plan's; empty: the plan's
  bool progress = false;  ///< a line on standard error
};

class Coordinator {
 public:
  /// `todo`: indices of runs, in the order in which they are to be done.
  Coordinator(const SweepFolder& folder, const Plan& plan, const Effort& effort,
              std::vector<uint64_t> todo);

  /// The first look: has the worlds of some runs loaded, each value of an axis, up to a few. Throws
  /// std::runtime_error for the first one that can't be. Returns early if a signal comes.
  void Check();
  /// Returns when all is done, or a signal comes. Throws std::runtime_error, in one line.
  void Run();

  uint64_t done() const { return done_; }  ///< with a record, failed ones too
  uint64_t failed() const { return failed_; }

 private:
  static constexpr uint64_t kNone = UINT64_MAX;
  struct Slot {
    std::unique_ptr<WorkerProcess> process;
    uint64_t index = kNone;  ///< of the run that it does
    double since = 0;
  };

  void CheckOne(std::unique_ptr<WorkerProcess>* worker, uint64_t index);
  std::optional<Death> TryToLoad(WorkerProcess* worker, uint64_t index);
  std::string BrokenLimit(const WorkerProcess& worker, double since, double seconds) const;
  std::unique_ptr<WorkerProcess> Hire() const;
  void TryForeignWorker();
  bool HasWork() const { return !again_.empty() || next_ < todo_.size(); }
  void Employ(Slot* slot);
  void Wait();
  void Listen(Slot* slot);
  void Settle(Slot* slot, const std::string& answer);
  void Mourn(Slot* slot);
  void Fail(uint64_t index, const Death& death);
  void EnforceLimits(Slot* slot);
  void EnforceLimitsOfGroups(const std::vector<WorkerProcess*>& workers);
  void Housekeep();
  std::string ProgressText(double now) const;

  const SweepFolder& folder_;
  const Plan& plan_;
  const Effort& effort_;
  const std::string foreign_worker_;  // a command; empty: this program
  std::vector<uint64_t> todo_;
  size_t next_ = 0;                   // in todo_
  std::deque<uint64_t> again_;        // whose worker has died
  std::map<uint64_t, int> attempts_;  // of runs that a worker has died of
  std::vector<Slot> slots_;
  uint64_t done_ = 0, failed_ = 0;
  double begun_ = 0, next_housekeeping_ = 0, next_sync_ = 0, next_look_at_groups_ = 0;
  StatusLine line_;
};

}  // namespace Stg::program

#endif
