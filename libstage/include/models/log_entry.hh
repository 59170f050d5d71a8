// SPDX-License-Identifier: GPL-2.0-or-later
//
// A log of the poses of models. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_LOG_ENTRY_HH
#define STAGE_MODELS_LOG_ENTRY_HH

#include <stdint.h>

#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class Model;

/// An entry made by World::Log().
class LogEntry {
 public:
  /// Records the model's current pose. Appends itself to `log` if the model's world is listed.
  LogEntry(usec_t timestamp, Model* mod);

  usec_t timestamp() const { return timestamp_; }
  uint32_t model_id() const { return model_id_; }
  const Pose& pose() const { return pose_; }

  /// Entries of all listed worlds; World::log() has those of one. Do not access it while another
  /// thread may add entries.
  static std::vector<LogEntry> log;

  static size_t Count();
  static void Clear();
  /// Prints one line per entry on standard output: seconds, model id, pose.
  static void Print();

 private:
  usec_t timestamp_;
  uint32_t model_id_;  // an id, because the model may be deleted before printing
  Pose pose_;
};

}  // namespace Stg

#endif
