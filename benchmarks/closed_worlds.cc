// SPDX-License-Identifier: GPL-2.0-or-later
//
// Steps of many small closed worlds as rows, and as worlds for comparison.
//
//   closed_worlds SCENE WORLDS ROBOTS RAYS REACH CONTACTS RAY_MODEL THREADS SECONDS
//
// SCENE is open, walled or cave; CONTACTS cells or outlines; RAY_MODEL cell or exact. Prints steps
// of robots in a second, bytes of a world, and microseconds to make and to reset one. Fails if no
// ray hits anything, no robot moves, or a row has another state than the world with its commands.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <sstream>
#include <string>
#include <vector>

#include "rows/row_bridge.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"
#include "threads/worker_pool.hh"

namespace {

using Stg::threads::WallClock;

struct Arguments {
  std::string scene, contacts, ray_model;
  size_t worlds, robots, rays;
  double reach;
  unsigned threads;
  double seconds;
};

/// Octagonal robots of 0.2 m in a square, without or with walls, or in the cave.
std::string WorldText(const Arguments& a) {
  std::ostringstream text;
  text << "resolution 0.02\ncontacts \"" << a.contacts << "\"\nray_model \"" << a.ray_model
       << "\"\n";
  const auto box = [&](double x, double y, double dx, double dy) {
    text << "model( pose [" << x << " " << y << " 0 0] size [" << dx << " " << dy << " 1] )\n";
  };
  if (a.scene == "walled") {
    for (const double side : {-1.21, 1.21}) {
      box(0, side, 2.5, 0.05);
      box(side, 0, 0.05, 2.5);
    }
  }
  if (a.scene == "cave")
    text << "model( bitmap \"" STAGE_SOURCE_WORLDS "/bitmaps/cave.png\" size [32 32 0.5] )\n";
  text << "define robot position( drive \"omni\" size [0.2 0.2 0.2] block( points 8";
  for (int i = 0; i < 8; i++) {
    const double angle = (i + 0.5) * M_PI / 4;
    text << " point[" << i << "] [" << std::cos(angle) << " " << std::sin(angle) << "]";
  }
  text << " z [0 1] ) ranger( pose [0 0 -0.1 0] sensor( range [0 " << a.reach
       << "] fov 330 samples " << a.rays << " ) ) )\n";
  // Free places of the cave.
  const double cave[][2] = {{-0.47, -6.6}, {-2, -5},      {-3.1, -8.9}, {0.36, 0.33},
                            {-1.9, 3.7},   {2.06, 11.85}, {-8.4, 9.4},  {-3.6, 9.75}};
  const auto side = static_cast<size_t>(std::ceil(std::sqrt(static_cast<double>(a.robots))));
  for (size_t i = 0; i < a.robots; i++) {
    double x = 2.0 * (static_cast<double>(i % side) + 0.5) / static_cast<double>(side) - 1;
    double y = 2.0 * (static_cast<double>(i / side) + 0.5) / static_cast<double>(side) - 1;
    if (a.scene == "cave") {
      x = cave[i % 8][0] + 0.3 * static_cast<double>(i / 8 % 2);
      y = cave[i % 8][1] + 0.3 * static_cast<double>(i / 16);
    }
    text << "robot( pose [" << x << " " << y << " 0 " << 37 * i << "] )\n";
  }
  return text.str();
}

std::unique_ptr<Stg::World> Load(const std::string& text, uint64_t seed) {
  Stg::RunOptions options;
  options.seed = seed;
  options.threads = 1;
  options.listed = false;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream content(text);
  if (!world->Load(content, "many.world")) std::exit(1);
  for (Stg::Model* robot : world->GetChildren())
    if (dynamic_cast<Stg::ModelPosition*>(robot)) {
      robot->Subscribe();
      for (Stg::Model* sensor : robot->GetChildren()) sensor->Subscribe();
    }
  return world;
}

/// The command of a robot in a step: a mean that changes every 20 steps, and a deviation.
Stg::rows::Planar Command(uint64_t robot, uint64_t step) {
  const auto number = [&](uint64_t salt, uint64_t time) {
    return static_cast<double>(Stg::MixSeeds(robot * 3 + salt, time) >> 11) * 0x1p-52 - 1;
  };
  const auto axis = [&](uint64_t salt) {
    return 0.7 * number(salt, step / 20) + 0.3 * number(salt + 7, step);
  };
  return {axis(0), axis(1), axis(2)};
}

void Fail(const char* what) {
  std::fprintf(stderr, "closed_worlds: %s\n", what);
  std::exit(1);
}

/// Compares the first worlds with rows that got the same commands.
void Compare(const std::string& text, const std::shared_ptr<const Stg::rows::Scene>& scene) {
  const std::vector<uint64_t> seeds = {3, 4};
  Stg::rows::Rows rows(scene, seeds);
  const auto scratch = rows.MakeScratch();
  const size_t robots = scene->movers.size();
  const std::unique_ptr<Stg::World> written = Load(text, 1);
  for (size_t i = 0; i < seeds.size(); i++) {
    const std::unique_ptr<Stg::World> world = Load(text, seeds[i]);
    for (uint64_t step = 0; step < 100; step++) {
      for (size_t k = 0; k < robots; k++) {
        const Stg::rows::Planar command = Command(i * robots + k, step);
        rows.columns.command[i * robots + k] = command;
        auto* const model =
            static_cast<Stg::ModelPosition*>(world->FindModel(scene->movers[k].model->GetId()));
        model->SetSpeed(command.x, command.y, command.a);
      }
      world->Update();
      rows.Step(i, 1, scratch.get());
    }
    if (!Stg::RowBridge::Write(rows, i, written.get()) ||
        written->StateHash() != world->StateHash())
      Fail("a row and a world have different states");
  }
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  if (argc != 10)
    Fail("expected SCENE WORLDS ROBOTS RAYS REACH CONTACTS RAY_MODEL THREADS SECONDS");
  const Arguments a{argv[1],
                    argv[6],
                    argv[7],
                    std::strtoull(argv[2], nullptr, 10),
                    std::strtoull(argv[3], nullptr, 10),
                    std::strtoull(argv[4], nullptr, 10),
                    std::strtod(argv[5], nullptr),
                    static_cast<unsigned>(std::strtoul(argv[8], nullptr, 10)),
                    std::strtod(argv[9], nullptr)};
  const std::string text = WorldText(a);
  std::string reason;
  const auto scene = Stg::RowBridge::MakeScene(Load(text, 1), &reason);
  if (!scene) Fail(reason.c_str());
  Compare(text, scene);

  std::vector<uint64_t> seeds(a.worlds);
  std::iota(seeds.begin(), seeds.end(), uint64_t{1});
  double start = WallClock();
  Stg::rows::Rows rows(scene, seeds);
  const double made = WallClock() - start;
  Stg::threads::WorkerPool pool(a.threads);
  std::vector<std::shared_ptr<Stg::rows::Rows::Scratch>> scratches;
  for (unsigned i = 0; i < a.threads; i++) scratches.push_back(rows.MakeScratch());
  constexpr uint64_t kCommands = 64;  // different moments, which repeat
  std::vector<Stg::rows::Planar> commands(kCommands * a.worlds * a.robots);
  for (uint64_t moment = 0; moment < kCommands; moment++)
    for (size_t i = 0; i < a.worlds * a.robots; i++)
      commands[moment * a.worlds * a.robots + i] = Command(i, moment);

  uint64_t steps = 0, stalls = 0, hits = 0, rays = 0;
  double spent = 0;
  while (spent < a.seconds || steps < 8) {
    start = WallClock();
    const auto* const now = &commands[steps % kCommands * a.worlds * a.robots];
    pool.Run(a.worlds, std::max<size_t>(1, a.worlds / a.threads / 8),
             [&](size_t begin, size_t end, unsigned thread) {
               std::copy(
                   now + begin * a.robots, now + end * a.robots,
                   rows.columns.command.begin() + static_cast<std::ptrdiff_t>(begin * a.robots));
               for (size_t i = begin; i < end; i++) rows.Step(i, 1, scratches[thread].get());
             });
    spent += WallClock() - start;
    steps++;
    if (steps % 8 != 0) continue;
    for (const uint8_t stalled : rows.columns.stalled) stalls += stalled;
    for (const uint8_t brightness : rows.columns.brightness) hits += brightness > 0;
    rays += rows.columns.brightness.size();
  }
  start = WallClock();
  for (size_t i = 0; i < a.worlds; i++) rows.Reset(i, i);
  const double reset = WallClock() - start;
  if (hits == 0) Fail("no ray hits anything");
  const auto count = static_cast<double>(a.worlds * a.robots);
  std::printf(
      "%s, %zu worlds of %zu robots with %zu rays of %g m, contacts %s, rays %s, %u threads: "
      "%.3f M robot-steps/s, %.1f M rays/s; %.1f %% of the rays hit, %.1f %% of the robots "
      "stalled; "
      "%zu bytes, made in %.2f us, reset in %.2f us\n",
      a.scene.c_str(), a.worlds, a.robots, a.rays, a.reach, a.contacts.c_str(), a.ray_model.c_str(),
      a.threads, count * static_cast<double>(steps) / spent / 1e6,
      count * static_cast<double>(steps * a.rays) / spent / 1e6,
      100.0 * static_cast<double>(hits) / static_cast<double>(rays),
      100.0 * static_cast<double>(stalls) / (count * static_cast<double>(steps / 8)),
      rows.BytesPerWorld(), made * 1e6 / static_cast<double>(a.worlds),
      reset * 1e6 / static_cast<double>(a.worlds));
  return 0;
}
