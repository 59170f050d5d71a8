// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/consequence_engine.hh"

#include <algorithm>
#include <limits>

#include "threads/wall_clock.hh"
#include "whatif/outcome.hh"
#include "world/world.hh"

namespace Stg {

bool Judge::NeedsWorld() const { return true; }
void Judge::Begin(World&, size_t) {}
bool Judge::Score(World&, size_t, double*) { return false; }
bool Judge::Watch(const Sighting*, size_t, double*) { return false; }
void Judge::BeginSample(World& world, const Sample& sample) { Begin(world, sample.candidate); }

bool Judge::ScoreSample(World& world, const Sample& sample, SampleResult* result) {
  return Score(world, sample.candidate, &result->score);
}

bool Judge::WatchSample(const Sighting* watched, const Sample& sample, SampleResult* result) {
  return Watch(watched, sample.candidate, &result->score);
}

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
  /// Forwards the callbacks of a branch to the judge, with the sample that it is.
  struct Watcher : Scenario {
    Judge* judge = nullptr;
    size_t candidates = 1;
    const Branches* branches = nullptr;
    std::vector<uint8_t> collided;  // by branch

    Sample SampleAt(uint32_t branch) const {
      return {branch % candidates, static_cast<uint32_t>(branch / candidates)};
    }
    template <typename F>
    bool Ask(uint32_t branch, double* score, F f) {
      SampleResult result;
      result.score = *score;
      result.collided = collided[branch] != 0;
      const bool ends = f(SampleAt(branch), &result);
      *score = result.score;
      collided[branch] = result.collided;
      return ends;
    }
    bool NeedsWorld() const override { return judge->NeedsWorld(); }
    void BeforeStep(World& world, uint32_t branch) override {
      if ((*branches)[branch].steps == 0) judge->BeginSample(world, SampleAt(branch));
    }
    bool AfterStep(World& world, uint32_t branch, double* score) override {
      return Ask(branch, score, [&](const Sample& sample, SampleResult* result) {
        return judge->ScoreSample(world, sample, result);
      });
    }
    bool Watch(const Sighting* watched, uint32_t branch, double* score) override {
      return Ask(branch, score, [&](const Sample& sample, SampleResult* result) {
        return judge->WatchSample(watched, sample, result);
      });
    }
  };

  Impl(const World& prototype, const Options& wanted)
      : options(wanted),
        branch_options(OptionsOfBranches(wanted)),
        interval(std::max<usec_t>(1, prototype.sim_interval)),
        most_samples(std::max({1u, wanted.samples, wanted.most_samples})),
        branches(std::make_unique<Branches>(prototype, 0, branch_options)) {}

  void Begin(const Question& question);
  void AddSamples(const Question& question, uint32_t end);
  uint64_t CountAlive() const;
  uint64_t CountSteps() const;
  Outcome OutcomeOf(size_t candidate) const;
  void Summarize(Decision* decision) const;
  size_t BestOf(const std::vector<Outcome>& outcomes) const;
  Bounds ReachOf(size_t candidate, uint64_t steps_left) const;
  void DropDominated(uint64_t steps_left);
  bool TellApart();
  uint32_t NumberOf(size_t candidate, uint32_t sample) const {
    return static_cast<uint32_t>(sample * watcher.candidates + candidate);
  }
  const Branch& SampleOf(size_t candidate, uint32_t sample) const {
    return (*branches)[NumberOf(candidate, sample)];
  }
  bool AnySampleIs(Branch::State state, size_t candidate) const;
  /// Called with the scenario steps done, those of the next round, and the rounds done.
  using GoOn = std::function<bool(uint64_t done, uint64_t next, uint64_t rounds)>;
  bool ReachHorizon(uint64_t steps, const GoOn& go_on, Decision* decision);
  Decision Decide(const Question& question, Judge* judge, const Meter& meter, const GoOn& go_on);

