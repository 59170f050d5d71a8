// SPDX-License-Identifier: GPL-2.0-or-later
//
// `stage replay LOG`: shows a run recorded with --log. The world is loaded from the files in the
// log.

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
  /// Returns null if the options ask for no replay. Otherwise changes them to run the world in the
  /// log. Throws std::runtime_error if the log cannot be read.
  static std::unique_ptr<ReplayRun> Open(Options* options);

  /// Call before and after loading the world. In between, the log's folders are on STAGEPATH. They
  /// are removed afterwards, because plug-ins are looked up there too and a log is not trusted.
  void BeginLoading();
  void EndLoading();
  /// Call when the world is loaded.
  void Attach(World* world);
  /// Shows this time, in simulated seconds.
  void SeekTo(double seconds);
  /// The log's file name without folders.
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
  const usec_t duration_;                          // wanted duration; 0: the whole log
  std::optional<recording::UnpackedFiles> files_;  // until the world is loaded
  std::optional<std::string> path_before_;         // the original STAGEPATH
};

}  // namespace Stg::program

#endif
