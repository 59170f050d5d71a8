// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures the throughput of logging. Keeps twenty steps of the cave in memory, then logs them
// repeatedly: serializes scans, compresses and checksums chunks, and writes them. The result is the
// processor time of both threads together, that is, of one core.

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/log_writer.hh"
#include "recording/robots.hh"
#include "stage.hh"
#include "world/engine.hh"

namespace {

using namespace Stg;

constexpr int kSteps = 20, kRounds = 40, kRepeats = 5;

struct Scan {
  ModelRanger::Sensor sensor;  // with its readings
  std::string topic, frame;
};
using Step = std::vector<Scan>;

std::vector<Step> ScansOf(World* world) {
  std::vector<Step> steps(kSteps);
  for (Step& step : steps) {
    world->Update();
    for (const recording::Robot& robot : recording::RobotsOf(world->engine().models))
      for (const recording::ScanSource& scan : robot.scans)
        step.push_back({scan.ranger->GetSensors()[scan.sensor], scan.topic, scan.frame});
  }
  return steps;
}

struct Result {
  double seconds = 0, bytes = 0, file_bytes = 0;
};

Result Log(const std::vector<Step>& steps, recording::Compression compression,
           const std::string& file) {
  Result result;
  const std::clock_t start = std::clock();
  recording::LogWriter log(file, compression);
  std::vector<recording::ScanMaker> makers;
  std::vector<uint16_t> channels;
  for (const Scan& scan : steps[0]) {
    makers.emplace_back(scan.frame, 100000, recording::RangeConvention::kRep117);
    channels.push_back(log.Channel(scan.topic, recording::LaserScanType));
  }
  usec_t time = 0;
  for (int round = 0; round < kRounds; round++)
    for (const Step& step : steps) {
      time += 100000;
      for (size_t i = 0; i < step.size(); i++) {
        const size_t size = makers[i].Prepare(step[i].sensor);
        makers[i].Write(step[i].sensor, time,
                        log.mcap().AddMessage(channels[i], recording::Nanoseconds(time), size));
        result.bytes += static_cast<double>(size);
      }
      log.mcap().EndStep();
    }
  log.mcap().Finish();
  if (!log.mcap().problem().empty()) throw std::runtime_error(log.mcap().problem());
  result.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  result.file_bytes = static_cast<double>(log.mcap().file_size());
  return result;
}

int Main(int argc, char* argv[]) {
  Init(&argc, &argv);
  World world;
  if (!world.Load(std::string(STAGE_SOURCE_WORLDS) + "/cave.world")) return 1;
  const std::vector<Step> steps = ScansOf(&world);
  std::string file = "/tmp/stage-logging-XXXXXX";
  const int made = mkstemp(file.data());
  if (made < 0) throw std::runtime_error("can't make a file in /tmp");
  close(made);
  std::printf("compression,repeat,MB_of_messages,MB_of_file,cpu_seconds,MB_per_second\n");
  for (int repeat = 0; repeat < kRepeats; repeat++)
    for (const auto compression : {recording::Compression::kNone, recording::Compression::kLz4,
                                   recording::Compression::kZstd}) {
      if (!recording::IsAvailable(compression)) continue;
      const std::string name = recording::NameOf(compression);
      const Result r = Log(steps, compression, file);
      std::printf("%s,%d,%.1f,%.1f,%.3f,%.0f\n", name.empty() ? "none" : name.c_str(), repeat,
                  r.bytes / 1e6, r.file_bytes / 1e6, r.seconds, r.bytes / 1e6 / r.seconds);
    }
  unlink(file.c_str());
  return 0;
}

}  // namespace

int main(int argc, char* argv[]) try {
  return Main(argc, argv);
} catch (const std::exception& error) {
  std::fprintf(stderr, "logging: %s\n", error.what());
  return 1;
}
