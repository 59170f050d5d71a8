// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures speed and size of snapshots, copies and branches, for the table of benchmarks/README.md.
//
//   branches                   a minute or two
//   branches --threads 1,2,16  numbers of threads (default: 1, and one per processor)
//   branches --branches N      number of branches (default 1000)
//
// The tables of branches and decisions have a line for each way. The plug-in disperse needs World
// objects; the built-in stage/disperse runs in rows, and reads all rangers in each step. Robots
// that obey commands are simulated in World objects, in rows with readings in each step, and in
// rows without the readings that nobody sees. Fails if robots do not move, if rays hit nothing, or
// if steps are made in another way.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "benchmarks/branch_worlds.hh"
#include "stage.hh"
#include "threads/wall_clock.hh"

namespace {

using Stg::threads::WallClock;
using namespace branch_worlds;

constexpr int kBranchSteps = 50;

/// Minimum and median duration of `calls` calls, in seconds.
struct Timing {
  double best, median;
};
template <typename F>
Timing Time(int calls, F call) {
  std::vector<double> seconds;
  for (int i = 0; i < calls; i++) {
    const double start = WallClock();
    call(i);
    seconds.push_back(WallClock() - start);
  }
  std::ranges::sort(seconds);
  return {seconds.front(), seconds[seconds.size() / 2]};
}

/// Evicts the processor's caches.
void Flush() {
  static std::vector<char> memory(size_t{64} << 20);
  for (size_t i = 0; i < memory.size(); i += 64) memory[i]++;
}

// ---- snapshots ----------------------------------------------------------------------------------

void MeasureSnapshots(const std::string& name, int robots) {
  const std::unique_ptr<Stg::World> world = Load(name, robots);
  Run(world.get(), 50);
  Stg::Snapshot full, a, b;
  world->Take(&full);
  world->Take(&a, Stg::Snapshot::kLean);
  Run(world.get(), 20);
  world->Take(&b, Stg::Snapshot::kLean);
  const Timing take = Time(2000, [&](int) { world->Take(&b, Stg::Snapshot::kLean); });
  const Timing warm = Time(2000, [&](int i) { world->Restore(i % 2 ? b : a); });
  double cold = 0;
  for (int i = 0; i < 20; i++) {
    Flush();
    cold += Time(1, [&](int) { world->Restore(i % 2 ? b : a); }).best / 20;
  }
  const Timing step = Time(200, [&](int) { world->Update(); });
  std::printf("| %s, %d robots | %.0f | %.0f | %.1f | %.1f | %.1f | %.0f |\n", name.c_str(), robots,
              static_cast<double>(b.size()) / robots, static_cast<double>(full.size()) / robots,
              take.median * 1e6, warm.median * 1e6, cold * 1e6, step.median * 1e6);
}

// ---- copies -------------------------------------------------------------------------------------

void MeasureCopies(const std::string& name, int robots) {
  const double load = Time(5, [&](int) { Load(name, robots); }).median;
  const std::unique_ptr<Stg::World> world = Load(name, robots);
  Run(world.get(), 50);
  Stg::Snapshot now;
  world->Take(&now, Stg::Snapshot::kLean);
  const double image = Time(1, [&](int) { world->Image(); }).best;
  std::vector<std::unique_ptr<Stg::World>> copies;
  const Timing copy = Time(20, [&](int) {
    copies.push_back(std::make_unique<Stg::World>(world->options()));
    copies.back()->LoadCopy(*world);
    copies.back()->Restore(now);
  });
  std::printf("| %s, %d robots | %.1f | %.1f | %.2f | %.2f |\n", name.c_str(), robots, load * 1e3,
              image * 1e3, copy.median * 1e3, copy.best * 1e3);
}

// ---- branches -----------------------------------------------------------------------------------

/// How branches are simulated.
struct Way {
  const char *name, *controller;
  bool world;                ///< a World object for each step
  Stg::Snapshot::Keep keep;  ///< kFull: readings are made in each step
};
const Way kWays[] = {{"disperse", "disperse", true, Stg::Snapshot::kLean},
                     {"stage/disperse, rows", "stage/disperse", false, Stg::Snapshot::kLean},
                     {"commands", "", true, Stg::Snapshot::kLean},
                     {"commands, rows, readings in each step", "", false, Stg::Snapshot::kFull},
                     {"commands, rows, no unseen readings", "", false, Stg::Snapshot::kLean}};

/// Sees whether any watched model moves, and ends nothing.
class Watcher : public Stg::Scenario {
 public:
  explicit Watcher(bool needs_world) : needs_world_(needs_world) {}
  bool NeedsWorld() const override { return needs_world_; }
  bool Watch(const Stg::Sighting* watched, uint32_t, double* score) override {
    *score += watched[0].pose.x;
    return false;
  }

