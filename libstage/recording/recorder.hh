// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs a run to an MCAP file of ROS 2 messages: what the robots of a world sense, estimate and do.
// A log never changes the run. The recorder reads the world between steps, subscribes to nothing
// and adds no callbacks to models.

#ifndef STAGE_RECORDING_RECORDER_HH
#define STAGE_RECORDING_RECORDER_HH

#include <memory>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "recording/compression.hh"
#include "recording/ros_messages.hh"

namespace Stg {
class World;
}

namespace Stg::recording {

struct LogOptions {
  std::string file;
  usec_t every = 0;                            ///< simulated time; 0: at every update
  std::vector<std::string> robots;             ///< names, or patterns with * and ?; empty: all
  const char* robots_option = "--log-models";  ///< what errors call it
  Compression compression = DefaultCompression();
  RangeConvention ranges = RangeConvention::kRep117;
};

class Recorder {
 public:
  /// Creates the file or empties an earlier log. Throws std::runtime_error if it cannot be written,
  /// or exists and is not a log.
  explicit Recorder(const LogOptions& options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// Call when the world is loaded. Writes its state now and the changes of each step, until the
  /// world is unloaded or set back to an earlier time. If the file can no longer be written, it
  /// asks the world to quit. Throws std::runtime_error if no robot matches, or if there are too
  /// many topics.
  void Attach(World* world);

  // For a world that is a row of a pool, and of which there is no lasting object. Each call has an
  // object in the present state, which may be deleted afterwards. They throw std::runtime_error as
  // Attach() does, and if the file can no longer be written.

  void Begin(World* world);       ///< instead of Attach()
  void BeforeStep(World* world);  ///< after the commands for the step were given
  void AfterStep(World* world);

  /// Completes the file. Throws std::runtime_error if anything could not be written.
  void Finish();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace Stg::recording

#endif
