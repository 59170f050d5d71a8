// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/consequence_engine.hh"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "stage.hh"

namespace Stg {
namespace {

/// A robot in front of a wall with a gap on the left; the goal is to get far east.
const char kWall[] =
    "resolution 0.05\n"
    "position( name \"r\" alwayson 1 size [0.4 0.4 0.4] localization \"gps\"\n"
    "  ranger( alwayson 1 sensor( range [0 4] fov 180 samples 9 noise [0.01 0.01 0] ) ) )\n"
    "model( pose [2 -2.6 0 0] size [0.4 5 1] )\n";

class Engine : public testing::Test {
 protected:
  Engine() {
    Init(nullptr, nullptr);
    RunOptions options;
    options.listed = false;
    world_ = std::make_unique<World>(options);
    std::istringstream content(kWall);
    EXPECT_TRUE(world_->Load(content, "wall.world"));
    for (int i = 0; i < 5; i++) world_->Update();
    EXPECT_TRUE(world_->Take(&question_.now));
    question_.horizon = 10000000;
    const uint32_t robot = world_->GetModel("r")->GetId();
    const auto add = [&](const char* name, double speed, double turn) {
      question_.candidates.push_back(
          {name, {Command(0, robot, Command::kSetSpeed, speed, 0, turn)}});
    };
    add("stay", 0, 0);
    add("ahead", 0.4, 0);
    add("left", 0.4, 0.12);
    add("right", 0.4, -0.12);
    add("spin", 0, 1);
  }

