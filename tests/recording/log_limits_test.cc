// SPDX-License-Identifier: GPL-2.0-or-later
//
// Small files that claim large sizes, or unpack to them, are read with little memory and time. Long
// logs are readable and need no more memory than short ones.

#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>

#include "recording/log_testing.hh"
#include "recording/mcap_writer.hh"
#include "recording/ros_messages.hh"
#include "support/patience.hh"
#include "support/replay_whole.hh"
#include "support/sanitized.hh"

namespace log_testing {

namespace {

using recording::Buffer;
using recording::Compression;
using recording::McapWriter;
using recording::Op;

constexpr size_t kSmall = 240'000;     // bytes, size of a file
constexpr double kMaxMegabytes = 300;  // limit for reading it; used to be 2000
constexpr double kMaxSeconds = 30;

const char kWorld[] =
    "resolution 0.05\nposition( name \"r\" ranger( sensor( range [0 3] samples 3 ) ) )\n";

/// Peak memory (megabytes) and time (seconds) of a process that calls f().
template <typename F>
std::pair<double, double> CostOf(F f) {
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = fork();
  if (child == 0) {
    f();
    _exit(0);
  }
  int status = 0;
  rusage usage = {};
  wait4(child, &status, 0, &usage);
  EXPECT_TRUE(WIFEXITED(status)) << "it was killed";
  return {static_cast<double>(usage.ru_maxrss) / 1024,
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count()};
}

/// Replays the whole log, ignoring errors.
void ReplayOrRefuse(const std::string& file) {
  try {
    test::ReplayWhole(file);
  } catch (const std::runtime_error&) {
  }
}

/// Messages for the test log.
struct Bomb {
  std::string name;
  size_t message;  // bytes of each message
  bool poses;      // well-formed poses of as many models as fit
};

class LogLimitsTest : public LogTest {
 protected:
  static Buffer PosesOf(size_t models) {
    std::vector<recording::ModelPose> poses(models);
    Buffer message;
    recording::PutModelPoses(poses, 0, &message);
    return message;
  }
  void StartLog(McapWriter* log) const {
    log->AddMetadata("stage", {{"world", "w"}});
    log->AddAttachment("w", "", kWorld);
  }
  /// Writes 300 megabytes of messages, most of which compress very well.
  void WriteBomb(const Bomb& bomb, Compression compression) const {
    std::filesystem::remove(Path("bomb.mcap"));
    const Buffer poses = PosesOf(bomb.poses ? bomb.message / 40 : 2);
    McapWriter log(Path("bomb.mcap"), compression, "ros2", "");
    StartLog(&log);
    const uint16_t schema = log.AddSchema("sensor_msgs/msg/LaserScan", "ros2msg", "");
    const uint16_t channel = log.AddChannel(schema, "/stage/poses", "cdr", {});
    const auto add = [&](const Buffer& message, size_t size) {
      uint8_t* const to = log.AddMessage(channel, 0, size);
      std::memset(to, 0, size);
      std::memcpy(to, message.data(), std::min(size, message.size()));
    };
    add(poses, poses.size());
    for (size_t written = 0; written < 300'000'000; written += bomb.message)
      add(poses, bomb.poses ? poses.size() : bomb.message);
    log.Finish();
  }
  void ExpectCheap(const std::string& file) const {
    const auto [megabytes, seconds] = CostOf([&] { ReplayOrRefuse(file); });
    std::printf("%8.1f kB: %6.1f MB, %5.2f s\n",
                static_cast<double>(std::filesystem::file_size(file)) / 1e3, megabytes, seconds);
    if (kSanitized) return;
    EXPECT_LT(megabytes, kMaxMegabytes);
    if (!kOptimized) return;
    EXPECT_LT(seconds, kMaxSeconds * patience::Slowness());
  }
};

TEST_F(LogLimitsTest, PackedMessagesTakeLittleMemory) {
  for (const Compression compression : {Compression::kLz4, Compression::kZstd}) {
    if (!recording::IsAvailable(compression)) continue;
    for (const Bomb& bomb : std::vector<Bomb>{{"short messages", 24, false},
                                              {"long messages", 1 << 20, false},
                                              {"the longest messages", 59 << 20, false},
                                              {"poses of two models", 200, true},
                                              {"poses of a million models", 40'000'000, true}}) {
      SCOPED_TRACE(bomb.name + " " + recording::NameOf(compression));
      WriteBomb(bomb, compression);
      ExpectCheap(Path("bomb.mcap"));
    }
  }
}

TEST_F(LogLimitsTest, MessagesThatCouldNotBeReadAreNotWritten) {
  McapWriter log(Path("a.mcap"), Compression::kNone, "ros2", "");
  const uint16_t channel = log.AddChannel(log.AddSchema("s", "ros2msg", ""), "/large", "cdr", {});
  EXPECT_THROW(log.AddMessage(channel, 0, recording::kMaxMessageBytes + 1), std::runtime_error);
  log.AddMessage(channel, 0, 10);
  std::memset(log.AddMessage(channel, 0, recording::kMaxMessageBytes), 1,
              recording::kMaxMessageBytes);
  log.Finish();
  const McapReader reader(Path("a.mcap"));
  Buffer records;
  for (const McapReader::Chunk& chunk : reader.chunks()) reader.Read(chunk, &records);
  EXPECT_GT(records.size(), recording::kMaxMessageBytes);
}

/// A file with a world and records of other kinds.
class ClaimTest : public LogLimitsTest {
 protected:
  void Begin() {
    std::filesystem::remove(Path("claim.mcap"));
    {
      McapWriter log(Path("claim.mcap"), Compression::kNone, "ros2", "");
      StartLog(&log);
      const uint16_t schema = log.AddSchema("x", "ros2msg", "");
      const Buffer poses = PosesOf(2);
      std::memcpy(
          log.AddMessage(log.AddChannel(schema, "/stage/poses", "cdr", {}), 0, poses.size()),
          poses.data(), poses.size());
      log.Finish();
    }
    // Up to the end of the data.
    std::string bytes = BytesOf(Path("claim.mcap"));
    const McapReader log(Path("claim.mcap"));
    bytes.resize(static_cast<size_t>(log.chunks()[0].offset + log.chunks()[0].length));
    bytes_.Clear();
    bytes_.PutBytes(bytes.data(), bytes.size());
  }
  void Put(Op op, const Buffer& fields) {
    bytes_.Put(static_cast<uint8_t>(op));
    bytes_.Put(uint64_t{fields.size()});
    bytes_.PutBytes(fields.data(), fields.size());
  }
  void PutChunk(uint64_t claimed, const std::string& compression, const std::string& packed) {
    Buffer fields;
    fields.Put(uint64_t{0});
    fields.Put(uint64_t{0});
    fields.Put(claimed);
    fields.Put(uint32_t{0});
    fields.PutText(compression);
    fields.Put(uint64_t{packed.size()});
    fields.PutBytes(packed.data(), packed.size());
    Put(Op::kChunk, fields);
  }
  void ExpectFileCheap() {
    ASSERT_LT(bytes_.size(), kSmall + 10'000);
    WriteBytes(Path("claim.mcap"), std::string(bytes_.view()));
    ExpectCheap(Path("claim.mcap"));
  }

  Buffer bytes_;
};

TEST_F(ClaimTest, ClaimedSizesOfChunksTakeNoMemory) {
  for (const char* compression : {"", "lz4", "zstd", "none such"})
    for (const uint64_t claimed :
         {uint64_t{1} << 20, recording::kMaxChunkBytes, recording::kMaxChunkBytes + 1,
          uint64_t{1} << 30, uint64_t{1} << 40, ~uint64_t{0}}) {
      SCOPED_TRACE(std::string(compression) + " " + std::to_string(claimed));
      Begin();
      for (int i = 0; i < 20; i++) PutChunk(claimed, compression, std::string(10'000, '\0'));
      ExpectFileCheap();
    }
}

TEST_F(ClaimTest, ManyRecordsTakeLittleMemory) {
  Buffer name, metadata, index;
  name.Put(uint16_t{1});
  name.PutText("n");
  metadata.PutText("m");
  metadata.PutText("");
  for (const Op op : {Op::kSchema, Op::kChannel, Op::kMetadata, Op::kChunkIndex, Op::kMessageIndex,
                      Op::kAttachmentIndex, Op::kStatistics}) {
    SCOPED_TRACE(static_cast<int>(op));
    Begin();
    while (bytes_.size() < kSmall) Put(op, op == Op::kMetadata ? metadata : name);
    ExpectFileCheap();
  }
  Begin();
  while (bytes_.size() < kSmall) PutChunk(0, "", "");
  ExpectFileCheap();
}

TEST_F(ClaimTest, LengthsBeyondTheFileEndIt) {
  for (const uint64_t length :
       {uint64_t{1} << 20, uint64_t{1} << 40, ~uint64_t{0}, ~uint64_t{0} - 8})
    for (const Op op : {Op::kChunk, Op::kAttachment, Op::kMetadata, Op::kSchema}) {
      Begin();
      bytes_.Put(static_cast<uint8_t>(op));
      bytes_.Put(length);
      ExpectFileCheap();
      EXPECT_TRUE(McapReader(Path("claim.mcap")).ends_early());
    }
}

TEST_F(LogLimitsTest, OpeningALongLogUnpacksNothing) {
  const auto write = [&](const std::string& name, int messages) {
    McapWriter log(Path(name), recording::DefaultCompression(), "ros2", "");
    StartLog(&log);
    const uint16_t schema = log.AddSchema("s", "ros2msg", "");
    const uint16_t channel = log.AddChannel(schema, "/stage/poses", "cdr", {});
    for (int i = 0; i < messages; i++) {
      uint8_t* const to = log.AddMessage(channel, static_cast<uint64_t>(i), 1 << 20);
      for (size_t k = 0; k < 1 << 20; k++) to[k] = static_cast<uint8_t>(k * k >> 3);
    }
    log.Finish();
  };
  write("long.mcap", 150);
  // Damage to a chunk in the middle goes unnoticed unless that chunk is read.
  const McapReader whole(Path("long.mcap"));
  EXPECT_EQ(whole.chunks().size(), 150u);
  std::string bytes = BytesOf(Path("long.mcap"));
  const McapReader::Chunk damaged = whole.chunks()[75];
  for (size_t i = 30; i < damaged.length; i++) bytes[static_cast<size_t>(damaged.offset) + i] ^= 1;
  WriteBytes(Path("damaged.mcap"), bytes);
  const McapReader log(Path("damaged.mcap"));
  EXPECT_EQ(log.chunks().size(), 150u);
  EXPECT_EQ(log.channels().size(), 1u);
  Buffer records;
  for (size_t i = 0; i < 150; i++)
    if (i == 75)
      EXPECT_THROW(log.Read(log.chunks()[i], &records), std::runtime_error);
    else
      log.Read(log.chunks()[i], &records);
}

}  // namespace

}  // namespace log_testing
