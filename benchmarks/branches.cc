// SPDX-License-Identifier: GPL-2.0-or-later
//
// Measures speed and size of snapshots, copies and branches, for the table of benchmarks/README.md.
//
//   branches                   a minute or two
//   branches --threads 1,2,16  numbers of threads (default: 1, and one per processor)
//   branches --branches N      number of branches (default 1000)

#include <algorithm>
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
#include "threads/wall_clock.hh"

namespace {

using Stg::threads::WallClock;

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

std::string FileOf(const std::string& name) { return STAGE_SOURCE_WORLDS "/" + name + ".world"; }

/// The shipped world with only the first robots of its file.
std::string TextOf(const std::string& name, int robots) {
  std::ifstream in(FileOf(name));
  std::string text, line;
  for (int found = 0; std::getline(in, line);)
    if (!line.starts_with("robot(") || found++ < robots) text += line + "\n";
  return text;
}

std::unique_ptr<Stg::World> Load(const std::string& name, int robots) {
  Stg::RunOptions options;
  options.listed = false;
  options.threads = 1;
  auto world = std::make_unique<Stg::World>(options);
  std::istringstream text(TextOf(name, robots));
  if (!world->Load(text, FileOf(name))) std::exit(1);
  world->SetQuitTime(0);
  return world;
}

void Run(Stg::World* world, int steps) {
  for (int i = 0; i < steps; i++) world->Update();
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

double SecondsOfBranches(const Stg::World& world, const Stg::Snapshot& now, uint32_t count,
                         unsigned threads) {
  Stg::BranchOptions options;
  options.threads = threads;
  options.keep = Stg::Snapshot::kLean;
  Stg::Branches branches(world, count, options);
  const auto run = [&](uint32_t first, uint32_t end) {
    for (uint32_t i = first; i < end; i++) branches.Restore(i, now, i + 1);
    const double start = WallClock();
    branches.Step(kBranchSteps);
    return WallClock() - start;
  };
  run(0, std::min(count, 4 * threads));  // creates the worlds of the threads
  for (uint32_t i = 0; i < count; i++) branches.Retire(i);
  return std::min(run(0, count), run(0, count));
}

void MeasureBranches(const std::string& name, uint32_t count,
                     const std::vector<unsigned>& threads) {
  constexpr int kRobots = 5;
  const std::unique_ptr<Stg::World> world = Load(name, kRobots);
  Run(world.get(), 50);
  Stg::Snapshot now;
  world->Take(&now, Stg::Snapshot::kLean);
  const double loading = Time(5, [&](int) { Run(Load(name, kRobots).get(), kBranchSteps); }).median;
  const double one = SecondsOfBranches(*world, now, count, 1);
  for (const unsigned number : threads) {
    const double seconds = number == 1 ? one : SecondsOfBranches(*world, now, count, number);
    std::printf("| %s | %u | %.1f | %.2f | %.2f | %.1f |\n", name.c_str(), number,
                seconds / count / kBranchSteps * 1e6, count * kBranchSteps / seconds / 1e6,
                one / seconds, loading * count / seconds);
  }
}

/// 30 candidates, 5 s at 10 Hz, 5 robots.
void MeasureDecision(const std::string& name, unsigned threads) {
  class Nothing : public Stg::Judge {
    bool Score(Stg::World&, size_t, double*) override { return false; }
  } judge;
  const std::unique_ptr<Stg::World> world = Load(name, 5);
  Run(world.get(), 50);
  Stg::ConsequenceEngine::Options options;
  options.threads = threads;
  Stg::ConsequenceEngine engine(*world, options);
  Stg::Question question;
  question.candidates.resize(30);
  question.horizon = 5000000;
  world->Take(&question.now, Stg::Snapshot::kLean);
  engine.Choose(question, Stg::Budget(), &judge);
  const Timing timing = Time(20, [&](int) { engine.Choose(question, Stg::Budget(), &judge); });
  std::printf("| %s | %u | %.1f | %.1f |\n", name.c_str(), threads, timing.median * 1e3,
              timing.best * 1e3);
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
  for (const char* name : {"cave", "hospital"}) MeasureBranches(name, branches, threads);
  std::puts(
      "\n| a decision: 30 candidates, 5 s, 5 robots | threads | ms, median | best |\n"
      "|---|---|---|---|");
  for (const char* name : {"cave", "hospital"})
    for (const unsigned number : threads) MeasureDecision(name, number);
  return 0;
}
