// SPDX-License-Identifier: GPL-2.0-or-later
//
// `stage replay LOG`: a run that shows what --log has recorded. Its world is loaded from the files
// that are in the log.

#ifndef STAGE_TOOLS_STAGE_REPLAY_HH
#define STAGE_TOOLS_STAGE_REPLAY_HH

#include <memory>
#include <optional>
#include <string>

#include "recording/replay.hh"
#include "recording/world_files.hh"
#include "stage.hh"
#include "stage/options.hh"

namespace Stg::program {

class ReplayRun {
 public:
  /// Null if the options ask for no replay. Otherwise they are made those of a run of the world in
  /// the log. Throws std::runtime_error if that can't be read.
  static std::unique_ptr<ReplayRun> Open(Options* options);

  /// To be called before and after the world is loaded. In between, what lay in other folders is
  /// found as what lies in STAGEPATH is; not longer, as plug-ins are looked for there too, and a
  /// log is nobody to trust.
  void BeginLoading();
  void EndLoading();
  /// To be called when the world is loaded.
  void Attach(World* world);
  /// Shows that time, simulated seconds.
  void GoTo(double seconds);
  /// The log's name, without folders.
  const std::string& name() const { return name_; }
  double start() const { return static_cast<double>(replay_.start()) / 1e6; }
  double end() const;

 private:
  ReplayRun(const std::string& file, usec_t duration)
      : name_(file.substr(file.rfind('/') + 1)),
        replay_(file),
        duration_(duration),
        files_(replay_.files()) {}
  usec_t End() const;

  const std::string name_;
  recording::Replay replay_;
  const usec_t duration_;                          // wanted; 0: all of it
  std::optional<recording::UnpackedFiles> files_;  // until the world is loaded
  std::optional<std::string> path_before_;         // STAGEPATH
};

}  // namespace Stg::program

#endif
