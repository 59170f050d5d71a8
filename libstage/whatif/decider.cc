// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/decider.hh"

#include <algorithm>
#include <limits>

#include "messages/report.hh"
#include "threads/wall_clock.hh"
#include "whatif/outcome.hh"

namespace Stg::whatif {

namespace {

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

Decider::Decider(const ConsequenceEngine::Options& options, Branches* branches)
    : options_(options),
      least_samples_(std::max(1u, options.samples)),
      most_samples_(std::max(least_samples_, options.most_samples)),
      branches_(*branches) {}

template <typename F>
bool Decider::Watcher::Ask(uint32_t branch, double* score, F f) {
  SampleResult result;
  result.score = *score;
  result.collided = collided[branch] != 0;
  const bool ends = f(SampleAt(branch), &result);
  *score = result.score;
  collided[branch] = result.collided;
  return ends;
}

void Decider::Watcher::BeforeStep(World& world, uint32_t branch) {
  if ((*branches)[branch].steps == 0) judge->BeginSample(world, SampleAt(branch));
}

bool Decider::Watcher::AfterStep(World& world, uint32_t branch, double* score) {
  return Ask(branch, score, [&](const Sample& sample, SampleResult* result) {
    return judge->ScoreSample(world, sample, result);
  });
}

bool Decider::Watcher::Watch(const Sighting* watched, uint32_t branch, double* score) {
  return Ask(branch, score, [&](const Sample& sample, SampleResult* result) {
    return judge->WatchSample(watched, sample, result);
  });
}

void Decider::BeginTask(const Task& task) {
  task.judge->BeginDecision(task.about);
  watcher_.judge = task.judge;
  watcher_.candidates = std::max<size_t>(1, task.about.candidates);
  watcher_.branches = &branches_;
  watcher_.collided.clear();
  watcher_.scores.clear();
  samples_.assign(task.about.candidates, 0);
  dominated_.assign(task.about.candidates, false);
  is_told_apart_.assign(task.about.candidates, false);
  has_reached_horizon_.assign(task.about.candidates, false);
  for (uint32_t branch = 0; branch < branches_.count(); branch++) branches_.Retire(branch);
  count_ = scored_ = 0;
  AddSamples(task, least_samples_);
}

/// Begins samples of all candidates that can still win, so that each has `end`. Earlier ones stay
/// as they are.
void Decider::AddSamples(const Task& task, uint32_t end) {
  const uint32_t first = count_;
  ForEachLiving([&](uint32_t branch, const Sample& sample) {
    branches_.Retire(branch);
    has_reached_horizon_[sample.candidate] = true;
  });
  count_ = static_cast<uint32_t>(task.about.candidates) * end;
  if (branches_.count() < count_) branches_.Resize(count_);
  watcher_.collided.resize(count_, 0);
  for (uint32_t branch = first; branch < count_; branch++) {
    const Sample sample = watcher_.SampleAt(branch);
    if (dominated_[sample.candidate] || is_told_apart_[sample.candidate]) continue;
    task.begin(branch, sample);
    samples_[sample.candidate] = sample.number + 1;
  }
}

/// Lets the judge score the futures that it has not seen yet.
void Decider::ScoreFutures() {
  if (!watcher_.judge->ScoresFutures()) return;
  watcher_.scores.resize(count_, 0);
  std::vector<Future> futures;
  std::vector<SampleResult> results;
  std::vector<uint32_t> numbers;
  for (uint32_t branch = scored_; branch < count_; branch++) {
    const Sample sample = watcher_.SampleAt(branch);
    const Branch& of = branches_[branch];
    if (sample.number >= samples_[sample.candidate] || of.state == Branch::kFailed) continue;
    futures.push_back({sample, of.sightings.data(), of.steps});
    SampleResult& result = results.emplace_back();
    result.score = of.score;
    result.collided = watcher_.collided[branch] != 0;
    numbers.push_back(branch);
  }
  scored_ = count_;
  watcher_.judge->ScoreFutures(futures.data(), futures.size(), results.data());
  for (size_t i = 0; i < numbers.size(); i++) {
    watcher_.scores[numbers[i]] = results[i].score;
    watcher_.collided[numbers[i]] = results[i].collided;
  }
}

uint64_t Decider::CountSteps() const {
  uint64_t steps = 0;
  for (size_t candidate = 0; candidate < samples_.size(); candidate++)
    for (uint32_t sample = 0; sample < samples_[candidate]; sample++)
      steps += SampleOf(candidate, sample).steps;
  return steps;
}

uint64_t Decider::CountAlive() const {
  uint64_t alive = 0;
  for (uint32_t branch = 0; branch < count_; branch++)
    alive += branches_[branch].state == Branch::kAlive;
  return alive;
}

bool Decider::AnySampleIs(Branch::State state, size_t candidate) const {
  for (uint32_t sample = 0; sample < samples_[candidate]; sample++)
    if (SampleOf(candidate, sample).state == state) return true;
  return false;
}

Outcome Decider::OutcomeOf(size_t candidate) const {
  Outcome outcome;
  const uint32_t count = samples_[candidate];
  for (uint32_t sample = 0; sample < count; sample++) {
    const Branch& branch = SampleOf(candidate, sample);
    const double score = ScoreOf(NumberOf(candidate, sample));
    outcome.score += score / count;
    outcome.scores.push_back(score);
    outcome.collided.push_back(watcher_.collided[NumberOf(candidate, sample)]);
    outcome.steps = std::max(outcome.steps, branch.steps);
    if (sample == 0) outcome.sightings = branch.sightings;
    if (branch.state == Branch::kFailed) outcome.error = branch.error;
  }
  outcome.dominated = dominated_[candidate];
  outcome.ended = !AnySampleIs(Branch::kAlive, candidate) && !has_reached_horizon_[candidate] &&
                  !outcome.dominated;
  return outcome;
}

/// Bounds of the candidate's final score, with `steps_left` steps remaining.
Bounds Decider::ReachOf(size_t candidate, uint64_t steps_left) const {
  const Bounds outlook = watcher_.judge->Outlook(steps_left);
  const uint32_t count = samples_[candidate];
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
/// more samples, or scores come at the end, nobody knows that.
void Decider::DropDominated(uint64_t steps_left) {
  if (options_.preference.kind != Preference::kMean || options_.preference.max_risk < 1) return;
  if (most_samples_ > least_samples_ || watcher_.judge->ScoresFutures()) return;
  double best = -std::numeric_limits<double>::infinity();
  for (size_t candidate = 0; candidate < samples_.size(); candidate++)
    if (!dominated_[candidate] && !AnySampleIs(Branch::kFailed, candidate))
      best = std::max(best, ReachOf(candidate, steps_left).min);
  for (size_t candidate = 0; candidate < samples_.size(); candidate++) {
    if (!AnySampleIs(Branch::kAlive, candidate) || !(ReachOf(candidate, steps_left).max < best))
      continue;
    dominated_[candidate] = true;
    for (uint32_t sample = 0; sample < samples_[candidate]; sample++)
      branches_.Retire(NumberOf(candidate, sample));
  }
}

/// The best candidate: one without too great a risk if there is any, otherwise that with the least.
size_t Decider::BestOf(const std::vector<Outcome>& outcomes) const {
  const Preference& preference = options_.preference;
  const auto risk_of = [&](const Outcome& outcome) {
    const double risk = outcome.CollisionRisk();
    return risk <= preference.max_risk ? 0 : risk;
  };
  size_t best = outcomes.size();
  for (size_t candidate = 0; candidate < outcomes.size(); candidate++) {
    const Outcome& outcome = outcomes[candidate];
    if (!outcome.error.empty() || outcome.dominated || is_told_apart_[candidate]) continue;
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

void Decider::Summarize(Decision* decision) const {
  decision->outcomes.clear();
  for (size_t candidate = 0; candidate < samples_.size(); candidate++)
    decision->outcomes.push_back(OutcomeOf(candidate));
  decision->best = BestOf(decision->outcomes);
  if (decision->best < samples_.size()) decision->samples = samples_[decision->best];
}

/// Notes the candidates that are certainly worse than the best one of a summary. Returns true if no
/// other candidate may be better than that.
bool Decider::TellApart(const Decision& decision) {
  const std::vector<Outcome>& outcomes = decision.outcomes;
  const size_t best = decision.best;
  bool is_clear = true;
  for (size_t candidate = 0; candidate < outcomes.size(); candidate++) {
    if (candidate == best || dominated_[candidate] || is_told_apart_[candidate]) continue;
    const auto is_better_by = [&](double margin) {
      return IsToldApart(outcomes[best], outcomes[candidate], options_.preference, options_.errors,
                         margin);
    };
    const double max_risk = options_.preference.max_risk;
    if (outcomes[candidate].CollisionInterval(options_.errors).low > max_risk) continue;
    if (is_better_by(std::numeric_limits<double>::min()))
      is_told_apart_[candidate] = max_risk >= 1;
    else if (!is_better_by(-options_.indifference))
      is_clear = false;
  }
  return is_clear;
}

/// Why there can be no decision: nobody would obey a command, or nothing is left to choose from.
std::string Decider::WhyNone(const Task& task, const Decision& decision) const {
  const auto describe = [&](size_t candidate) {
    const std::string name = task.name_of ? task.name_of(candidate) : "";
    return "candidate " + std::to_string(candidate) +
           (name.empty() ? "" : " (" + messages::Quoted(name) + ")") + ": " +
           decision.outcomes[candidate].error;
  };
  if (const auto refused = FindRefused()) return describe(*refused);
  const auto has_failed = [](const Outcome& outcome) { return !outcome.error.empty(); };
  if (decision.outcomes.empty() || !std::ranges::all_of(decision.outcomes, has_failed)) return "";
  return "all candidates have failed; " + describe(0);
}

/// The first candidate whose commands were refused, if any.
std::optional<size_t> Decider::FindRefused() const {
  for (size_t candidate = 0; candidate < samples_.size(); candidate++)
    for (uint32_t sample = 0; sample < samples_[candidate]; sample++)
      if (SampleOf(candidate, sample).refused) return candidate;
  return std::nullopt;
}

void Decider::Step(const Task& task, uint64_t steps) {
  if (!task.before_step) return branches_.Step(steps, &watcher_);
  for (uint64_t i = 0; i < steps; i++) {
    task.before_step();
    branches_.Step(1, &watcher_);
  }
}

/// Makes rounds until all samples have made so many steps or have ended. Returns false if it was
/// told to stop before, or a command was refused.
bool Decider::ReachHorizon(const Task& task, const GoOn& go_on, Decision* decision) {
  for (uint64_t done = 0;;) {
    const uint64_t alive = CountAlive(), left = task.about.steps - done;
    if (alive == 0 || left == 0) return true;
    const uint64_t next = std::min(std::max<uint64_t>(1, options_.round), left);
    if (!go_on(decision->scenario_steps, alive * next, decision->rounds)) return false;
    Step(task, next);
    done += next;
    decision->rounds++;
    decision->steps = std::max(decision->steps, done);
    decision->scenario_steps = CountSteps();
    if (FindRefused()) return false;
    DropDominated(left - next);
  }
}

Decision Decider::Decide(const Task& task, const GoOn& go_on) {
  Decision decision;
  BeginTask(task);
  decision.complete = ReachHorizon(task, go_on, &decision);
  ScoreFutures();
  Summarize(&decision);
  if (!decision.complete) decision.reason = Decision::kBudget;
  for (uint32_t count = least_samples_; decision.complete;) {
    if (most_samples_ > count && TellApart(decision)) decision.reason = Decision::kToldApart;
    if (count >= most_samples_ || decision.reason == Decision::kToldApart) break;
    count = std::min(2 * count, most_samples_);
    AddSamples(task, count);
    if (!ReachHorizon(task, go_on, &decision)) {
      decision.reason = Decision::kBudget;
      break;
    }
    ScoreFutures();
    Summarize(&decision);
  }
  if (FindRefused()) Summarize(&decision);
  decision.error = WhyNone(task, decision);
  return decision;
}

Decision Decider::Choose(const Task& task, const Budget& budget) {
  const Meter meter(budget);
  Allowance allowance(budget, meter);
  Decision decision = Decide(
      task, [&](uint64_t done, uint64_t next, uint64_t) { return allowance.Suffices(done, next); });
  decision.seconds = meter.seconds();
  decision.joules = meter.joules();
  return decision;
}

Decision Decider::Replay(const Task& task, const Decision& decision) {
  const Budget none;
  const Meter meter(none);
  Decision again =
      Decide(task, [&](uint64_t, uint64_t, uint64_t rounds) { return rounds < decision.rounds; });
  again.seconds = meter.seconds();
  return again;
}

}  // namespace Stg::whatif
