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
#include "models/model.hh"
#include "stage/budget_search.hh"
#include "stage/console.hh"
#include "stage/decision_budget.hh"
#include "stage/format.hh"
#include "stage/interrupt.hh"
#include "stage/process.hh"
#include "stage/report.hh"
#include "stage/run.hh"
#include "whatif/branches.hh"

namespace Stg::program {

namespace {

constexpr usec_t kStart = 1000000;  // default start, simulated: sensors have readings by then
constexpr uint32_t kMaxScenarios = 100000;

/// The results. Times are in seconds.
struct Budget {
  uint64_t steps = 0;  // per scenario
  unsigned threads = 1;
  Fit scenarios;        // that fit
  double scenario = 0;  // for one scenario on one thread
  DecisionBudget decisions;
  size_t row = 0, shared = 0;  // bytes per branch, and shared by all
};

class ScenarioTimer {
 public:
  ScenarioTimer(const World& world, const Snapshot& now, uint64_t steps, unsigned threads)
      : now_(now), steps_(steps), branches_(world, 0, OptionsWith(threads)) {}

  bool IsReady() const { return branches_.IsReady(); }
  unsigned threads() const { return branches_.threads(); }

  /// Size of a branch at its end, bytes.
  size_t RowBytes() const { return branches_.StateOf(0).size(); }
  double Seconds(uint32_t scenarios) {
    return MedianSeconds([&] { return OneTry(scenarios); });
  }
  /// Creates the threads' worlds. Returns the time of one scenario including that.
  double WarmUp() { return OneTry(1); }

 private:
  static BranchOptions OptionsWith(unsigned threads) {
    BranchOptions options;
    options.threads = threads;
    options.keep = Snapshot::kLean;
    return options;
  }
  double OneTry(uint32_t scenarios) {
    branches_.Resize(scenarios);
    const double start = WallClock();
    for (uint32_t i = 0; i < scenarios; i++) branches_.Restore(i, now_, i + 1);
    branches_.Step(steps_);
    return WallClock() - start;
  }

