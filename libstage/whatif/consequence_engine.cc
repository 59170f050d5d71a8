// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/consequence_engine.hh"

#include <algorithm>
#include <limits>

#include "threads/wall_clock.hh"
#include "world/world.hh"

namespace Stg {

bool Judge::NeedsWorld() const { return true; }
void Judge::Begin(World&, size_t) {}
bool Judge::Score(World&, size_t, double*) { return false; }
bool Judge::Watch(const Sighting*, size_t, double*) { return false; }

Bounds Judge::Outlook(uint64_t) const {
  const double any = std::numeric_limits<double>::infinity();
  return Bounds(-any, any);
}

namespace {

BranchOptions OptionsOfBranches(const ConsequenceEngine::Options& options) {
  BranchOptions branches;
  branches.threads = options.threads;
  branches.keep = options.keep;
  branches.watched = options.watched;
  branches.rows = options.rows;
  branches.device_steps = options.device_steps;
  branches.device_choice = options.device_choice;
  return branches;
}

/// Measures seconds and joules spent since its construction.
class Meter {
 public:
  explicit Meter(const Budget& budget)
      : budget_(budget),
        start_(threads::WallClock()),
        joules_before_(budget.meter ? budget.meter() : 0) {}

  double seconds() const { return threads::WallClock() - start_; }
  double joules() const {
    return budget_.meter ? budget_.meter() - joules_before_ : seconds() * budget_.watts;
  }

 private:
  const Budget& budget_;
  const double start_, joules_before_;
};

/// Predicts from the cost of the last round whether the remaining budget allows the next one.
class Allowance {
 public:
  Allowance(const Budget& budget, const Meter& meter) : budget_(budget), meter_(meter) {}

  bool Suffices(uint64_t done, uint64_t next) {
    const double seconds = meter_.seconds(), joules = meter_.joules();
    const double ratio = last_ > 0 ? static_cast<double>(next) / static_cast<double>(last_) : 0;
    const bool suffices =
        done == 0 || (Fits(budget_.seconds, seconds, (seconds - seconds_before_) * ratio) &&
                      Fits(budget_.joules, joules, (joules - joules_before_) * ratio) &&
                      (budget_.scenario_steps == 0 || done + next <= budget_.scenario_steps));
    seconds_before_ = seconds;
    joules_before_ = joules;
    last_ = next;
    return suffices;
  }

 private:
  static bool Fits(double limit, double spent, double next) {
    return !(limit > 0) || spent + next <= limit;
  }

  const Budget& budget_;
  const Meter& meter_;
  double seconds_before_ = 0, joules_before_ = 0;
  uint64_t last_ = 0;  // scenario steps of the last round
};

}  // namespace

struct ConsequenceEngine::Impl {
  /// Forwards the callbacks of a branch to the judge of its candidate.
  struct Watcher : Scenario {
    Judge* judge = nullptr;
    uint32_t samples = 1;
    const Branches* branches = nullptr;

    bool NeedsWorld() const override { return judge->NeedsWorld(); }
    void BeforeStep(World& world, uint32_t branch) override {
      if ((*branches)[branch].steps == 0) judge->Begin(world, branch / samples);
    }
    bool AfterStep(World& world, uint32_t branch, double* score) override {
      return judge->Score(world, branch / samples, score);
    }
    bool Watch(const Sighting* watched, uint32_t branch, double* score) override {
      return judge->Watch(watched, branch / samples, score);
    }
  };

  Impl(const World& prototype, const Options& wanted)
      : options(wanted),
        branch_options(OptionsOfBranches(wanted)),
        interval(std::max<usec_t>(1, prototype.sim_interval)),
        samples(std::max(1u, wanted.samples)),
        branches(std::make_unique<Branches>(prototype, 0, branch_options)) {}

  void Begin(const Question& question);
  uint64_t CountAlive() const;
  uint64_t CountSteps() const;
  void Summarize(const Question& question, Decision* decision) const;
  Outcome OutcomeOf(size_t candidate) const;
  Bounds ReachOf(size_t candidate, uint64_t steps_left) const;
  void DropDominated(size_t candidates, uint64_t steps_left);
  uint32_t NumberOf(size_t candidate, uint32_t sample) const {
    return static_cast<uint32_t>(candidate) * samples + sample;
  }
  const Branch& SampleOf(size_t candidate, uint32_t sample) const {
    return (*branches)[NumberOf(candidate, sample)];
  }
  bool AnySampleIs(Branch::State state, size_t candidate) const;
  Decision Decide(const Question& question, Judge* judge, const Meter& meter,
                  const std::function<bool(uint64_t done, uint64_t next, uint64_t rounds)>& go_on);

