// SPDX-License-Identifier: GPL-2.0-or-later
//
// A log of where models were when. Part of <stage.hh>; C++11.

#ifndef STAGE_MODELS_LOG_ENTRY_HH
#define STAGE_MODELS_LOG_ENTRY_HH

#include <stdint.h>

#include <vector>

#include "geometry/geometry.hh"

namespace Stg {

class Model;

/// What World::Log() writes down.
class LogEntry {
 public:
  /// With the model's pose of now. Appends itself to `log` if the model's world is listed.
  LogEntry(usec_t timestamp, Model* mod);

  usec_t timestamp() const { return timestamp_; }
  uint32_t model_id() const { return model_id_; }
  const Pose& pose() const { return pose_; }

  /// Of all listed worlds; World::log() has the entries of one. Not to be touched while another
  /// thread may write down something.
  static std::vector<LogEntry> log;

  static size_t Count();
  static void Clear();
  /// One line each on standard output: seconds, the model's number, its pose.
  static void Print();

 private:
  usec_t timestamp_;
  uint32_t model_id_;  // the model may be gone when the log is printed
  Pose pose_;
};

}  // namespace Stg

#endif