  std::unique_ptr<World> world_;
  Question question_;
};

/// Scores the distance east, at most 0.1 m per step. A collision costs 10 m and ends the run.
class Eastward : public Judge {
 public:
  bool Score(World& world, size_t, double* score) override {
    scored++;
    const Model* const robot = world.GetModel("r");
    *score = robot->GetGlobalPose().x - (robot->Stalled() ? 10 : 0);
    return robot->Stalled();
  }
  Bounds Outlook(uint64_t steps) const override {
    if (!knows_bounds) return Judge::Outlook(steps);
    const double furthest = 0.05 * static_cast<double>(steps);
    return Bounds(-furthest - 10, furthest);
  }
  std::atomic<int> scored{0};
  bool knows_bounds = false;
};

void ExpectSame(const Decision& a, const Decision& b) {
  EXPECT_EQ(a.best, b.best);
  EXPECT_EQ(a.complete, b.complete);
  EXPECT_EQ(a.rounds, b.rounds);
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.scenario_steps, b.scenario_steps);
  ASSERT_EQ(a.outcomes.size(), b.outcomes.size());
  for (size_t i = 0; i < a.outcomes.size(); i++) {
    EXPECT_EQ(a.outcomes[i].score, b.outcomes[i].score) << i;
    EXPECT_EQ(a.outcomes[i].steps, b.outcomes[i].steps) << i;
    EXPECT_EQ(a.outcomes[i].ended, b.outcomes[i].ended) << i;
    EXPECT_EQ(a.outcomes[i].dominated, b.outcomes[i].dominated) << i;
    ASSERT_EQ(a.outcomes[i].sightings.size(), b.outcomes[i].sightings.size());
    for (size_t s = 0; s < a.outcomes[i].sightings.size(); s++)
      EXPECT_EQ(a.outcomes[i].sightings[s].pose.x, b.outcomes[i].sightings[s].pose.x);
  }
}

TEST_F(Engine, ChoosesTheBestConsequence) {
  ConsequenceEngine engine(*world_);
  ASSERT_TRUE(engine.IsReady());
  Eastward judge;
  const uint64_t before = world_->StateHash();
  const Decision decision = engine.Choose(question_, Budget(), &judge);
  EXPECT_EQ(question_.candidates[decision.best].name, "left");
  EXPECT_TRUE(decision.complete);
  EXPECT_EQ(decision.steps, 100u);
  EXPECT_TRUE(decision.outcomes[1].ended) << "runs into the wall";
  EXPECT_LT(decision.outcomes[1].score, -5);
  EXPECT_EQ(world_->StateHash(), before);
}

/// Decisions without a clock are the same with any number of threads.
TEST_F(Engine, IsReplayedWithoutAClock) {
  ConsequenceEngine::Options options;
  options.samples = 3;
  options.watched = {world_->GetModel("r")->GetId()};
  std::vector<Decision> decisions;
  for (const unsigned threads : {1u, 2u, 4u}) {
    options.threads = threads;
    ConsequenceEngine engine(*world_, options);
    Eastward judge;
    Budget budget;
    budget.scenario_steps = 500;
    decisions.push_back(engine.Choose(question_, budget, &judge));
    ExpectSame(decisions.back(), decisions.front());
    Budget short_time(0.002);
    const Decision hasty = engine.Choose(question_, short_time, &judge);
    ExpectSame(engine.Replay(question_, hasty, &judge), hasty);
  }
  EXPECT_LE(decisions[0].scenario_steps, 500u);
  EXPECT_GT(decisions[0].scenario_steps, 300u);
}

/// Draws the score of a sample from its number: candidate 2 is better by 1 in each sample, which
/// differ by much more; candidates 3 and 4 are as good, but for a hundredth in each sample.
class Drawn : public Judge {
 public:
  bool NeedsWorld() const override { return false; }
  bool WatchSample(const Sighting*, const Sample& sample, SampleResult* result) override {
    RandomStream random(MixSeeds(7, sample.number));
    result->score = 20 * random.Uniform() + (sample.candidate >= 2 ? gain : 0);
    if (sample.candidate > 2)
      result->score += sample.number % 2 == sample.candidate % 2 ? 0.01 : -0.01;
    result->collided = sample.candidate == 1 && sample.number % 4 == 0;
    return result->collided;
  }
  double gain = 1;
};

ConsequenceEngine::Options GrowingOptions(const World& world) {
  ConsequenceEngine::Options options;
  options.samples = 4;
  options.most_samples = 64;
  options.watched = {world.GetModel("r")->GetId()};
  return options;
}

TEST_F(Engine, AddsSamplesUntilCandidatesAreToldApart) {
  ConsequenceEngine::Options options = GrowingOptions(*world_);
  question_.horizon = 500000;
  Drawn judge;
  const Decision all = ConsequenceEngine(*world_, options).Choose(question_, Budget(), &judge);
  EXPECT_EQ(all.reason, Decision::kHorizon) << "candidates that differ by nothing stay";
  EXPECT_EQ(all.samples, 64u);
  EXPECT_EQ(all.outcomes[0].scores.size(), 4u) << "one that is worse in each sample gets no more";
  EXPECT_EQ(all.outcomes[3].scores.size(), 64u);
  EXPECT_DOUBLE_EQ(all.outcomes[1].CollisionRisk(), 0.25);

  options.indifference = 0.05;
  const Decision decision = ConsequenceEngine(*world_, options).Choose(question_, Budget(), &judge);
  EXPECT_EQ(decision.reason, Decision::kToldApart);
  EXPECT_GE(decision.best, 2u);
  EXPECT_EQ(decision.samples, 4u);
  judge.gain = 0;
  EXPECT_EQ(ConsequenceEngine(*world_, options).Choose(question_, Budget(), &judge).samples, 4u);
}

TEST_F(Engine, KeepsWholeSamplesIfTheBudgetEndsBetweenThem) {
  const ConsequenceEngine::Options options = GrowingOptions(*world_);
  question_.horizon = 1000000;
  Drawn judge;
  for (const unsigned threads : {1u, 3u}) {
    ConsequenceEngine::Options with_threads = options;
    with_threads.threads = threads;
    ConsequenceEngine engine(*world_, with_threads);
    Budget budget;
    budget.scenario_steps = 5 * 4 * 10 + 30;
    const Decision decision = engine.Choose(question_, budget, &judge);
    EXPECT_EQ(decision.reason, Decision::kBudget);
    EXPECT_TRUE(decision.complete);
    EXPECT_LE(decision.scenario_steps, budget.scenario_steps);
    EXPECT_EQ(decision.samples, 4u);
    EXPECT_EQ(decision.outcomes[2].scores.size(), 4u);
    const Decision replayed = engine.Replay(question_, decision, &judge);
    ExpectSame(replayed, decision);
    EXPECT_EQ(replayed.outcomes[2].scores, decision.outcomes[2].scores);
    budget.scenario_steps = 10;
    EXPECT_FALSE(engine.Choose(question_, budget, &judge).complete);
  }
}

TEST_F(Engine, AvoidsCandidatesThatOftenCollide) {
  ConsequenceEngine::Options options = GrowingOptions(*world_);
  options.most_samples = options.samples = 8;
  question_.horizon = 500000;
  question_.candidates.resize(2);
  class Risky : public Judge {
    bool NeedsWorld() const override { return false; }
    bool WatchSample(const Sighting*, const Sample& sample, SampleResult* result) override {
      result->score = sample.candidate == 1 ? 10 : 1;
      result->collided = sample.candidate == 1 ? sample.number < 2 : sample.number < least;
      return false;
    }

   public:
    uint32_t least = 0;
  } judge;
  const auto best = [&](double max_risk) {
    options.preference.max_risk = max_risk;
    return ConsequenceEngine(*world_, options).Choose(question_, Budget(), &judge).best;
  };
  EXPECT_EQ(best(1), 1u);
  EXPECT_EQ(best(0.25), 1u);
  EXPECT_EQ(best(0.2), 0u);
  judge.least = 3;
  EXPECT_EQ(best(0.2), 1u) << "both are too risky: the one with the lower risk wins";
}

TEST_F(Engine, PrunesLosingActions) {
  ConsequenceEngine engine(*world_);
  Eastward all, bounded;
  bounded.knows_bounds = true;
  const Decision thorough = engine.Choose(question_, Budget(), &all);
  const Decision economical = engine.Choose(question_, Budget(), &bounded);
  EXPECT_EQ(economical.best, thorough.best);
  EXPECT_EQ(economical.outcomes[economical.best].score, thorough.outcomes[thorough.best].score);
  EXPECT_LE(economical.scenario_steps, thorough.scenario_steps);
  EXPECT_EQ(bounded.scored, static_cast<int>(economical.scenario_steps));
}

TEST_F(Engine, KeepsToItsBudget) {
  ConsequenceEngine engine(*world_);
  Eastward judge;
  Budget steps;
  steps.scenario_steps = 60;
  Decision decision = engine.Choose(question_, steps, &judge);
  EXPECT_LE(decision.scenario_steps, 60u);
  EXPECT_FALSE(decision.complete);
  steps.scenario_steps = 1;
  decision = engine.Choose(question_, steps, &judge);
  EXPECT_EQ(decision.rounds, 1u) << "there is always an answer";

  Budget energy;
  double spent = 0;
  energy.joules = 5.5;
  energy.meter = [&] { return spent += 1; };
  decision = engine.Choose(question_, energy, &judge);
  EXPECT_GE(decision.rounds, 1u);
  EXPECT_LE(decision.rounds, 5u);
  EXPECT_GT(decision.joules, 0);

  Budget by_watts;
  by_watts.watts = 1e9;
  by_watts.joules = 1;
  EXPECT_EQ(engine.Choose(question_, by_watts, &judge).rounds, 1u);
}

TEST_F(Engine, FailuresAreNotChosen) {
  class Broken : public Eastward {
    void Begin(World&, size_t candidate) override {
      if (candidate == 2) throw std::runtime_error("broken");
    }
  } judge;
  ConsequenceEngine engine(*world_);
  const Decision decision = engine.Choose(question_, Budget(), &judge);
  EXPECT_EQ(decision.outcomes[2].error, "an exception: broken");
  EXPECT_NE(decision.best, 2u);
}

TEST_F(Engine, FallsBackWithoutHorizonOrCandidates) {
  ConsequenceEngine engine(*world_);
  Eastward judge;
  question_.horizon = 0;
  Decision decision = engine.Choose(question_, Budget(), &judge);
  EXPECT_EQ(decision.best, 0u);
  EXPECT_TRUE(decision.complete);
  question_.candidates.clear();
  question_.horizon = 1000000;
  decision = engine.Choose(question_, Budget(), &judge);
  EXPECT_TRUE(decision.outcomes.empty());
}

/// With the world's own random numbers, the prediction is bit-identical to the later run.
TEST_F(Engine, PredictsItsOwnWorld) {
  ConsequenceEngine::Options options;
  options.watched = {world_->GetModel("r")->GetId()};
  ConsequenceEngine engine(*world_, options);
  Eastward judge;
  question_.seed = 0;
  const Decision decision = engine.Choose(question_, Budget(), &judge);
  const Command& chosen = question_.candidates[decision.best].commands[0];
  auto* robot = dynamic_cast<ModelPosition*>(world_->GetModel("r"));
  robot->SetSpeed(chosen.x, chosen.y, chosen.a);
  for (const Sighting& foreseen : decision.outcomes[decision.best].sightings) {
    world_->Update();
    EXPECT_EQ(robot->GetGlobalPose().x, foreseen.pose.x);
    EXPECT_EQ(robot->GetGlobalPose().a, foreseen.pose.a);
  }
}

}  // namespace
}  // namespace Stg