  const Options options;
  const BranchOptions branch_options;
  const usec_t interval;
  const uint32_t most_samples;
  std::unique_ptr<Branches> branches;
  Watcher watcher;
  // By candidate.
  std::vector<uint32_t> samples;    // that are simulated
  std::vector<bool> dominated;      // gets no further steps
  std::vector<bool> is_told_apart;  // gets no further samples
};

void ConsequenceEngine::Impl::Begin(const Question& question) {
  const size_t candidates = question.candidates.size();
  watcher.candidates = std::max<size_t>(1, candidates);
  watcher.branches = branches.get();
  watcher.collided.clear();
  samples.assign(candidates, 0);
  dominated.assign(candidates, false);
  is_told_apart.assign(candidates, false);
  branches->Resize(0);
  AddSamples(question, std::max(1u, options.samples));
}

/// Begins samples of all candidates that can still win, so that each has `end`.
void ConsequenceEngine::Impl::AddSamples(const Question& question, uint32_t end) {
  const uint32_t first = branches->count();
  branches->Resize(static_cast<uint32_t>(question.candidates.size()) * end);
  watcher.collided.resize(branches->count(), 0);
  for (uint32_t branch = first; branch < branches->count(); branch++) {
    const auto [candidate, sample] = watcher.SampleAt(branch);
    if (dominated[candidate] || is_told_apart[candidate]) continue;
    if (question.seed == 0 && sample == 0)
      branches->Restore(branch, question.now);
    else
      branches->Restore(branch, question.now, question.seed + sample);
    for (const Command& command : question.candidates[candidate].commands)
      branches->Give(branch, command);
    samples[candidate] = sample + 1;
  }
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
  for (uint32_t sample = 0; sample < samples[candidate]; sample++)
    if (SampleOf(candidate, sample).state == state) return true;
  return false;
}