  const Options options;
  const BranchOptions branch_options;
  const usec_t interval;
  const uint32_t samples;
  std::unique_ptr<Branches> branches;
  Watcher watcher;
  std::vector<bool> dominated;
};

void ConsequenceEngine::Impl::Begin(const Question& question) {
  branches->Resize(static_cast<uint32_t>(question.candidates.size()) * samples);
  dominated.assign(question.candidates.size(), false);
  for (uint32_t branch = 0; branch < branches->count(); branch++) {
    const uint32_t sample = branch % samples;
    if (question.seed == 0 && sample == 0)
      branches->Restore(branch, question.now);
    else
      branches->Restore(branch, question.now, question.seed + sample);
    for (const Command& command : question.candidates[branch / samples].commands)
      branches->Give(branch, command);
  }
  watcher.samples = samples;
  watcher.branches = branches.get();
}

uint64_t ConsequenceEngine::Impl::CountSteps() const {
  uint64_t steps = 0;
  for (uint32_t branch = 0; branch < branches->count(); branch++)
    steps += (*branches)[branch].steps;
  return steps;
}

uint64_t ConsequenceEngine::Impl::CountAlive() const {
  uint64_t alive = 0;
  for (uint32_t branch = 0; branch < branches->count(); branch++)
    alive += (*branches)[branch].state == Branch::kAlive;
  return alive;
}

bool ConsequenceEngine::Impl::AnySampleIs(Branch::State state, size_t candidate) const {
  for (uint32_t sample = 0; sample < samples; sample++)
    if (SampleOf(candidate, sample).state == state) return true;
  return false;
}

Outcome ConsequenceEngine::Impl::OutcomeOf(size_t candidate) const {
  Outcome outcome;
  for (uint32_t sample = 0; sample < samples; sample++) {
    const Branch& branch = SampleOf(candidate, sample);
    outcome.score += branch.score / samples;
    outcome.steps = std::max(outcome.steps, branch.steps);
    if (sample == 0) outcome.sightings = branch.sightings;
    if (branch.state == Branch::kFailed) outcome.error = branch.error;
  }
  outcome.dominated = dominated[candidate];
  outcome.ended = !AnySampleIs(Branch::kAlive, candidate) && !outcome.dominated;
  return outcome;
}

/// Bounds of the candidate's final score, with `steps_left` steps remaining.
Bounds ConsequenceEngine::Impl::ReachOf(size_t candidate, uint64_t steps_left) const {
  const Bounds outlook = watcher.judge->Outlook(steps_left);
  Bounds reach(0, 0);
  for (uint32_t sample = 0; sample < samples; sample++) {
    const Branch& branch = SampleOf(candidate, sample);
    const bool goes_on = branch.state == Branch::kAlive && steps_left > 0;
    reach.min += (branch.score + (goes_on ? outlook.min : 0)) / samples;
    reach.max += (branch.score + (goes_on ? outlook.max : 0)) / samples;
  }
  return reach;
}

/// Retires candidates that can no longer beat the best one.
void ConsequenceEngine::Impl::DropDominated(size_t candidates, uint64_t steps_left) {
  double best = -std::numeric_limits<double>::infinity();
  for (size_t candidate = 0; candidate < candidates; candidate++)
    if (!dominated[candidate] && !AnySampleIs(Branch::kFailed, candidate))
      best = std::max(best, ReachOf(candidate, steps_left).min);
  for (size_t candidate = 0; candidate < candidates; candidate++) {
    if (!AnySampleIs(Branch::kAlive, candidate) || !(ReachOf(candidate, steps_left).max < best))
      continue;
    dominated[candidate] = true;
    for (uint32_t sample = 0; sample < samples; sample++)
      branches->Retire(NumberOf(candidate, sample));
  }
}

void ConsequenceEngine::Impl::Summarize(const Question& question, Decision* decision) const {
  bool found = false;
  for (size_t candidate = 0; candidate < question.candidates.size(); candidate++) {
    decision->outcomes.push_back(OutcomeOf(candidate));
    const Outcome& outcome = decision->outcomes.back();
    if (!outcome.error.empty() || outcome.dominated) continue;
    if (found && !(outcome.score > decision->outcomes[decision->best].score)) continue;
    decision->best = candidate;
    found = true;
  }
}

/// Calls go_on(scenario steps done, those of the next round, rounds done) before each round.
Decision ConsequenceEngine::Impl::Decide(
    const Question& question, Judge* judge, const Meter& meter,
    const std::function<bool(uint64_t, uint64_t, uint64_t)>& go_on) {
  Decision decision;
  watcher.judge = judge;
  Begin(question);
  const uint64_t all_steps = question.horizon / interval;
  for (;;) {
    const uint64_t left = all_steps - decision.steps;
    const uint64_t alive = CountAlive(),
                   steps = std::min(std::max<uint64_t>(1, options.round), left);
    decision.complete = alive == 0 || left == 0;
    if (decision.complete || !go_on(decision.scenario_steps, alive * steps, decision.rounds)) break;
    branches->Step(steps, &watcher);
    decision.rounds++;
    decision.steps += steps;
    decision.scenario_steps = CountSteps();
    DropDominated(question.candidates.size(), left - steps);
  }
  Summarize(question, &decision);
  decision.seconds = meter.seconds();
  decision.joules = meter.joules();
  return decision;
}

ConsequenceEngine::ConsequenceEngine(const World& prototype, const Options& options)
    : impl_(new Impl(prototype, options)) {}

ConsequenceEngine::~ConsequenceEngine() = default;

bool ConsequenceEngine::IsReady() const { return impl_->branches->IsReady(); }

std::string ConsequenceEngine::WhyNotClosed() const { return impl_->branches->WhyNotClosed(); }

uint64_t ConsequenceEngine::steps_in_rows() const { return impl_->branches->steps_in_rows(); }

std::string ConsequenceEngine::StepDevice() const { return impl_->branches->StepDevice(); }

std::string ConsequenceEngine::WhyNotOnDevice() const { return impl_->branches->WhyNotOnDevice(); }

uint64_t ConsequenceEngine::steps_on_device() const { return impl_->branches->steps_on_device(); }

Decision ConsequenceEngine::Choose(const Question& question, const Budget& budget, Judge* judge) {
  const Meter meter(budget);
  Allowance allowance(budget, meter);
  return impl_->Decide(question, judge, meter, [&](uint64_t done, uint64_t next, uint64_t) {
    return allowance.Suffices(done, next);
  });
}

Decision ConsequenceEngine::Replay(const Question& question, const Decision& decision,
                                   Judge* judge) {
  const Budget none;
  const Meter meter(none);
  return impl_->Decide(question, judge, meter, [&](uint64_t, uint64_t, uint64_t rounds) {
    return rounds < decision.rounds;
  });
}

}  // namespace Stg
