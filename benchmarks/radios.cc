// SPDX-License-Identifier: GPL-2.0-or-later
//
// radios [ROBOTS [NEIGHBOURS [THREADS]]]: the time in which robots send and hear messages.
//
// Robots of 0.1 m drive over a square so large that each has NEIGHBOURS others within the range of
// 1 m. Each sends 16 bytes in each step of 0.1 s and reads what it hears. A second of that is timed
// beside the same second without messages, with and without lines of sight. The program fails if a
// robot hears another number of messages than a count of all pairs gives.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

constexpr double kRange = 1;  // metres
constexpr int kSteps = 10;    // in a second

struct Swarm {
  std::unique_ptr<Stg::World> world;
  std::vector<Stg::ModelPosition*> robots;
  std::vector<Stg::ModelRadio*> radios;
};

Swarm Load(int robots, double neighbors, bool line_of_sight, int threads) {
  const double side = std::sqrt(robots * M_PI * kRange * kRange / neighbors);
  std::ostringstream text;
  text << "resolution 0.02\ndefine robot position( size [0.1 0.1 0.1] alwayson 1 localization "
          "\"gps\"\n"
       << "  radio( alwayson 1 range " << kRange << " line_of_sight " << line_of_sight
       << " capacity 1000 range_noise 0.05 bearing_noise 5 ) )\n";
  Stg::RandomStream random(1);
  const int columns = static_cast<int>(std::ceil(std::sqrt(robots)));
  const double gap = side / columns, jitter = std::max(0.0, gap / 2 - 0.08);
  for (int i = 0; i < robots; i++)
    text << "robot( pose [" << gap * (i % columns) + random.Uniform(-jitter, jitter) << " "
         << gap * (i / columns) + random.Uniform(-jitter, jitter) << " 0 "
         << random.Uniform(-180, 180) << "] )\n";
  Stg::RunOptions options;
  options.threads = threads;
  Swarm swarm;
  swarm.world = std::make_unique<Stg::World>(options);
  std::istringstream content(text.str());
  if (!swarm.world->Load(content, "radios.world")) std::exit(1);
  for (Stg::Model* model : swarm.world->GetChildren()) {
    auto* const robot = dynamic_cast<Stg::ModelPosition*>(model);
    if (!robot) continue;
    robot->SetSpeed(0.2, 0, random.Uniform(-0.5, 0.5));
    swarm.robots.push_back(robot);
    swarm.radios.push_back(static_cast<Stg::ModelRadio*>(robot->GetChildren()[0]));
  }
  return swarm;
}

/// Lets each robot read its messages and send one. Returns the number of messages heard.
size_t Talk(const Swarm& swarm) {
  size_t heard = 0;
  for (Stg::ModelRadio* radio : swarm.radios) {
    double near[2] = {0, static_cast<double>(radio->Received().size())};
    for (const Stg::ModelRadio::Message& message : radio->Received()) near[0] += message.range;
    heard += radio->Received().size();
    radio->Send(near, sizeof near);
  }
  return heard;
}

/// Number of pairs of different robots in range.
size_t CountPairs(const Swarm& swarm) {
  size_t count = 0;
  std::vector<Stg::Pose> poses;
  for (const Stg::ModelRadio* radio : swarm.radios) poses.push_back(radio->GetGlobalPose());
  for (const Stg::Pose& a : poses)
    for (const Stg::Pose& b : poses)
      count += (a.x - b.x) * (a.x - b.x) + (a.y - b.y) * (a.y - b.y) <= kRange * kRange;
  return count - poses.size();
}

struct Second {
  double silent, talking;  // seconds of real time
  size_t heard;
};

Second Time(const Swarm& swarm) {
  Second second{1e9, 1e9, 0};
  for (int round = 0; round < 3; round++) {
    double start = Stg::threads::WallClock();
    for (int i = 0; i < kSteps; i++) swarm.world->Update();
    second.silent = std::min(second.silent, Stg::threads::WallClock() - start);
    Talk(swarm);
    start = Stg::threads::WallClock();
    second.heard = 0;
    for (int i = 0; i < kSteps; i++) {
      swarm.world->Update();
      second.heard += Talk(swarm);
    }
    second.talking = std::min(second.talking, Stg::threads::WallClock() - start);
    swarm.world->Update();  // takes what was sent last
  }
  return second;
}

void Fail(const char* what, size_t found, size_t expected) {
  std::fprintf(stderr, "radios: found %zu %s, expected %zu\n", found, what, expected);
  std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  const int robots = argc > 1 ? std::atoi(argv[1]) : 10000;
  const double neighbors = argc > 2 ? std::atof(argv[2]) : 10;
  const int threads = argc > 3 ? std::atoi(argv[3]) : 1;
  for (const bool line_of_sight : {false, true}) {
    const Swarm swarm = Load(robots, neighbors, line_of_sight, threads);
    const size_t pairs = CountPairs(swarm);
    Talk(swarm);
    swarm.world->Update();
    const size_t heard = Talk(swarm);
    if (!line_of_sight && heard != pairs) Fail("messages", heard, pairs);
    if (line_of_sight && (heard > pairs || heard < pairs / 5))
      Fail("messages in sight", heard, pairs);
    const Second second = Time(swarm);
    std::printf(
        "%d robots, %d thread(s), %s: %.1f messages heard in each step by each robot;\n"
        "  a simulated second of %d exchanges %.3f s, without messages %.3f s\n",
        robots, threads, line_of_sight ? "line of sight" : "no line of sight",
        static_cast<double>(second.heard) / kSteps / robots, kSteps, second.talking, second.silent);
  }
  return 0;
}