Outcome ConsequenceEngine::Impl::OutcomeOf(size_t candidate) const {
  Outcome outcome;
  const uint32_t count = samples[candidate];
  for (uint32_t sample = 0; sample < count; sample++) {
    const Branch& branch = SampleOf(candidate, sample);
    outcome.score += branch.score / count;
    outcome.scores.push_back(branch.score);
    outcome.collided.push_back(watcher.collided[NumberOf(candidate, sample)]);
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
  const uint32_t count = samples[candidate];
  Bounds reach(0, 0);
  for (uint32_t sample = 0; sample < count; sample++) {
    const Branch& branch = SampleOf(candidate, sample);
    const bool goes_on = branch.state == Branch::kAlive && steps_left > 0;
    reach.min += (branch.score + (goes_on ? outlook.min : 0)) / count;
    reach.max += (branch.score + (goes_on ? outlook.max : 0)) / count;
  }
  return reach;
}

/// Retires candidates whose mean score can no longer beat that of the best one. If there may be
/// more samples, nobody knows that.
void ConsequenceEngine::Impl::DropDominated(uint64_t steps_left) {
  if (options.preference.kind != Preference::kMean || options.preference.max_risk < 1) return;
  if (most_samples > std::max(1u, options.samples)) return;
  double best = -std::numeric_limits<double>::infinity();
  for (size_t candidate = 0; candidate < samples.size(); candidate++)
    if (!dominated[candidate] && !AnySampleIs(Branch::kFailed, candidate))
      best = std::max(best, ReachOf(candidate, steps_left).min);
  for (size_t candidate = 0; candidate < samples.size(); candidate++) {
    if (!AnySampleIs(Branch::kAlive, candidate) || !(ReachOf(candidate, steps_left).max < best))
      continue;
    dominated[candidate] = true;
    for (uint32_t sample = 0; sample < samples[candidate]; sample++)
      branches->Retire(NumberOf(candidate, sample));
  }
}

/// The best candidate: one without too great a risk if there is any, otherwise that with the least.
size_t ConsequenceEngine::Impl::BestOf(const std::vector<Outcome>& outcomes) const {
  const Preference& preference = options.preference;
  const auto risk_of = [&](const Outcome& outcome) {
    const double risk = outcome.CollisionRisk();
    return risk <= preference.max_risk ? 0 : risk;
  };
  size_t best = outcomes.size();
  for (size_t candidate = 0; candidate < outcomes.size(); candidate++) {
    const Outcome& outcome = outcomes[candidate];
    if (!outcome.error.empty() || outcome.dominated || is_told_apart[candidate]) continue;
    if (best < outcomes.size()) {
      const double difference = risk_of(outcome) - risk_of(outcomes[best]);
      const bool is_better =
          difference < 0 ||
          (difference == 0 && preference.ValueOf(outcome) > preference.ValueOf(outcomes[best]));
      if (!is_better) continue;
    }
    best = candidate;
  }
  return best < outcomes.size() ? best : 0;
}

void ConsequenceEngine::Impl::Summarize(Decision* decision) const {
  decision->outcomes.clear();
  for (size_t candidate = 0; candidate < samples.size(); candidate++)
    decision->outcomes.push_back(OutcomeOf(candidate));
  decision->best = BestOf(decision->outcomes);
  if (decision->best < samples.size()) decision->samples = samples[decision->best];
}

/// Notes the candidates that are certainly worse than the best one. Returns true if no other
/// candidate may be better than that.
bool ConsequenceEngine::Impl::TellApart() {
  std::vector<Outcome> outcomes;
  for (size_t candidate = 0; candidate < samples.size(); candidate++)
    outcomes.push_back(OutcomeOf(candidate));
  const size_t best = BestOf(outcomes);
  bool is_clear = true;
  for (size_t candidate = 0; candidate < outcomes.size(); candidate++) {
    if (candidate == best || dominated[candidate] || is_told_apart[candidate]) continue;
    const auto is_better_by = [&](double margin) {
      return whatif::IsToldApart(outcomes[best], outcomes[candidate], options.preference,
                                 options.errors, margin);
    };
    const double max_risk = options.preference.max_risk;
    if (outcomes[candidate].CollisionInterval(options.errors).low > max_risk) continue;
    if (is_better_by(std::numeric_limits<double>::min()))
      is_told_apart[candidate] = max_risk >= 1;
    else if (!is_better_by(-options.indifference))
      is_clear = false;
  }
  return is_clear;
}

/// Makes rounds until all samples have made so many steps or have ended. Returns false if it was
/// told to stop before.
bool ConsequenceEngine::Impl::ReachHorizon(uint64_t steps, const GoOn& go_on, Decision* decision) {
  for (uint64_t done = 0;;) {
    const uint64_t alive = CountAlive(), left = steps - done;
    if (alive == 0 || left == 0) return true;
    const uint64_t next = std::min(std::max<uint64_t>(1, options.round), left);
    if (!go_on(decision->scenario_steps, alive * next, decision->rounds)) return false;
    branches->Step(next, &watcher);
    done += next;
    decision->rounds++;
    decision->steps = std::max(decision->steps, done);
    decision->scenario_steps = CountSteps();
    DropDominated(left - next);
  }
}

Decision ConsequenceEngine::Impl::Decide(const Question& question, Judge* judge, const Meter& meter,
                                         const GoOn& go_on) {
  Decision decision;
  watcher.judge = judge;
  Begin(question);
  const uint64_t steps = question.horizon / interval;
  decision.complete = ReachHorizon(steps, go_on, &decision);
  Summarize(&decision);
  if (!decision.complete) decision.reason = Decision::kBudget;
  for (uint32_t count = std::max(1u, options.samples); decision.complete;) {
    if (most_samples > count && TellApart()) decision.reason = Decision::kToldApart;
    if (count >= most_samples || decision.reason == Decision::kToldApart) break;
    count = std::min(2 * count, most_samples);
    AddSamples(question, count);
    if (!ReachHorizon(steps, go_on, &decision)) {
      decision.reason = Decision::kBudget;
      break;
    }
    Summarize(&decision);
  }
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
