// SPDX-License-Identifier: GPL-2.0-or-later
//
// The folder of a sweep: the plan in sweep.json, and a record per finished run in
// runs/000/000017.json. This is the sweep's entire state. Files are always complete, so any process
// that sees the folder can run what is left after a crash.

#ifndef STAGE_TOOLS_STAGE_SWEEP_FOLDER_HH
#define STAGE_TOOLS_STAGE_SWEEP_FOLDER_HH

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "stage/sweep/plan.hh"

namespace Stg::program {

/// Functions throw std::runtime_error with one line if a file cannot be read or written.
class SweepFolder {
 public:
  explicit SweepFolder(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }
  std::string PlanFile() const { return path_ + "/sweep.json"; }
  std::string RecordFile(uint64_t index) const;
  /// The file for the run's --log while the run goes on. Creates its folder.
  std::string StartLog(uint64_t index) const;
  /// Gives the finished log its final name.
  void KeepLog(uint64_t index) const;

  bool HasPlan() const;
  Plan Read() const;
  /// Creates the folder. Returns true if it did not exist. Throws UsageError for a folder that may
  /// hold other data: one that is not empty and has no plan, the root folder, a home folder.
  bool Make() const;
  /// Writes the plan. An existing plan must be equal.
  void Write(const Plan& plan) const;

  /// Returns, by index, whether the run has a record.
  std::vector<bool> Finished(const Plan& plan) const;
  bool HasRecord(uint64_t index) const;
  std::string ReadRecord(uint64_t index) const;
  /// Throws std::runtime_error if the file is not the record of that run.
  nlohmann::ordered_json Record(const Plan& plan, uint64_t index) const;
  /// Writes the record completely or not at all. It survives a system crash after the next Sync().
  void WriteRecord(uint64_t index, const std::string& record) const;
  void Sync() const;

 private:
  std::string path_;
};

/// Locks a folder, or a part of its sweep. The system releases the lock when the process ends in
/// any way.
class SweepLock {
 public:
  /// `part` names what is locked, such as "1-of-4". Throws std::runtime_error if another process
  /// holds the lock.
  SweepLock(const SweepFolder& folder, const std::string& part);
  ~SweepLock();
  SweepLock(const SweepLock&) = delete;
  SweepLock& operator=(const SweepLock&) = delete;

 private:
  bool IsInPlace();

  std::string name_;
  int file_;
};

}  // namespace Stg::program

#endif
