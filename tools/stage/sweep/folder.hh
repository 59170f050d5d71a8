// SPDX-License-Identifier: GPL-2.0-or-later
//
// A sweep's folder: the plan, sweep.json, and a record of each finished run, in
// runs/000/000017.json. It is all that a sweep knows of itself: whatever is killed, what is there
// is whole, and the rest can be run by anybody who sees the folder.

#ifndef STAGE_TOOLS_STAGE_SWEEP_FOLDER_HH
#define STAGE_TOOLS_STAGE_SWEEP_FOLDER_HH

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "stage/sweep/plan.hh"

namespace Stg::program {

/// Functions throw std::runtime_error, in one line, if a file can't be read or written.
class SweepFolder {
 public:
  explicit SweepFolder(std::string path) : path_(std::move(path)) {}

  const std::string& path() const { return path_; }
  std::string PlanFile() const { return path_ + "/sweep.json"; }
  std::string RecordFile(uint64_t index) const;
  /// Where --log records that run.
  std::string LogFile(uint64_t index) const;

  bool HasPlan() const;
  Plan Read() const;
  /// Whether the folder was not there and was made. Throws UsageError for a place that may hold
  /// anything but a sweep: a folder that is not empty and has no plan, the root folder, a home
  /// folder.
  bool Make() const;
  /// If it has a plan already, that has to be the same.
  void Write(const Plan& plan) const;

  /// By index: whether that run has a record.
  std::vector<bool> Finished(const Plan& plan) const;
  bool HasRecord(uint64_t index) const;
  std::string ReadRecord(uint64_t index) const;
  /// Throws std::runtime_error if the file holds something else than the record of that run.
  nlohmann::ordered_json Record(const Plan& plan, uint64_t index) const;
  /// Whole or not at all; safe from a crash of the system after the next Sync().
  void WriteRecord(uint64_t index, const std::string& record) const;
  /// For what is to be written there.
  void MakeFolderOf(uint64_t index) const;
  void Sync() const;

 private:
  std::string path_;
};

/// Held while a sweep works on a folder, or on its part of it; the system lets go of it whatever
/// becomes of the process.
class SweepLock {
 public:
  /// `part`: what else must not be worked on at the same time, such as "1-of-4". Throws
  /// std::runtime_error if another process holds it.
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