 private:
  const bool needs_world_;
};

Stg::BranchOptions OptionsOf(const Way& way, Stg::World* world, unsigned threads) {
  Stg::BranchOptions options;
  options.threads = threads;
  options.keep = way.keep;
  options.rows = !way.world;
  for (Stg::ModelPosition* robot : RobotsOf(world)) options.watched.push_back(robot->GetId());
  return options;
}

/// Fails unless the robots of a branch have moved and, if it keeps readings, rays have hit.
void CheckBranch(const Stg::Branches& branches, const Way& way, Stg::World* world) {
  const std::vector<Stg::Sighting>& seen = branches[0].sightings;
  double moved = 0;
  for (size_t i = 0; i < kRobots; i++)
    moved += seen[i].pose.Distance(seen[seen.size() - kRobots + i].pose);
  Require(moved > (*way.controller ? 0 : 1), "the robots do not move");
  if (way.keep != Stg::Snapshot::kFull) return;
  Require(world->Restore(branches.StateOf(0)), "a branch has no state");
  size_t rays = 0, hits = 0;
  for (Stg::ModelPosition* robot : RobotsOf(world))
    for (Stg::Model* child : robot->GetChildren())
      if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(child))
        for (const auto& sensor : ranger->GetSensors()) {
          rays += sensor.ranges.size();
          for (const double range : sensor.ranges) hits += range < sensor.range.max;
        }
  Require(rays >= kRobots * 196 && hits > rays / 10, "there are no readings");
}

double SecondsOfBranches(const Way& way, Stg::World* world, const Stg::Snapshot& now,
                         uint32_t count, unsigned threads) {
  const Stg::BranchOptions options = OptionsOf(way, world, threads);
  Stg::Branches branches(*world, count, options);
  Watcher watcher(way.world);
  const auto run = [&](uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; i++) branches.Restore(i, now, i + 1);
    const double start = WallClock();
    branches.Step(kBranchSteps, &watcher);
    return WallClock() - start;
  };
  run(0, std::min(count, 4 * threads));  // creates the worlds of the threads
  for (uint32_t i = 0; i < count; i++) branches.Retire(i);
  const uint64_t before = branches.steps_in_rows();
  const double seconds = std::min(run(0, count), run(0, count));
  Require(
      branches.steps_in_rows() - before == (!way.world ? uint64_t{2} * count * kBranchSteps : 0),
      "branches are not simulated in the way that is measured");
  CheckBranch(branches, way, world);
  return seconds;
}

void MeasureBranches(const std::string& name, const Way& way, uint32_t count,
                     const std::vector<unsigned>& threads) {
  const std::unique_ptr<Stg::World> world = Prepare(name, way.controller);
  Stg::Snapshot now;
  world->Take(&now, Stg::Snapshot::kLean);
  const double loading =
      Time(5, [&](int) { Run(Load(name, kRobots, way.controller).get(), kBranchSteps); }).median;
  const double one = SecondsOfBranches(way, world.get(), now, count, 1);
  for (const unsigned number : threads) {
    const double seconds =
        number == 1 ? one : SecondsOfBranches(way, world.get(), now, count, number);
    std::printf("| %s, %s | %u | %.1f | %.2f | %.2f |", name.c_str(), way.name, number,
                seconds / count / kBranchSteps * 1e6, count * kBranchSteps / seconds / 1e6,
                one / seconds);
    // Without a controller, the sensors of newly loaded worlds do not run.
    *way.controller ? std::printf(" %.1f |\n", loading * count / seconds) : std::puts(" - |");
  }
}

/// Scores how far the first robot gets.
class Progress : public Stg::Judge {
 public:
  explicit Progress(bool needs_world) : needs_world_(needs_world) {}
  bool NeedsWorld() const override { return needs_world_; }
  bool Watch(const Stg::Sighting* watched, size_t, double* score) override {
    *score = watched[0].pose.x;
    return false;
  }

 private:
  const bool needs_world_;
};

