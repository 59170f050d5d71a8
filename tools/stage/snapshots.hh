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

/// Takes the snapshot that was ordered, when its time has come.
class SnapshotSaver {
 public:
  /// Throws UsageError if the file could not be written, or holds something else than a snapshot.
  explicit SnapshotSaver(const Options::SnapshotOrder& order);
  /// To be called between steps. Throws std::runtime_error.
  void SaveIfDue(World* world);
  bool IsDone() const { return done_; }
  /// Of a run that ended before the snapshot's time; returns the status to exit with.
  int TellTooEarlyAnEnd(const std::vector<LoadedWorld>& worlds) const;

 private:
  Options::SnapshotOrder order_;
  std::string place_;
  bool done_ = false;
};

std::optional<SnapshotSaver> OpenSaver(const Options& options);

/// False, with a message, if the world can't go on from the snapshot that was asked for.
bool StartFromSnapshot(const Options& options, const std::vector<LoadedWorld>& worlds);

}  // namespace Stg::program

#endif
