// SPDX-License-Identifier: GPL-2.0-or-later
//
// Decisions about branches that begin in given states: simulates samples of candidates in rounds,
// drops those that cannot win, and adds samples until the best candidate is clear.

#ifndef STAGE_WHATIF_DECIDER_HH
#define STAGE_WHATIF_DECIDER_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "whatif/branches.hh"
#include "whatif/consequence_engine.hh"

namespace Stg::whatif {

BranchOptions OptionsOfBranches(const ConsequenceEngine::Options& options);

class Decider {
 public:
  /// `begin` restores the branch of a sample and gives it its commands.
  using Begin = std::function<void(uint32_t branch, const Sample& sample)>;
  struct Task {
    DecisionTask about;
    Judge* judge;
    Begin begin;
    std::function<std::string(size_t candidate)> name_of = {};  ///< for messages; may be empty
    /// Called before each step of all samples, if it is not empty.
    std::function<void()> before_step;
  };

  /// The branches must outlive this.
  Decider(const ConsequenceEngine::Options& options, Branches* branches);

  /// Returns the best candidate found within the budget.
  Decision Choose(const Task& task, const Budget& budget);
  /// Repeats the rounds of `decision` without a budget.
  Decision Replay(const Task& task, const Decision& decision);

  /// Calls f(branch, sample) for each sample that is simulated.
  template <typename F>
  void ForEachLiving(F f) const {
    for (uint32_t branch = 0; branch < count_; branch++)
      if (branches_[branch].state == Branch::kAlive) f(branch, watcher_.SampleAt(branch));
  }

 private:
  /// Forwards the callbacks of a branch to the judge, with the sample that it is.
  struct Watcher : Scenario {
    Judge* judge = nullptr;
    size_t candidates = 1;
    const Branches* branches = nullptr;
    std::vector<uint8_t> collided;  // by branch
    std::vector<double> scores;     // by branch, if the judge scores futures

    Sample SampleAt(uint32_t branch) const {
      return {branch % candidates, static_cast<uint32_t>(branch / candidates)};
    }
    template <typename F>
    bool Ask(uint32_t branch, double* score, F f);
    bool NeedsWorld() const override { return judge->NeedsWorld(); }
    void BeforeStep(World& world, uint32_t branch) override;
    bool AfterStep(World& world, uint32_t branch, double* score) override;
    bool Watch(const Sighting* watched, uint32_t branch, double* score) override;
  };
  /// Called with the scenario steps done, those of the next round, and the rounds done.
  using GoOn = std::function<bool(uint64_t done, uint64_t next, uint64_t rounds)>;

  void BeginTask(const Task& task);
  void AddSamples(const Task& task, uint32_t end);
  void ScoreFutures();
  double ScoreOf(uint32_t branch) const {
    return watcher_.judge->ScoresFutures() ? watcher_.scores[branch] : branches_[branch].score;
  }
  uint64_t CountAlive() const;
  uint64_t CountSteps() const;
  Outcome OutcomeOf(size_t candidate) const;
  void Summarize(Decision* decision) const;
  size_t BestOf(const std::vector<Outcome>& outcomes) const;
  Bounds ReachOf(size_t candidate, uint64_t steps_left) const;
  void DropDominated(uint64_t steps_left);
  bool TellApart(const Decision& decision);
  uint32_t NumberOf(size_t candidate, uint32_t sample) const {
    return static_cast<uint32_t>(sample * watcher_.candidates + candidate);
  }
  const Branch& SampleOf(size_t candidate, uint32_t sample) const {
    return branches_[NumberOf(candidate, sample)];
  }
  bool AnySampleIs(Branch::State state, size_t candidate) const;
  std::optional<size_t> FindRefused() const;
  std::string WhyNone(const Task& task, const Decision& decision) const;
  void Step(const Task& task, uint64_t steps);
  bool ReachHorizon(const Task& task, const GoOn& go_on, Decision* decision);
  Decision Decide(const Task& task, const GoOn& go_on);

  const ConsequenceEngine::Options options_;
  const uint32_t least_samples_, most_samples_;
  Branches& branches_;
  Watcher watcher_;
  uint32_t count_ = 0;   // of branches that the decision uses
  uint32_t scored_ = 0;  // of branches whose futures have been scored
  // By candidate.
  std::vector<uint32_t> samples_;          // that are simulated
  std::vector<bool> dominated_;            // gets no further steps
  std::vector<bool> is_told_apart_;        // gets no further samples
  std::vector<bool> has_reached_horizon_;  // in samples that are not alive any more
};

}  // namespace Stg::whatif

#endif
