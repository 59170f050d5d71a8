// SPDX-License-Identifier: GPL-2.0-or-later
//
// libFuzzer entry point: any bytes are either replayed as a log or rejected.
//
// Bytes: if the first is even, the rest is a file. Otherwise the rest are the records of a chunk
// with a correct checksum, in a file that contains a world.
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>

#include "recording/mcap_writer.hh"
#include "stage.hh"
#include "support/replay_whole.hh"

namespace {

using namespace Stg;

const char kWorld[] = R"(
resolution 0.05
position( name "r" ranger( sensor( range [0 3] fov 180 samples 3 ) sensor( samples 1 ) ) )
model( name "wall" size [0.2 4 1] pose [2 0 0 0] )
)";

std::string TemporaryFile() {
  std::string name = "/tmp/stage-log-fuzz-XXXXXX";
  const int file = mkstemp(name.data());
  if (file < 0) std::abort();
  close(file);
  return name;
}

/// Writes a log that contains the records.
void WriteAround(std::string_view records, const std::string& file) {
  unlink(file.c_str());  // may be another file from before
  recording::McapWriter log(file, recording::Compression::kNone, "ros2", "");
  log.AddMetadata("stage", {{"world", "w"}});
  log.AddAttachment("w", "", kWorld);
  const uint16_t scan = log.AddSchema("sensor_msgs/msg/LaserScan", "ros2msg", "");
  const uint16_t poses = log.AddChannel(scan, "/stage/poses", "cdr", {});
  log.AddChannel(scan, "/base_scan0", "cdr", {});
  log.AddChannel(scan, "/base_scan1", "cdr", {});
  // A first message without models, then the rest as messages of 64 bytes.
  constexpr size_t kEmpty = 4 + 8 + 8 + 6 * 4, kPart = 64;
  uint8_t* empty = log.AddMessage(poses, 0, kEmpty);
  for (size_t i = 0; i < kEmpty; i++) empty[i] = i == 1 || i == 12;
  for (size_t i = 0; !records.empty(); i++) {
    const std::string_view part = records.substr(0, kPart);
    std::copy(part.begin(), part.end(),
              log.AddMessage(static_cast<uint16_t>(i % 3), i * 100'000'000, part.size()));
    records.remove_prefix(part.size());
  }
  log.Finish();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string file = TemporaryFile();
  if (size == 0) return 0;
  const std::string_view rest(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] % 2 == 0)
    std::ofstream(file, std::ios::binary | std::ios::trunc) << rest;
  else
    WriteAround(rest, file);
  try {
    test::ReplayWhole(file);
  } catch (const std::runtime_error&) {
  }
  return 0;
}
