// SPDX-License-Identifier: GPL-2.0-or-later
//
// --save-snapshot and --from-snapshot.

#ifndef STAGE_TOOLS_STAGE_SNAPSHOTS_HH
#define STAGE_TOOLS_STAGE_SNAPSHOTS_HH

#include <optional>
#include <string>
#include <vector>

#include "stage/run.hh"

namespace Stg::program {

/// Takes the requested snapshot when its time has come.
class SnapshotSaver {
 public:
  /// Throws UsageError if the file cannot be written, or exists and is not a snapshot.
  explicit SnapshotSaver(const Options::SnapshotOrder& order);
  /// Call between steps. Throws std::runtime_error.
  void SaveIfDue(World* world);
  bool IsDone() const { return done_; }
  /// Reports that the run ended before the snapshot's time. Returns the exit status.
  int ReportEarlyEnd(const std::vector<LoadedWorld>& worlds) const;

 private:
  Options::SnapshotOrder order_;
  std::string place_;
  bool done_ = false;
};

std::optional<SnapshotSaver> OpenSaver(const Options& options);

/// Returns false, after a message, if the world cannot continue from the requested snapshot.
bool StartFromSnapshot(const Options& options, const std::vector<LoadedWorld>& worlds);

}  // namespace Stg::program

#endif
