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
#include "stage/console.hh"
#include "stage/format.hh"
#include "stage/interrupt.hh"
#include "stage/process.hh"
#include "stage/report.hh"
#include "stage/run.hh"
#include "stage/status_line.hh"
#include "whatif/branches.hh"

namespace Stg::program {

namespace {

constexpr usec_t kStart = 1000000;  // default start, simulated: sensors have readings by then
constexpr uint32_t kMaxScenarios = 100000;

/// The results. Times are in seconds.
struct Budget {
  uint64_t steps = 0;  // per scenario
  unsigned threads = 1;
  uint32_t scenarios = 0;       // maximum number that fits
  bool is_lower_bound = false;  // the search ran out of time before a number did not fit
  double decision = 0;          // for that many scenarios
  double scenario = 0;          // for one scenario on one thread
  size_t row = 0, shared = 0;   // bytes per branch, and shared by all
};

class DecisionTimer {
 public:
  DecisionTimer(const World& world, const Snapshot& now, uint64_t steps, unsigned threads)
      : now_(now), steps_(steps), branches_(world, 0, OptionsWith(threads)) {}

  bool IsReady() const { return branches_.IsReady(); }
  unsigned threads() const { return branches_.threads(); }

  /// Size of a branch at its end, bytes.
  size_t RowBytes() const { return branches_.StateOf(0).size(); }
  /// Seconds for this many scenarios: the median of up to kMaxTries runs, fewer if they take long.
  double Seconds(uint32_t scenarios) {
    constexpr size_t kMaxTries = 5;
    constexpr double kMaxTime = 0.5;  // seconds after which no further run starts
    std::vector<double> seconds;
    const double start = WallClock();
    do seconds.push_back(OneTry(scenarios));
    while (seconds.size() < kMaxTries && WallClock() - start < kMaxTime);
    std::ranges::sort(seconds);
    return seconds[(seconds.size() - 1) / 2];
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

/// Searches for the maximum number of scenarios within the budget, in limited time.
class Search {
 public:
  /// A measurement takes at most about twice the budget. The whole search therefore takes about six
  /// budgets, or slightly over fifteen seconds.
  Search(double seconds, DecisionTimer* timer, Budget* budget, bool shows_progress)
      : seconds_(seconds),
        end_(WallClock() + std::max(15.0, 4 * seconds)),
        timer_(*timer),
        budget_(*budget),
        shows_progress_(shows_progress) {}

  void Go() {
    timer_.WarmUp();
    uint32_t more = 1;  // does not fit, once the loop below has ended with time left
    bool fits = true;
    while (more < kMaxScenarios && HasTime() && (fits = Fits(more))) {
      // The number that would fit at the measured rate, but at most twice the last one.
      const double guess = more * seconds_ / std::max(budget_.decision, 1e-9);
      more = std::min(2 * more, std::max(more + 1, static_cast<uint32_t>(std::min(guess, 1e9))));
    }
    while (!fits && IsWide(more) && HasTime()) {
      const uint32_t middle = budget_.scenarios + (more - budget_.scenarios) / 2;
      if (!Fits(middle)) more = middle;
    }
    budget_.is_lower_bound = fits || IsWide(more);
    line_.Erase();
  }

 private:
  /// True if the interval is wider than 1 %, because timings vary by more than that.
  bool IsWide(uint32_t more) const {
    return budget_.scenarios + budget_.scenarios / 100 + 1 < more;
  }
  bool HasTime() const { return WallClock() < end_; }
  bool Fits(uint32_t scenarios) {
    if (shows_progress_)
      line_.Print(Format(" %u scenarios fit; trying %u", budget_.scenarios, scenarios));
    const double time = timer_.Seconds(scenarios);
    if (time > seconds_) return false;
    budget_.scenarios = scenarios;
    budget_.decision = time;
    return true;
  }

  const double seconds_, end_;
  DecisionTimer& timer_;
  Budget& budget_;
  const bool shows_progress_;
  StatusLine line_;
};

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
  if (budget.scenarios == 0)
    text += "no scenario\n";
  else
    text += Count(budget.scenarios, "scenario") + (budget.is_lower_bound ? " or more" : "") +
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
          {"scenarios_are_least", budget.is_lower_bound},
          {"decision_seconds", budget.decision},
          {"scenario_seconds", budget.scenario},
          {"branch_bytes", budget.row},
          {"shared_bytes", budget.shared}};
}

/// Returns null, after a message, if the world cannot be loaded.
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
    DecisionTimer one(*world, now, budget.steps, 1);
    DecisionTimer all(*world, now, budget.steps, static_cast<unsigned>(options.run.threads));
    if (!one.IsReady() || !all.IsReady()) return 1;
    budget.threads = all.threads();
    budget.scenario = one.WarmUp();
    // Threads do not make a single scenario faster, so one that is far too long is run only once.
    const bool is_hopeless = budget.scenario > std::max(4 * seconds, 1.0);
    if (!is_hopeless) budget.scenario = one.Seconds(1);
    budget.row = one.RowBytes();
    if (!is_hopeless) Search(seconds, &all, &budget, shows).Go();
  }
  PrintUnlessReport(report, TextOf(options, *world, budget));
  if (report) report->Write(JsonOf(options, *world, budget).dump(2) + "\n");
  return 0;
}

}  // namespace Stg::program
