// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures what it costs to make a pool of one world, to add a world to it, and to reset, restore
// and save a world, by world file, for the table of benchmarks/README.md. Fails if a reset world
// differs from a newly loaded one.
//
//   pool_costs                a minute
//   pool_costs --calls N      calls per figure (default 1000)

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "stage.hh"
#include "threads/wall_clock.hh"
#include "worlds/pool_access.hh"

namespace {

using Stg::threads::WallClock;

constexpr int kStepsBetween = 5;

struct Case {
  std::string title, text, path;
};

Case ShippedWorld(const std::string& name, int robots) {
  const std::string path = STAGE_SOURCE_WORLDS "/" + name + ".world";
  std::ifstream in(path);
  std::string text, line;
  for (int found = 0; std::getline(in, line);)
    if (!line.starts_with("robot(") || found++ < robots) text += line + "\n";
  return {name + ", " + std::to_string(robots) + " robots", text, path};
}

/// Four robots of 12 rays each in a small room, typical of reinforcement learning.
Case SmallRoom() {
  return {"room, 4 robots of 12 rays",
          "resolution 0.02\n"
          "define wall model( size [4 0.1 0.5] )\n"
          "define agent position( size [0.2 0.2 0.4] drive \"diff\"\n"
          "  ranger( pose [0 0 -0.2 0] sensor( range [0 0.35] fov 360 samples 12 ) ) )\n"
          "wall( pose [0 2 0 0] ) wall( pose [0 -2 0 0] )\n"
          "wall( pose [2 0 0 90] ) wall( pose [-2 0 0 90] )\n"
          "agent( pose [-1 -1 0 0] ) agent( pose [1 -1 0 90] )\n"
          "agent( pose [-1 1 0 180] ) agent( pose [1 1 0 270] )\n",
          "room.world"};
}

/// Loads the world without its controllers, so that it can be reset.
std::unique_ptr<Stg::World> Load(const Case& of, uint64_t seed) {
  Stg::RunOptions options;
  options.listed = false;
  options.threads = 1;
  options.controllers = false;
  options.seed = seed;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream text(of.text);
  if (!world->Load(text, of.path)) std::exit(1);
  return world;
}

void Drive(const Stg::World& world) {
  for (Stg::Model* model : world.GetAllModels()) {
    model->Subscribe();
    if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) robot->SetSpeed(0.3, 0, 0.2);
  }
}

/// Durations of the calls of one kind.
class Stopwatch {
 public:
  template <typename F>
  void Time(F call) {
    const double start = WallClock();
    call();
    seconds_.push_back(WallClock() - start);
  }
  double MedianMicroseconds() {
    std::ranges::nth_element(seconds_, seconds_.begin() + std::ptrdiff_t(seconds_.size() / 2));
    return seconds_[seconds_.size() / 2] * 1e6;
  }

 private:
  std::vector<double> seconds_;
};

/// Microseconds to add a world to a pool and to make its row.
double MakeFurther(const Stg::World& prototype) {
  constexpr uint64_t kFurther = 1000;
  Stg::WorldPoolOptions options;
  options.threads = 1;
  Stg::WorldPool pool(prototype, {0}, options);
  Stg::PoolAccess::RowToChange(pool, 0);  // makes what all worlds share
  std::vector<uint64_t> seeds;
  for (uint64_t seed = 0; seed <= kFurther; seed++) seeds.push_back(seed);
  const double start = WallClock();
  pool.Resize(seeds);
  pool.Make(pool.All());
  for (const uint32_t id : pool.All())
    if (!Stg::PoolAccess::RowToChange(pool, id)) std::exit(1);
  return (WallClock() - start) * 1e6 / kFurther;
}

void Measure(const Case& of, int calls) {
  const std::unique_ptr<Stg::World> prototype = Load(of, 1);
  Stopwatch make, reset, restore, save, step;
  const double further = MakeFurther(*prototype);
  for (int i = 0; i < 20; i++)
    make.Time([&] { Stg::WorldPool(*prototype, {uint64_t(i)}).Make({0}); });
  Stg::WorldPool pool(*prototype, {1});
  Stg::Snapshot now;
  pool.Reset({0}, {1});
  for (int i = 0; i < calls; i++) {
    Drive(*pool.At(0));
    pool.Step({0}, kStepsBetween);
    save.Time([&] { pool.Take(0, &now); });
    step.Time([&] { pool.Step({0}, kStepsBetween); });
    restore.Time([&] { pool.Restore({0}, now); });
    const uint64_t seed = static_cast<uint64_t>(i);
    reset.Time([&] { pool.Reset({0}, {seed}); });
    if (i % 100 > 0 || pool.At(0)->StateHash() == Load(of, seed)->StateHash()) continue;
    std::fprintf(stderr, "%s: a reset world differs from a loaded one\n", of.title.c_str());
    std::exit(1);
  }
  if (pool.times_made(0) != 1 || !pool.Failure(0).empty()) std::exit(1);
  std::printf("| %s | %.0f | %.2f | %.1f | %.1f | %.1f | %.1f |\n", of.title.c_str(),
              make.MedianMicroseconds(), further, reset.MedianMicroseconds(),
              restore.MedianMicroseconds(), save.MedianMicroseconds(),
              step.MedianMicroseconds() / kStepsBetween);
}

}  // namespace

int main(int argc, char** argv) {
  int calls = 1000;
  if (argc == 3 && std::strcmp(argv[1], "--calls") == 0) calls = std::atoi(argv[2]);
  if (argc == 2 || argc > 3 || calls < 1) {
    std::fprintf(stderr, "pool_costs: expected --calls N\n");
    return 2;
  }
  Stg::Init(nullptr, nullptr);
  Stg::SetLogSink([](Stg::LogLevel level, const std::string& line) {
    if (level == Stg::LogLevel::kError) std::fprintf(stderr, "%s\n", line.c_str());
  });
  std::puts(
      "| world | make a pool, us | a further world, us | reset, us | restore, us | snapshot, us | "
      "step, us |\n"
      "|---|---|---|---|---|---|---|");
  for (const Case& of : {ShippedWorld("simple", 2), ShippedWorld("cave", 100),
                         ShippedWorld("hospital", 10), SmallRoom()})
    Measure(of, calls);
  return 0;
}
