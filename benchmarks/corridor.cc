// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures the benefit of planning ahead: the robot of worlds/corridor.world with and without
// what-if, from many starts. Prints the table of docs/what-if.md. All figures are simulated and
// thus equal on every machine.
//
//   corridor                100 starts, takes minutes
//   corridor --starts N     N starts
//   corridor --threads N    number of threads (default: one per processor)

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "stage.hh"

namespace {

constexpr double kLimit = 120;  // simulated seconds
constexpr double kGoalX = 8.5, kArrived = 0.5;

struct Way {
  const char* name;
  const char* controller;
};
constexpr Way kWays[] = {
    {"wander", "wander"},
    {"to the goal, without what-if", "what_if 8.5 0 go"},
    {"to the goal, with what-if", "what_if 8.5 0"},
};

struct Trip {
  bool arrived = false;
  int collisions = 0;
  double seconds = 0, stalled = 0, joules = 0;
};

std::string Text(const std::string& file, const std::string& controller) {
  std::ifstream in(file);
  std::stringstream text;
  text << in.rdbuf();
  std::string world = text.str();
  const std::string from = "\"what_if 8.5 0\"";
  const size_t place = world.find(from);
  if (place == std::string::npos) {
    std::fprintf(stderr, "corridor: %s is not the world for this benchmark\n", file.c_str());
    std::exit(1);
  }
  return world.replace(place, from.size(), "\"" + controller + "\"");
}

/// Places the robots at random, but without overlaps.
void Scatter(Stg::World* world, uint64_t seed) {
  Stg::RandomStream random(seed);
  std::vector<Stg::Pose> taken = {Stg::Pose(-8.5, 0, 0, 0)};
  for (int i = 0; i < 5; i++) {
    Stg::Pose pose;
    const auto is_near = [&](const Stg::Pose& other) {
      return std::hypot(pose.x - other.x, pose.y - other.y) < 0.8;
    };
    do {
      pose = Stg::Pose(random.Uniform(-7, 7.5), random.Uniform(-1.2, 1.2), 0,
                       random.Uniform(-M_PI, M_PI));
    } while (std::ranges::any_of(taken, is_near));
    taken.push_back(pose);
    world->GetModel("w" + std::to_string(i))->SetPose(pose);
  }
}

Trip Travel(const std::string& file, const Way& way, uint64_t seed) {
  Stg::RunOptions options;
  options.seed = seed;
  options.listed = false;
  Stg::World world(options);
  std::istringstream text(Text(file, way.controller));
  if (!world.Load(text, file)) std::exit(1);
  Scatter(&world, seed);
  const Stg::Model* const robot = world.GetModel("clever");
  Trip trip;
  bool stalled = false;
  while (!trip.arrived && trip.seconds < kLimit) {
    world.Update();
    trip.seconds = static_cast<double>(world.SimTimeNow()) / 1e6;
    const bool now = robot->Stalled();
    trip.collisions += now && !stalled;
    trip.stalled += now ? static_cast<double>(world.sim_interval) / 1e6 : 0;
    stalled = now;
    const Stg::Pose pose = robot->GetGlobalPose();
    trip.arrived = std::hypot(kGoalX - pose.x, pose.y) < kArrived;
  }
  trip.joules = robot->FindPowerPack()->GetDissipated();
  return trip;
}

double Mean(const std::vector<Trip>& trips, double (*value)(const Trip&)) {
  double sum = 0;
  for (const Trip& trip : trips) sum += value(trip);
  return trips.empty() ? 0 : sum / static_cast<double>(trips.size());
}

double MedianTime(std::vector<Trip> trips) {
  std::ranges::sort(trips, {}, &Trip::seconds);
  return trips.empty() ? 0 : trips[trips.size() / 2].seconds;
}

void Print(const Way& way, const std::vector<Trip>& all) {
  std::vector<Trip> arrived;
  std::ranges::copy_if(all, std::back_inserter(arrived), &Trip::arrived);
  const auto free = std::ranges::count(all, 0, &Trip::collisions);
  std::printf("| %s | %zu of %zu | %.2f | %ld | %.1f | %.1f | %.0f |\n", way.name, arrived.size(),
              all.size(), Mean(all, [](const Trip& t) { return 1.0 * t.collisions; }),
              static_cast<long>(free), Mean(all, [](const Trip& t) { return t.stalled; }),
              MedianTime(arrived), Mean(arrived, [](const Trip& t) { return t.joules; }));
}

unsigned long NumberAfter(int* i, int argc, char** argv) {
  const unsigned long number = *i + 1 < argc ? std::strtoul(argv[*i + 1], nullptr, 10) : 0;
  if (number == 0 || number > 100000) {
    std::fprintf(stderr, "corridor: %s: expected a number from 1 to 100000\n", argv[*i]);
    std::exit(2);
  }
  ++*i;
  return number;
}

}  // namespace

int main(int argc, char** argv) {
  unsigned long starts = 100, threads = std::max(1u, std::thread::hardware_concurrency());
  for (int i = 1; i < argc; i++) {
    if (std::strcmp(argv[i], "--starts") == 0) {
      starts = NumberAfter(&i, argc, argv);
    } else if (std::strcmp(argv[i], "--threads") == 0) {
      threads = NumberAfter(&i, argc, argv);
    } else {
      std::fprintf(stderr, "corridor: found '%s', expected --starts N or --threads N\n", argv[i]);
      return 2;
    }
  }
  Stg::Init(nullptr, nullptr);
  Stg::SetLogSink([](Stg::LogLevel level, const std::string& line) {
    if (level == Stg::LogLevel::kError) std::fprintf(stderr, "%s\n", line.c_str());
  });
  const std::string file = STAGE_SOURCE_WORLDS "/corridor.world";
  std::puts(
      "| robot | arrives | collisions | starts without collision | seconds stalled | "
      "median time to the goal, s | energy of robots that arrive, J |");
  std::puts("|---|---|---|---|---|---|---|");
  for (const Way& way : kWays) {
    std::vector<Trip> trips(starts);
    std::atomic<unsigned long> next{0};
    std::vector<std::thread> workers;
    for (unsigned long t = 0; t < threads; t++)
      workers.emplace_back([&] {
        for (unsigned long i; (i = next++) < starts;) trips[i] = Travel(file, way, i + 1);
      });
    for (std::thread& worker : workers) worker.join();
    Print(way, trips);
    std::fflush(stdout);
  }
  return 0;
}
