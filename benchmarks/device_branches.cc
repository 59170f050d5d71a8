// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures branches whose rows an OpenCL device steps, beside the host with all threads.
//
//   device_branches                     1000 branches of 5 robots of the cave, 50 steps
//   device_branches --device gpu        which device, as after --opencl=
//   device_branches --branches N        number of branches
//   device_branches --threads N         threads of the host (default: one per processor)
//   device_branches --contacts outlines (default: cells)
//
// A row of the table is a way to drive the robots and to look at them. Fails if robots do not move,
// if rays hit nothing, if steps are made elsewhere, or if a branch differs between host and device.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "benchmarks/branch_worlds.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

using namespace branch_worlds;

constexpr int kSteps = 50, kRuns = 7;

/// A controller of a client: turns away from what is near.
class TurnAway : public Stg::BatchController {
 public:
  std::shared_ptr<const Stg::ControllerParameters> Prepare(
      Stg::ControllerSetup* setup) const override {
    while (Stg::ModelRanger* const ranger = setup->FindUnusedRanger()) setup->Use(ranger);
    return nullptr;
  }
  void Step(const Stg::ControllerBatch& batch) const override {
    for (size_t world = 0; world < batch.worlds; world++)
      for (size_t r = 0; r < batch.robots; r++) Drive(batch, world, r);
  }
  size_t memory_size() const override { return 1; }

 private:
  static void Drive(const Stg::ControllerBatch& batch, size_t world, size_t r) {
    const std::vector<Stg::ControllerSensor>& sensors = batch.robot[r]->sensors;
    double left = 0, right = 0, nearest = 100;
    for (size_t s = 0; s < sensors.size(); s++) {
      const double* const ranges = batch.RangesOf(world, r, s);
      for (size_t i = 0; ranges && i < sensors[s].bearings.size(); i++) {
        nearest = std::min(nearest, ranges[i]);
        (sensors[s].bearings[i] + sensors[s].pose.a > 0 ? left : right) += ranges[i];
      }
    }
    const size_t i = world * batch.robots + r;
    double& turn = batch.memory[i];
    turn = nearest > 0.6 ? 0.7 * turn : turn != 0 ? turn : left > right ? 0.9 : -0.9;
    batch.command[i] = {nearest > 0.6 ? 0.4 : batch.stalled[i] ? -0.1 : 0.1, 0, turn};
  }
};

struct Way {
  const char *name, *controller;
  Stg::Snapshot::Keep keep;
  bool watches;
};
const Way kWays[] = {
    {"built-in stage/disperse, watched", "stage/disperse", Stg::Snapshot::kLean, true},
    {"built-in stage/disperse, end only", "stage/disperse", Stg::Snapshot::kLean, false},
    {"built-in stage/wander, watched", "stage/wander", Stg::Snapshot::kLean, true},
    {"commands, watched, readings in each step", "", Stg::Snapshot::kFull, true},
    {"commands, watched, no unseen readings", "", Stg::Snapshot::kLean, true},
    {"C++ batch controller, watched", "turn_away", Stg::Snapshot::kLean, true},
    {"C++ batch controller, end only", "turn_away", Stg::Snapshot::kLean, false}};

struct Arguments {
  std::string device, contacts = "cells";
  uint32_t branches = 1000;
  unsigned threads = std::max(1u, std::thread::hardware_concurrency());
};

class Watcher : public Stg::Scenario {
 public:
  bool NeedsWorld() const override { return false; }
  bool Watch(const Stg::Sighting* watched, uint32_t, double* score) override {
    *score += watched[0].pose.x + watched[kRobots - 1].pose.a;
    return false;
  }
};

/// Branches that are run several times.
class Runs {
 public:
  Runs(const Way& way, const Arguments& arguments, Stg::World* world, bool on_device)
      : way_(way), world_(*world) {
    Stg::BranchOptions options;
    options.threads = arguments.threads;
    options.keep = way.keep;
    options.device_steps = on_device;
    options.device_choice = arguments.device;
    for (Stg::ModelPosition* robot : RobotsOf(world))
      if (way.watches) options.watched.push_back(robot->GetId());
    branches_ = std::make_unique<Stg::Branches>(*world, arguments.branches, options);
    Require(branches_->IsReady(), "there are no branches");
    Require(branches_->WhyNotClosed().empty(), branches_->WhyNotClosed().c_str());
    world->Take(&now_, Stg::Snapshot::kLean);
  }

  const Stg::Branches& branches() const { return *branches_; }

  /// Milliseconds of each run, sorted; the first run is not counted.
  std::vector<double> Measure() {
    std::vector<double> ms;
    Run();
    const uint64_t before = branches_->steps_on_device();
    for (int i = 0; i < kRuns; i++) ms.push_back(Run() * 1e3);
    const bool on_device = branches_->WhyNotOnDevice().empty();
    Require(branches_->steps_on_device() - before ==
                (on_device ? uint64_t{kRuns} * kSteps * branches_->count() : 0),
            "steps are not made where they are measured");
    std::ranges::sort(ms);
    return ms;
  }