  const Snapshot& now_;
  const uint64_t steps_;
  Branches branches_;
};

std::string TextOf(const DecisionBudget& decisions, const Options& options, double horizon) {
  const Fit& samples = decisions.samples;
  std::string text =
      Format("a decision of %u candidates x %u samples x %g s: ", DecisionBudget::kCandidates,
             DecisionBudget::kSamples, horizon) +
      (decisions.is_estimate ? "about " : "") + Rounded(decisions.seconds * 1e3) +
      Format(" ms, with %.1f MB of memory for the process\n", decisions.memory_mb) +
      Format("a decision of %u candidates in %g ms: ", DecisionBudget::kCandidates,
             options.budget_ms) +
      (samples.count == 0 ? "not one sample of each fits"
                          : Count(samples.count, "sample") + " of each" +
                                (samples.is_lower_bound ? " or more" : "")) +
      "\n";
  text += decisions.robot.empty()
              ? "  the candidates give no commands, because no robot would obey them "
                "(--no-controllers leaves out what drives them)\n"
              : "  the candidates are velocities of " + messages::Quoted(decisions.robot) +
                    "; no sample ends early\n";
  if (!decisions.why_slow.empty())
    text += "  the samples need objects, because " + decisions.why_slow + "\n";
  return text;
}

std::string TextOf(const Options& options, const World& world, const Budget& budget) {
  const double interval = static_cast<double>(world.sim_interval) / 1e6;
  const double horizon = static_cast<double>(budget.steps) * interval;
  const SceneSummary scene = Summarize(world);
  std::string text =
      options.worldfiles[0] + ": " + Count(static_cast<double>(scene.robots), "robot") + "\n";
  text += Format("a scenario: %g s, %llu steps of %g s, from the state at %g s\n", horizon,
                 static_cast<unsigned long long>(budget.steps), interval,
                 static_cast<double>(world.SimTimeNow()) / 1e6);
  text += Format("%g ms on %u thread%s: ", options.budget_ms, budget.threads,
                 budget.threads == 1 ? "" : "s");
  if (budget.scenarios.count == 0)
    text += "no scenario\n";
  else
    text += Count(budget.scenarios.count, "scenario") +
            (budget.scenarios.is_lower_bound ? " or more" : "") +
            Format(" (they take %.3g ms)\n", budget.scenarios.seconds * 1e3);
  text += Format("one scenario on one thread: %.3g ms, %.0f times as fast as real time\n",
                 budget.scenario * 1e3, horizon / budget.scenario);
  text += TextOf(budget.decisions, options, horizon);
  text += Format("a branch takes %zu bytes, and all together %zu\n", budget.row, budget.shared);
  return text;
}

nlohmann::ordered_json JsonOf(const DecisionBudget& decisions) {
  return {{"candidates", DecisionBudget::kCandidates},
          {"samples", DecisionBudget::kSamples},
          {"seconds", decisions.seconds},
          {"is_estimate", decisions.is_estimate},
          {"memory_mb", decisions.memory_mb},
          {"samples_that_fit", decisions.samples.count},
          {"samples_are_least", decisions.samples.is_lower_bound},
          {"robot", decisions.robot},
          {"why_no_robot", decisions.why_no_robot},
          {"why_not_closed", decisions.why_slow}};
}

nlohmann::ordered_json JsonOf(const Options& options, const World& world, const Budget& budget) {
  return {{"program", "stage"},
          {"world", options.worldfiles[0]},
          {"budget_seconds", options.budget_ms / 1e3},
          {"steps", budget.steps},
          {"interval_seconds", static_cast<double>(world.sim_interval) / 1e6},
          {"simulated_seconds", static_cast<double>(world.SimTimeNow()) / 1e6},
          {"threads", budget.threads},
          {"scenarios", budget.scenarios.count},
          {"scenarios_are_least", budget.scenarios.is_lower_bound},
          {"decision_seconds", budget.scenarios.seconds},
          {"scenario_seconds", budget.scenario},
          {"decision", JsonOf(budget.decisions)},
          {"branch_bytes", budget.row},
          {"shared_bytes", budget.shared}};
}

/// A robot that decides from a belief usually has no subscribers in its world file.
void SubscribeToFirstRobot(World* world) {
  const std::vector<Model*> robots = RobotsOf(*world);
  if (!robots.empty() && !robots[0]->HasSubscribers()) robots[0]->Subscribe();
}

/// Returns null, after a message, if the world cannot be loaded.
World* LoadAndRun(const Options& options) {
  static std::vector<LoadedWorld>& worlds = *new std::vector<LoadedWorld>;
  if (LoadWorlds(options, &worlds) != 0) return nullptr;
  World* const world = worlds.front().world;
  const usec_t start = options.run.duration > 0 ? options.run.duration : kStart;
  world->SetQuitTime(0);
  SubscribeToFirstRobot(world);
  while (world->SimTimeNow() < start && CaughtSignal() == 0)
    if (world->Update()) break;
  return world;
}

}  // namespace

int PrintBudget(const Options& options) {
  const std::optional<ReportFile> report = OpenReport(options);
  Budget budget;
  World* world = nullptr;
  Snapshot now;
  {
    const OutputToError redirected;  // messages of loading and of controllers
    world = LoadAndRun(options);
    if (!world || !world->Take(&now, Snapshot::kLean)) return 1;
    const double steps =
        std::ceil(options.horizon * 1e6 / static_cast<double>(world->sim_interval));
    budget.steps = static_cast<uint64_t>(std::max(1.0, steps));
    budget.shared = now.shared_size();
    const double seconds = options.budget_ms / 1e3;
    const bool shows = ShowsAll();
    PrintProgress("measuring what a scenario takes");
    ScenarioTimer one(*world, now, budget.steps, 1);
    ScenarioTimer all(*world, now, budget.steps, static_cast<unsigned>(options.run.threads));
    if (!one.IsReady() || !all.IsReady()) return 1;
    budget.threads = all.threads();
    budget.scenario = one.WarmUp();
    // Threads do not make a single scenario faster, so one that is far too long is run only once.
    const bool is_hopeless = budget.scenario > std::max(4 * seconds, 1.0);
    if (!is_hopeless) budget.scenario = one.Seconds(1);
    budget.row = one.RowBytes();
    PrintProgress("measuring what a decision takes");
    budget.decisions = MeasureDecisions(
        *world, now, {budget.steps, seconds, budget.scenario, budget.threads, shows});
    if (!is_hopeless) {
      all.WarmUp();
      budget.scenarios = SearchFit(
          seconds, [&](uint32_t scenarios) { return all.Seconds(scenarios); }, "scenarios", shows);
    }
  }
  PrintUnlessReport(report, TextOf(options, *world, budget));
  if (report) report->Write(JsonOf(options, *world, budget).dump(2) + "\n");
  return 0;
}

}  // namespace Stg::program
