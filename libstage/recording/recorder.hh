// SPDX-License-Identifier: GPL-2.0-or-later
//
// Logs of a run: what the robots of a world sense, believe and do, as an MCAP file of ROS 2
// messages. A log changes nothing in the run: the recorder looks at the world between steps,
// subscribes to nothing and adds no callbacks to models.

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
  usec_t every = 0;                 ///< simulated; 0: whenever something has updated
  std::vector<std::string> robots;  ///< names, or patterns of them with * and ?; empty: all
  Compression compression = UsualCompression();
  RangeConvention ranges = RangeConvention::kRep117;
};

class Recorder {
 public:
  /// Makes the file, or empties an earlier log. Throws std::runtime_error if it can't be written,
  /// or holds something else.
  explicit Recorder(const LogOptions& options);
  ~Recorder();
  Recorder(const Recorder&) = delete;
  Recorder& operator=(const Recorder&) = delete;

  /// To be called when the world is loaded: writes how things are, and from then on what each step
  /// changes, until the world is unloaded. If the file can't be written any more, the world is to
  /// quit. Throws std::runtime_error if there is no such robot, or if there are too many topics.
  void Attach(World* world);
  /// Ends the file. Throws std::runtime_error if anything could not be written.
  void Finish();

 private:
  class Impl;
  std::shared_ptr<Impl> impl_;
};

}  // namespace Stg::recording

#endif