 private:
  double Run() {
    for (uint32_t i = 0; i < branches_->count(); i++) {
      branches_->Restore(i, now_, i + 1);
      if (*way_.controller) continue;
      const auto robots = RobotsOf(&world_);
      branches_->Give(i, Stg::Command(i % 7, robots[i % kRobots]->GetId(), Stg::Command::kSetSpeed,
                                      0.4, 0, 0.01 * (i % 100) - 0.5));
    }
    const double start = Stg::threads::WallClock();
    branches_->Step(kSteps, way_.watches ? &watcher_ : nullptr);
    return Stg::threads::WallClock() - start;
  }

  const Way& way_;
  Stg::World& world_;
  Stg::Snapshot now_;
  Watcher watcher_;
  std::unique_ptr<Stg::Branches> branches_;
};

/// Fails unless robots have moved and, if the branch has readings, rays have hit.
void CheckWork(const Stg::Branches& branches, const Way& way, Stg::World* world) {
  Stg::Snapshot now;
  world->Take(&now);
  std::vector<Stg::Pose> before;
  for (Stg::ModelPosition* robot : RobotsOf(world)) before.push_back(robot->GetGlobalPose());
  Require(world->Restore(branches.StateOf(0)), "a branch has no state");
  double moved = 0;
  size_t rays = 0, hits = 0;
  const std::vector<Stg::ModelPosition*> robots = RobotsOf(world);
  for (size_t i = 0; i < robots.size(); i++) {
    moved += robots[i]->GetGlobalPose().Distance(before[i]);
    for (Stg::Model* child : robots[i]->GetChildren())
      if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(child))
        for (const auto& sensor : ranger->GetSensors()) {
          rays += sensor.ranges.size();
          for (const double range : sensor.ranges) hits += range < sensor.range.max;
        }
  }
  Require(moved > 0.5, "the robots do not move");
  if (way.keep == Stg::Snapshot::kFull)
    Require(rays >= kRobots * 196 && hits > rays / 10, "there are no readings");
  world->Restore(now);
}

/// Fails if a branch differs.
void Compare(const Stg::Branches& host, const Stg::Branches& device) {
  for (uint32_t i = 0; i < host.count(); i++) {
    Require(host[i].steps == kSteps && device[i].steps == kSteps, "a branch lacks steps");
    Require(host[i].score == device[i].score, "the score of a branch differs");
    Require(host.StateOf(i).hash() == device.StateOf(i).hash(), "the state of a branch differs");
  }
  size_t different = 0;
  for (uint32_t i = 1; i < host.count(); i++)
    different += host.StateOf(i).hash() != host.StateOf(0).hash();
  Require(host.count() == 1 || different > 0, "all branches are equal");
}

void Measure(const Way& way, const Arguments& arguments) {
  const std::unique_ptr<Stg::World> world =
      Prepare("cave", way.controller, "contacts \"" + arguments.contacts + "\"\n");
  Runs host(way, arguments, world.get(), false), device(way, arguments, world.get(), true);
  const std::vector<double> of_host = host.Measure();
  CheckWork(host.branches(), way, world.get());
  std::printf("| %s | %.1f | %.1f |", way.name, of_host[kRuns / 2], of_host[0]);
  const std::string reason = device.branches().WhyNotOnDevice();
  if (!reason.empty()) {
    std::printf(" - | - | %s |\n", reason.c_str());
    return;
  }
  const std::vector<double> of_device = device.Measure();
  CheckWork(device.branches(), way, world.get());
  Compare(host.branches(), device.branches());
  std::printf(" %.1f | %.1f | all results equal |\n", of_device[kRuns / 2], of_device[0]);
}

Arguments Read(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; i += 2) {
    const std::string name = argv[i], value = i + 1 < argc ? argv[i + 1] : "";
    const auto number = static_cast<uint32_t>(std::strtoul(value.c_str(), nullptr, 10));
    if (name == "--device") {
      arguments.device = value;
    } else if (name == "--contacts") {
      arguments.contacts = value;
    } else if (name == "--branches" && number > 0) {
      arguments.branches = number;
    } else if (name == "--threads" && number > 0) {
      arguments.threads = number;
    } else {
      std::fprintf(stderr,
                   "device_branches: found '%s %s', expected --device NAME, --branches N, "
                   "--threads N or --contacts cells|outlines\n",
                   argv[i], value.c_str());
      std::exit(2);
    }
  }
  return arguments;
}

}  // namespace

int main(int argc, char** argv) {
  const Arguments arguments = Read(argc, argv);
  Stg::Init(nullptr, nullptr);
  Stg::SetLogSink([](Stg::LogLevel level, const std::string& line) {
    if (level != Stg::LogLevel::kProgress) std::fprintf(stderr, "%s\n", line.c_str());
  });
  static const TurnAway controller;
  Stg::RegisterBatchController("turn_away", &controller);
  std::printf(
      "%u branches of %d robots of the cave, %d steps, %u threads, contacts of %s\n\n"
      "| robots | host, ms, median | best | device, ms, median | best | |\n"
      "|---|---|---|---|---|---|\n",
      arguments.branches, kRobots, kSteps, arguments.threads, arguments.contacts.c_str());
  for (const Way& way : kWays) {
    Measure(way, arguments);
    std::fflush(stdout);
  }
  return 0;
}