/// 30 candidates, 5 s at 10 Hz, 5 robots. The candidates are commands to the first robot.
void MeasureDecision(const std::string& name, const Way& way, unsigned threads) {
  const std::unique_ptr<Stg::World> world = Prepare(name, way.controller);
  const Stg::BranchOptions of_branches = OptionsOf(way, world.get(), threads);
  Stg::ConsequenceEngine::Options options;
  options.threads = threads;
  options.watched = of_branches.watched;
  options.keep = way.keep;
  options.rows = !way.world;
  Stg::ConsequenceEngine engine(*world, options);
  Progress judge(way.world);
  Stg::Question question;
  question.horizon = 5000000;
  for (int i = 0; i < 30; i++)
    question.candidates.push_back({"",
                                   {{0, options.watched[0], Stg::Command::kSetSpeed,
                                     0.1 * (i / 10 + 1), 0, 0.1 * (i % 10 - 5)}}});
  world->Take(&question.now, Stg::Snapshot::kLean);
  Stg::Decision decision = engine.Choose(question, Stg::Budget(), &judge);
  const uint64_t before = engine.steps_in_rows();
  const Timing timing =
      Time(40, [&](int) { decision = engine.Choose(question, Stg::Budget(), &judge); });
  Require(engine.steps_in_rows() - before == (!way.world ? 40u * 30 * kBranchSteps : 0u),
          "decisions are not made in the way that is measured");
  Require(decision.scenario_steps == 30u * kBranchSteps && decision.complete,
          "a decision has another number of steps");
  Require(decision.outcomes[0].score != decision.outcomes[29].score, "candidates do not differ");
  std::printf("| %s, %s | %u | %.1f | %.1f |\n", name.c_str(), way.name, threads,
              timing.median * 1e3, timing.best * 1e3);
}

std::vector<unsigned> NumbersIn(const std::string& text) {
  std::vector<unsigned> numbers;
  std::istringstream in(text);
  for (std::string number; std::getline(in, number, ',');)
    numbers.push_back(static_cast<unsigned>(std::strtoul(number.c_str(), nullptr, 10)));
  const auto is_bad = [](unsigned number) { return number < 1 || number > 1000000; };
  if (numbers.empty() || std::ranges::any_of(numbers, is_bad)) {
    std::fprintf(stderr, "branches: found '%s', expected numbers such as 1,2,16\n", text.c_str());
    std::exit(2);
  }
  return numbers;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<unsigned> threads = {1, std::max(1u, std::thread::hardware_concurrency())};
  uint32_t branches = 1000;
  for (int i = 1; i < argc; i += 2) {
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    if (std::strcmp(argv[i], "--threads") == 0) {
      threads = NumbersIn(value);
    } else if (std::strcmp(argv[i], "--branches") == 0) {
      branches = NumbersIn(value)[0];
    } else {
      std::fprintf(stderr, "branches: found '%s', expected --threads N,N or --branches N\n",
                   argv[i]);
      return 2;
    }
  }
  Stg::Init(nullptr, nullptr);
  Stg::SetLogSink([](Stg::LogLevel level, const std::string& line) {
    if (level == Stg::LogLevel::kError) std::fprintf(stderr, "%s\n", line.c_str());
  });
  std::puts(
      "| snapshot | bytes per robot, lean | full | take, us | restore, us | restore with cold "
      "caches, us | step, us |\n|---|---|---|---|---|---|---|");
  for (const char* name : {"cave", "hospital"})
    for (const int robots : {5, 10}) MeasureSnapshots(name, robots);
  std::puts(
      "\n| copy | loading, ms | image, once, ms | copy and restore, ms | best |\n"
      "|---|---|---|---|---|");
  for (const char* name : {"cave", "hospital"}) MeasureCopies(name, 5);
  std::printf(
      "\n| %u branches of 5 robots, %d steps | threads | scenario step, us | million "
      "scenario steps/s | speedup over one thread | over loading and running each |\n"
      "|---|---|---|---|---|---|\n",
      branches, kBranchSteps);
  for (const char* name : {"cave", "hospital"})
    for (const Way& way : kWays) MeasureBranches(name, way, branches, threads);
  std::puts(
      "\n| a decision: 30 candidates, 5 s, 5 robots | threads | ms, median | best |\n"
      "|---|---|---|---|");
  for (const char* name : {"cave", "hospital"})
    for (const Way& way : kWays)
      for (const unsigned number : threads) MeasureDecision(name, way, number);
  return 0;
}
