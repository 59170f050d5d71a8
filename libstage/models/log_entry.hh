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

/// What World::Log() writes down. Not to be used by several threads at once.
class LogEntry {
 public:
  /// Appends itself to the log, with the model's pose of now.
  LogEntry(usec_t timestamp, Model* mod);

  static std::vector<LogEntry> log;  ///< of all worlds

  static size_t Count() { return log.size(); }
  static void Clear() { log.clear(); }
  /// One line each on standard output: seconds, the model's number, its pose.
  static void Print();

 private:
  usec_t timestamp_;
  uint32_t model_id_;  // the model may be gone when the log is printed
  Pose pose_;
};

}  // namespace Stg

#endif
