// SPDX-License-Identifier: GPL-2.0-or-later
//
// Runs steps of branches whose robots get new commands before each call. benchmarks/python_speed.py
// compares a batch of worlds in Python with it.
//
//   rows WORLD BRANCHES STEPS THREADS SECONDS   prints the steps of all branches in a second

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

using Stg::threads::WallClock;

/// The commands of benchmarks/python_speed.py; they differ between branches.
class Driving : public Stg::Scenario {
 public:
  explicit Driving(Stg::World* world) {
    for (Stg::Model* model : world->GetChildren())
      if (auto* robot = dynamic_cast<Stg::ModelPosition*>(model)) {
        robots_.push_back(robot->GetId());
        robot->Subscribe();
        for (Stg::Model* sensor : robot->GetChildren()) sensor->Subscribe();
      }
  }
  void BeforeStep(Stg::World& world, uint32_t branch) override {
    for (uint32_t i = 0; i < robots_.size(); i++) {
      const int turn = static_cast<int>((branch * 7 + i * 3) % 11) - 5;
      static_cast<Stg::ModelPosition*>(world.FindModel(robots_[i]))->SetSpeed(0.3, 0, turn * 0.1);
    }
  }

 private:
  std::vector<uint32_t> robots_;
};

}  // namespace

int main(int argc, char* argv[]) {
  if (argc != 6) {
    std::fputs("usage: rows WORLD BRANCHES STEPS THREADS SECONDS\n", stderr);
    return 2;
  }
  Stg::Init(nullptr, nullptr);
  const uint32_t count = static_cast<uint32_t>(std::atoi(argv[2]));
  const uint64_t steps = static_cast<uint64_t>(std::atoi(argv[3]));
  const double seconds = std::atof(argv[5]);
  Stg::World world;
  if (!world.Load(argv[1])) return 1;
  Driving driving(&world);
  Stg::Snapshot start;
  if (!world.Take(&start)) return 1;
  Stg::BranchOptions options;
  options.threads = static_cast<unsigned>(std::atoi(argv[4]));
  Stg::Branches branches(world, count, options);
  for (uint32_t i = 0; i < count; i++) branches.Restore(i, start, i);
  branches.Step(20, &driving);
  uint64_t made = 0;
  const double begin = WallClock();
  double now = begin;
  for (; now - begin < seconds; now = WallClock()) {
    branches.Step(steps, &driving);
    made += steps;
  }
  std::printf("%.1f\n", static_cast<double>(made * count) / (now - begin));
}
