// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/decision_budget.hh"

#include <algorithm>
#include <memory>
#include <vector>

#include "models/model.hh"
#include "stage/process.hh"
#include "whatif/consequence_engine.hh"
#include "world/world.hh"

namespace Stg::program {

namespace {

constexpr size_t kMostTried = 8;  // robots

/// Watches all robots, as a judge would, and ends no sample.
class Onlooker : public Judge {
 public:
  explicit Onlooker(size_t watched) : watched_(watched) {}
  bool NeedsWorld() const override { return false; }
  bool WatchSample(const Sighting* watched, const Sample&, SampleResult* result) override {
    for (size_t i = 0; i < watched_; i++) {
      result->score -= watched[i].pose.x * watched[i].pose.x;
      result->collided |= watched[i].stalled;
    }
    return false;
  }

 private:
  const size_t watched_;
};

/// Decisions about a world, each of a number of samples.
class Decisions {
 public:
  Decisions(const World& world, const Snapshot& now, const DecisionLimits& limits)
      : world_(world), limits_(limits), robots_(RobotsOf(world)) {
    question_.now = now;
    question_.candidates.resize(DecisionBudget::kCandidates);
    for (const Model* robot : robots_) options_.watched.push_back(robot->GetId());
    options_.threads = limits.threads;
    options_.keep = Snapshot::kLean;
  }

  /// Lets the candidates command the first robot that obeys.
  void FindRobot(DecisionBudget* found) {
    MakeEngine(1);
    found->why_slow = engine_->WhyNotClosed();
    found->why_no_robot = robots_.empty() ? "there is no robot" : "";
    for (size_t i = 0; i < std::min(robots_.size(), kMostTried); i++) {
      GiveCommandsTo(*robots_[i]);
      const std::string error = Decide(std::min<uint64_t>(limits_.steps, 10)).error;
      if (error.empty()) {
        found->robot = robots_[i]->TokenStr();
        found->why_no_robot.clear();
        return;
      }
      if (i == 0) found->why_no_robot = error;
    }
    for (Candidate& candidate : question_.candidates) candidate.commands.clear();
  }

  double Seconds(uint32_t samples) {
    if (options_.samples != samples) MakeEngine(samples);
    return MedianSeconds([this] { return Decide(limits_.steps).seconds; });
  }

 private:
  void MakeEngine(uint32_t samples) {
    engine_.reset();
    options_.samples = samples;
    engine_ = std::make_unique<ConsequenceEngine>(world_, options_);
    Decide(1);  // makes the threads' worlds
  }
  /// Speeds from 0.1 to 0.5 m/s, each with several turn rates; the first candidate goes on as now.
  void GiveCommandsTo(const Model& robot) {
    for (uint32_t i = 1; i < question_.candidates.size(); i++)
      question_.candidates[i].commands = {
          {0, robot.GetId(), Command::kSetSpeed, 0.1 * (1 + i % 5), 0, 0.2 * (i / 5) - 0.5}};
  }
  Decision Decide(uint64_t steps) {
    question_.horizon = steps * world_.sim_interval;
    Onlooker judge(options_.watched.size());
    return engine_->Choose(question_, Stg::Budget(), &judge);
  }

  const World& world_;
  const DecisionLimits& limits_;
  const std::vector<Model*> robots_;
  Question question_;
  ConsequenceEngine::Options options_;
  std::unique_ptr<ConsequenceEngine> engine_;
};

}  // namespace

std::vector<Model*> RobotsOf(const World& world) {
  std::vector<Model*> robots;
  for (Model* model : world.GetAllModels())
    if (model->Drives()) robots.push_back(model);
  std::ranges::sort(robots, {}, &Model::GetId);
  return robots;
}

DecisionBudget MeasureDecisions(const World& world, const Snapshot& now,
                                const DecisionLimits& limits) {
  constexpr uint32_t kSamples = DecisionBudget::kSamples;
  DecisionBudget result;
  Decisions decisions(world, now, limits);
  decisions.FindRobot(&result);
  const double too_long = std::max(4 * limits.budget, 2.0);
  const double guess = limits.scenario * DecisionBudget::kCandidates / limits.threads;
  result.is_estimate = true;
  if (guess > too_long) {
    result.seconds = guess * kSamples;
    result.memory_mb = MemoryMb();
    return result;
  }
  const double one = decisions.Seconds(1);
  result.is_estimate = one * kSamples > too_long;
  result.seconds = result.is_estimate ? one * kSamples : decisions.Seconds(kSamples);
  result.memory_mb = MemoryMb();
  if (one <= limits.budget)
    result.samples = SearchFit(
        limits.budget, [&](uint32_t samples) { return decisions.Seconds(samples); },
        "samples of each candidate", limits.shows_progress);
  return result;
}

}  // namespace Stg::program
