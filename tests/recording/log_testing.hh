// SPDX-License-Identifier: GPL-2.0-or-later
//
// Writes logs of worlds into a temporary folder and reads their messages.

#ifndef STAGE_TESTS_RECORDING_LOG_TESTING_HH
#define STAGE_TESTS_RECORDING_LOG_TESTING_HH

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "recording/cdr.hh"
#include "recording/mcap_reader.hh"
#include "recording/recorder.hh"
#include "stage.hh"
#include "support/own_worlds.hh"

namespace log_testing {

using namespace Stg;
using recording::CdrReader;
using recording::McapReader;

/// Message header: stamp and frame; numbers follow it.
struct Header {
  explicit Header(CdrReader* from) {
    seconds = from->Get<int32_t>();
    nanoseconds = from->Get<uint32_t>();
    frame = from->GetText();
  }
  uint64_t time() const { return static_cast<uint64_t>(seconds) * 1'000'000'000 + nanoseconds; }
  int32_t seconds;
  uint32_t nanoseconds;
  std::string frame;
};

struct ReadMessage {
  std::string topic, type, data;
  uint64_t time;
};

/// All messages of a log, in file order.
inline std::vector<ReadMessage> MessagesOf(const McapReader& log) {
  std::vector<ReadMessage> messages;
  recording::Buffer records;
  for (const McapReader::Chunk& chunk : log.chunks()) {
    log.Read(chunk, &records);
    recording::ForEachRecord(records.view(), [&](recording::Op op, std::string_view record) {
      if (op != recording::Op::kMessage) return;
      const recording::Message message = recording::MessageOf(record);
      const McapReader::Channel& channel = log.channels().at(message.channel);
      messages.push_back({channel.topic, channel.type, std::string(message.data), message.time});
    });
  }
  return messages;
}

inline std::string BytesOf(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

inline void WriteBytes(const std::string& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

class LogTest : public testing::Test {
 protected:
  void SetUp() override {
    if (!InitDone()) Init(nullptr, nullptr);
    std::string name = (std::filesystem::temp_directory_path() / "stage-log-XXXXXX").string();
    ASSERT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }

  /// Runs `steps` steps; calls `look` at the start and after each step.
  static void Run(
      World* world, int steps, const std::function<void()>& look = [] {}) {
    look();
    for (int i = 0; i < steps; i++) {
      world->Update();
      look();
    }
  }
  /// Logs `steps` steps of a world into `file`.
  void Log(
      World* world, int steps, const std::string& file, recording::LogOptions options = {},
      const std::function<void()>& look = [] {}) const {
    options.file = Path(file);
    recording::Recorder recorder(options);
    recorder.Attach(world);
    Run(world, steps, look);
    recorder.Finish();
  }

  std::filesystem::path folder_;
};

}  // namespace log_testing

#endif
