// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/log_writer.hh"

#include "stage_config.hh"

namespace Stg::recording {

namespace {

/// QoS in rosbag2's format: reliable, transient local, depth 1.
constexpr char kLatched[] =
    "- history: 1\n  depth: 1\n  reliability: 1\n  durability: 1\n"
    "  deadline:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  lifespan:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  liveliness: 1\n"
    "  liveliness_lease_duration:\n    sec: 9223372036\n    nsec: 854775807\n"
    "  avoid_ros_namespace_conventions: false\n";

}  // namespace

LogWriter::LogWriter(const std::string& file, Compression compression)
    : mcap_(file, compression, "ros2", std::string("Stage ") + kVersion) {}

uint16_t LogWriter::Channel(const std::string& topic, const std::function<MessageType()>& type,
                            bool latched) {
  const auto known = channels_.find(topic);
  if (known != channels_.end()) return known->second;
  const MessageType of = type();
  auto schema = schemas_.find(of.name);
  if (schema == schemas_.end())
    schema = schemas_.emplace(of.name, mcap_.AddSchema(of.name, "ros2msg", of.definition)).first;
  const McapWriter::Texts qos = {{"offered_qos_profiles", latched ? kLatched : ""}};
  const uint16_t channel = mcap_.AddChannel(schema->second, topic, "cdr", qos);
  channels_.emplace(topic, channel);
  return channel;
}

void LogWriter::Add(uint16_t channel, usec_t time, const Buffer& message) {
  std::memcpy(mcap_.AddMessage(channel, Nanoseconds(time), message.size()), message.data(),
              message.size());
}

}  // namespace Stg::recording
