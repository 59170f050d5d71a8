// SPDX-License-Identifier: GPL-2.0-or-later
//
// Writes topics of ROS 2 to an MCAP file.

#ifndef STAGE_RECORDING_LOG_WRITER_HH
#define STAGE_RECORDING_LOG_WRITER_HH

#include <functional>
#include <map>
#include <string>
#include <unordered_map>

#include "recording/mcap_writer.hh"
#include "recording/ros_messages.hh"

namespace Stg::recording {

class LogWriter {
 public:
  LogWriter(const std::string& file, Compression compression);

  /// Returns a topic's channel, new on first use. `latched`: late subscribers get the last message.
  uint16_t Channel(const std::string& topic, const std::function<MessageType()>& type,
                   bool latched = false);
  /// Adds a serialized message.
  void Add(uint16_t channel, usec_t time, const Buffer& message);
  McapWriter& mcap() { return mcap_; }
  const McapWriter& mcap() const { return mcap_; }

 private:
  McapWriter mcap_;
  std::map<std::string, uint16_t> schemas_;
  std::unordered_map<std::string, uint16_t> channels_;
};

}  // namespace Stg::recording

#endif
