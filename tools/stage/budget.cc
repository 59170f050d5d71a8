// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/budget.hh"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "insight/explain.hh"
#include "messages/report.hh"
#include "stage/format.hh"
#include "stage/interrupt.hh"
#include "stage/process.hh"
#include "stage/report.hh"
#include "stage/run.hh"
#include "whatif/branches.hh"

namespace Stg::program {

namespace {

constexpr usec_t kStart = 1000000;  // simulated, where --duration doesn't say: sensors sense then
constexpr uint32_t kMostScenarios = 100000;

/// What was measured, in seconds.
struct Budget {
  uint64_t steps = 0;  // of a scenario
  unsigned threads = 1;
  uint32_t scenarios = 0;      // that fit
  double decision = 0;         // with so many of them
  double scenario = 0;         // one of them, on one thread
  size_t row = 0, shared = 0;  // bytes
};

class Gauge {
 public:
  Gauge(const World& world, const Snapshot& now, uint64_t steps, unsigned threads)
      : now_(now), steps_(steps), branches_(world, 0, OptionsWith(threads)) {}

  bool IsReady() const { return branches_.IsReady(); }
  unsigned threads() const { return branches_.threads(); }

  /// Bytes of a branch at its end.
  size_t RowBytes() const { return branches_.StateOf(0).size(); }
  /// Seconds for so many scenarios: the median of some tries.
  double Seconds(uint32_t scenarios) {
    constexpr int kTries = 5;
    std::vector<double> seconds;
    for (int i = 0; i < kTries; i++) seconds.push_back(OneTry(scenarios));
    std::ranges::sort(seconds);
    return seconds[kTries / 2];
  }

 private:
  static BranchOptions OptionsWith(unsigned threads) {
    BranchOptions options;
    options.threads = threads;
    options.keep = Snapshot::kLean;
    return options;
  }
  double OneTry(uint32_t scenarios) {
    branches_.Resize(scenarios);
    const double start = Now();
    for (uint32_t i = 0; i < scenarios; i++) branches_.Restore(i, now_, i + 1);
    branches_.Step(steps_);
    return Now() - start;
  }

  const Snapshot& now_;
  const uint64_t steps_;
  Branches branches_;
};

/// The most scenarios that take no longer than that; their time in *decision.
uint32_t MostWithin(double seconds, Gauge* gauge, double* decision) {
  gauge->Seconds(1);  // the worlds of the threads are made
  double time = gauge->Seconds(1);
  uint32_t fit = 0, more = 1;
  while (more < kMostScenarios && time <= seconds) {
    fit = more;
    *decision = time;
    // As many as it should be, if each takes as long as these; twice as many at most.
    const double guess = fit * seconds / std::max(time, 1e-9);
    more = std::min(2 * fit, std::max(fit + 1, static_cast<uint32_t>(guess)));
    time = gauge->Seconds(more);
  }
  while (fit + 1 < more) {
    const uint32_t middle = fit + (more - fit) / 2;
    time = gauge->Seconds(middle);
    if (time <= seconds) {
      fit = middle;
      *decision = time;
    } else {
      more = middle;
    }
  }
  return fit;
}

std::string TextOf(const Options& options, const World& world, const Budget& budget) {
  const double interval = static_cast<double>(world.sim_interval) / 1e6;
  const double horizon = static_cast<double>(budget.steps) * interval;
  const SceneSummary scene = world.Summary();
  std::string text =
      options.worldfiles[0] + ": " + Count(static_cast<double>(scene.robots), "robot") + "\n";
  text += Format("a scenario: %g s, %llu steps of %g s, from the state at %g s\n", horizon,
                 static_cast<unsigned long long>(budget.steps), interval,
                 static_cast<double>(world.SimTimeNow()) / 1e6);
  text += Format("%g ms on %u thread%s: ", options.budget_ms, budget.threads,
                 budget.threads == 1 ? "" : "s");
  if (budget.scenarios == 0)
    text += "not one scenario\n";
  else
    text += Count(budget.scenarios, "scenario") +
            Format(" (they take %.3g ms)\n", budget.decision * 1e3);
  text += Format("one scenario on one thread: %.3g ms, %.0f times as fast as real time\n",
                 budget.scenario * 1e3, horizon / budget.scenario);
  text += Format("a branch takes %zu bytes, and all together %zu\n", budget.row, budget.shared);
  return text;
}

nlohmann::json JsonOf(const Options& options, const World& world, const Budget& budget) {
  return {{"world", options.worldfiles[0]},
          {"budget_seconds", options.budget_ms / 1e3},
          {"steps", budget.steps},
          {"interval_seconds", static_cast<double>(world.sim_interval) / 1e6},
          {"simulated_seconds", static_cast<double>(world.SimTimeNow()) / 1e6},
          {"threads", budget.threads},
          {"scenarios", budget.scenarios},
          {"decision_seconds", budget.decision},
          {"scenario_seconds", budget.scenario},
          {"branch_bytes", budget.row},
          {"shared_bytes", budget.shared}};
}

/// Null, with a message, if it can't be loaded.
World* LoadAndRun(const Options& options) {
  static std::vector<LoadedWorld>& worlds = *new std::vector<LoadedWorld>;
  if (LoadWorlds(options, &worlds) != 0) return nullptr;
  World* const world = worlds.front().world;
  const usec_t start = options.run.duration > 0 ? options.run.duration : kStart;
  world->SetQuitTime(0);
  while (world->SimTimeNow() < start && CaughtSignal() == 0)
    if (world->Update()) break;
  return world;
}

}  // namespace

int TellBudget(const Options& options) {
  const std::optional<ReportFile> report = OpenReport(options);
  Budget budget;
  World* world = nullptr;
  Snapshot now;
  {
    const OutputToError redirected;  // what loading and controllers say
    world = LoadAndRun(options);
    if (!world || !world->Take(&now, Snapshot::kLean)) return 1;
    const double steps =
        std::ceil(options.horizon * 1e6 / static_cast<double>(world->sim_interval));
    budget.steps = static_cast<uint64_t>(std::max(1.0, steps));
    budget.shared = now.shared_size();
    Gauge one(*world, now, budget.steps, 1);
    Gauge all(*world, now, budget.steps, static_cast<unsigned>(options.run.threads));
    if (!one.IsReady() || !all.IsReady()) return 1;
    budget.threads = all.threads();
    budget.scenario = one.Seconds(1);
    budget.row = one.RowBytes();
    budget.scenarios = MostWithin(options.budget_ms / 1e3, &all, &budget.decision);
  }
  PrintWhole(TextOf(options, *world, budget));
  if (report) report->Write(JsonOf(options, *world, budget).dump(2) + "\n");
  return 0;
}

}  // namespace Stg::program
