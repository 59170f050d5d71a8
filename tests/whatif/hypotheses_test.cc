// SPDX-License-Identifier: GPL-2.0-or-later
//
// Hypotheses of how others behave that need controllers, rules or several kinds of models, and
// judges that score whole futures.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "messages/report.hh"
#include "stage.hh"
#include "support/belief_fixture.hh"
#include "support/device.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

constexpr char kRanger[] = "ranger( pose [0 0 -1.5 0] sensor( range [0 3] fov 360 samples 36 ) )";

/// Moves everybody with a velocity, and checks what it is told.
class Drift : public BehaviourRule {
 public:
  explicit Drift(const Velocity& velocity) : velocity_(velocity) {}
  void Move(const Moment* moments, size_t count, size_t others, Velocity* velocities) override {
    calls++;
    for (size_t i = 0; i < count; i++) {
      EXPECT_LE(moments[i].own, others);
      EXPECT_GE(moments[i].own, 1u);
      EXPECT_NEAR(moments[i].time, 0.1 * (calls - 1), 1e-9);
      velocities[i] = velocity_;
    }
    seen.assign(moments[0].seen, moments[0].seen + 1 + others);
    id = moments[0].id;
  }

  int calls = 0;
  uint64_t id = 0;
  std::vector<Sighting> seen;

 private:
  const Velocity velocity_;
};

/// Does what GoalJudge does, from whole futures.
class LateJudge : public Judge {
 public:
  LateJudge() : judge_(5, 0, 0.2) {}
  bool NeedsWorld() const override { return false; }
  bool ScoresFutures() const override { return true; }
  void BeginDecision(const DecisionTask& task) override {
    watched_ = task.watched;
    judge_.BeginDecision(task);
  }
  void ScoreFutures(const Future* futures, size_t count, SampleResult* results) override {
    calls++;
    for (size_t i = 0; i < count; i++)
      for (uint64_t step = 0; step < futures[i].steps; step++)
        if (judge_.WatchSample(futures[i].sightings + step * watched_, futures[i].sample,
                               &results[i]))
          break;
  }

  int calls = 0;

 private:
  GoalJudge judge_;
  size_t watched_ = 0;
};

class HypothesesTest : public BeliefFixture {
 protected:
  /// The pose of the other with this number in the last step of the first sample of a plan.
  static Pose LastOf(const Decision& decision, size_t other, size_t plan = 0) {
    const std::vector<Sighting>& seen = decision.outcomes[plan].sightings;
    const size_t watched = seen.size() / decision.outcomes[plan].steps;
    return seen[seen.size() - watched + 1 + other].pose;
  }
};

TrackedOther OtherAt(uint64_t id, const Pose& pose, const Behaviour& behaviour) {
  TrackedOther other(id);
  other.pose = pose;
  other.behaviours = {behaviour};
  return other;
}

void ExpectSameInAll(const Decision& a, const Decision& b) {
  ExpectSame(a, b);
  ExpectSameSightings(a, b);
}

TEST_F(HypothesesTest, RulesMoveOthersInTheFrameOfTheWorldFile) {
  Belief belief(file_, "r");
  const auto drift = std::make_shared<Drift>(Velocity(0.3, -0.2, 0, 0));
  ASSERT_TRUE(belief.SetOther(OtherAt(8, Pose(-3, 2, 0, 1.2), Behaviour(drift))));
  ASSERT_TRUE(belief.SetOther(OtherAt(3, Pose(-3, 5, 0, 0), Behaviour(Behaviour::kStand))));
  const Decision decision = Choose(&belief, OptionsWith(1));
  ASSERT_EQ(decision.error, "");
  const Pose last = LastOf(decision, 1);
  EXPECT_NEAR(last.x, -3 + 4 * 0.3, 1e-9);
  EXPECT_NEAR(last.y, 2 - 4 * 0.2, 1e-9);
  EXPECT_EQ(LastOf(decision, 0).x, -3);
  EXPECT_EQ(LastOf(decision, 0).y, 5);
  EXPECT_EQ(drift->calls, 40);
  EXPECT_EQ(drift->id, 8u);
  ASSERT_EQ(drift->seen.size(), 3u);
  EXPECT_NEAR(drift->seen[2].pose.x, -3 + 3.9 * 0.3, 1e-9);
}

/// Goes to where the robot is.
class Chase : public BehaviourRule {
  void Move(const Moment* moments, size_t count, size_t, Velocity* velocities) override {
    for (size_t i = 0; i < count; i++) {
      const Pose &robot = moments[i].seen[0].pose, &own = moments[i].seen[moments[i].own].pose;
      const double x = robot.x - own.x, y = robot.y - own.y, far = Hypotenuse(x, y);
      velocities[i] = Velocity(x / far, y / far, 0, 0);
    }
  }
};

TEST_F(HypothesesTest, RulesSeeTheRobotOfTheirSample) {
  Belief belief(file_, "r");
  belief.SetOther(OtherAt(1, Pose(1, 3, 0, 0), Behaviour(std::make_shared<Chase>())));
  question_.horizon = 6000000;
  const Decision decision = Choose(&belief, OptionsWith(1));
  for (const Outcome& outcome : decision.outcomes) EXPECT_EQ(outcome.CollisionRisk(), 1);
  EXPECT_LT(decision.outcomes[0].steps, 60u) << "a collision ends a sample";
}

TEST_F(HypothesesTest, ARuleThatMovesSomebodyWithANumberThatIsNotFiniteIsAnError) {
  Belief belief(file_, "r");
  belief.SetOther(
      OtherAt(1, Pose(1, 3, 0, 0), Behaviour(std::make_shared<Drift>(Velocity(NAN, 0, 0, 0)))));
  EXPECT_NE(Choose(&belief, OptionsWith(1)).error.find("not finite"), std::string::npos);
}

class Thrower : public BehaviourRule {
  void Move(const Moment*, size_t, size_t, Velocity*) override { throw std::bad_alloc(); }
};

TEST_F(HypothesesTest, AnEngineGoesOnAfterARuleHasThrown) {
  Belief belief(file_, "r");
  belief.SetOther(OtherAt(1, Pose(-1, 3, 0, 0), Behaviour(std::make_shared<Thrower>())));
  BeliefEngine engine(&belief, OptionsWith(3));
  GoalJudge judge(5, 0, 0.2);
  EXPECT_THROW(engine.Choose(question_, Budget(), &judge), std::bad_alloc);
  belief.SetOther(OtherAt(1, Pose(-1, 3, 0, 0), Behaviour(Behaviour::kStand)));
  const Decision wanted = Choose(&belief, OptionsWith(3));
  const Decision found = engine.Choose(question_, Budget(), &judge);
  for (size_t plan = 0; plan < wanted.outcomes.size(); plan++)
    EXPECT_EQ(found.outcomes[plan].scores, wanted.outcomes[plan].scores);
}

/// A controller moves others as it does in a World, bit for bit.
TEST_F(HypothesesTest, ControllersMoveOthersAsInAWorld) {
  Belief belief(file_, "r");
  const std::string goal = "stage/goal x=-4 y=2 speed=0.5";
  belief.SetOther(OtherAt(4, Pose(-1, -1, 0, 0.4), Behaviour(goal)));
  const Decision decision = Choose(&belief, OptionsWith(1));
  ASSERT_EQ(decision.error, "");
  const auto world = LoadText(
      std::string(kRobot) +
          "position( name \"a\" alwayson 1 pose [-1 -1 0 22.918311805232928] size [0.5 0.5 1.7] "
          "round 1 drive \"omni\" localization \"gps\" mass 70 velocity_bounds [-10 10 -10 10 0 0 "
          "-573 573] ctrl \"" +
          goal + "\" )\n",
      1);
  Model* const other = world->GetModel("a");
  other->SetPose(Pose(-1, -1, 0, 0.4));
  const size_t watched = decision.outcomes[0].sightings.size() / 40;
  for (size_t step = 0; step < 40; step++) {
    world->Update();
    const Pose& seen = decision.outcomes[0].sightings[step * watched + 1].pose;
    ASSERT_NEAR(seen.x, other->GetPose().x, 1e-9) << step;
    ASSERT_NEAR(seen.y, other->GetPose().y, 1e-9) << step;
  }
  EXPECT_LT(LastOf(decision, 0).x, -1.5);
}

/// Others of several kinds and with several controllers come in the order of their ids.
TEST_F(HypothesesTest, SightingsAreInTheOrderOfIds) {
  Belief::Options options;
  options.kinds = {OtherKind(0.25), OtherKind(0.5), OtherKind(0.1)};
  Belief belief(file_, "r", options);
  for (uint64_t id = 0; id < 9; id++) {
    TrackedOther other(id);
    other.kind = static_cast<uint32_t>((id * 7) % 3);
    other.pose = Pose(-3, 3 * static_cast<double>(id), 0, 0);
    other.behaviours = {Behaviour(Behaviour::kStand)};
    if (id % 2 == 1) other.behaviours = {Behaviour("stage/behaviour kind=0")};
    ASSERT_TRUE(belief.SetOther(other));
  }
  const Decision decision = Choose(&belief, OptionsWith(2));
  ASSERT_EQ(decision.error, "");
  for (size_t id = 0; id < 9; id++)
    EXPECT_EQ(LastOf(decision, id).y, 3 * static_cast<double>(id)) << id;
}

TEST_F(HypothesesTest, KindsHaveTheirSizes) {
  Belief::Options options;
  options.kinds = {OtherKind(0.25), OtherKind(0.6)};
  Belief belief(file_, "r", options);
  question_.plans = {Plan("ahead", Velocity(0.5, 0, 0, 0))};
  const auto risk_of = [&](uint32_t kind, double y) {
    TrackedOther other = OtherAt(1, Pose(1, y, 0, 0), Behaviour(Behaviour::kStand));
    other.kind = kind;
    EXPECT_TRUE(belief.SetOther(other));
    return Choose(&belief, OptionsWith(1)).outcomes[0].CollisionRisk();
  };
  EXPECT_EQ(risk_of(0, 0.40), 1);
  EXPECT_EQ(risk_of(0, 0.52), 0);
  EXPECT_EQ(risk_of(1, 0.52), 1);
  EXPECT_EQ(risk_of(1, 0.75), 1);
  EXPECT_EQ(risk_of(1, 0.87), 0);
}

TEST_F(HypothesesTest, OthersKeepAwayFromWallsThatTheirRangersSee) {
  Write(std::string(kRobot) + "model( name \"wall\" size [0.2 1 2] pose [-3 0.1 0 0] )\n");
  question_.horizon = 10000000;
  const auto end_of = [&](const std::string& body) {
    Belief::Options options;
    options.kinds[0].body = body;
    Belief belief(file_, "r", options);
    belief.SetOther(
        OtherAt(1, Pose(-5, 0, 0, 0), Behaviour(Behaviour::kSocialForce, -1.2, 0, 0.8)));
    const Decision decision = Choose(&belief, OptionsWith(1));
    EXPECT_EQ(decision.error, "");
    return LastOf(decision, 0).x;
  };
  EXPECT_NEAR(end_of(""), -3.35, 0.05) << "he touches the wall";
  EXPECT_LT(end_of(kRanger), -3.6);
}

TEST_F(HypothesesTest, HypothesesThatDoNotFitAreRefused) {
  Belief belief(file_, "r");
  const auto refused = [&](const TrackedOther& other) {
    messages::ErrorTrap trap;
    EXPECT_FALSE(belief.SetOther(other));
    EXPECT_TRUE(belief.others().empty());
    return trap.Last("nothing was said");
  };
  EXPECT_NE(refused(OtherAt(1, Pose(), Behaviour("stage/nothing"))).find("stage/nothing"),
            std::string::npos);
  EXPECT_NE(refused(OtherAt(1, Pose(), Behaviour(""))).find("no controller"), std::string::npos);
  EXPECT_NE(refused(OtherAt(1, Pose(), Behaviour("a\" )"))).find("no controller"),
            std::string::npos);
  EXPECT_NE(
      refused(OtherAt(1, Pose(), Behaviour(std::shared_ptr<BehaviourRule>()))).find("no rule"),
      std::string::npos);
  TrackedOther of_no_kind(1);
  of_no_kind.kind = 1;
  EXPECT_NE(refused(of_no_kind).find("kind 1"), std::string::npos);
  EXPECT_EQ(Choose(&belief, OptionsWith(1)).error, "");
}

/// A plug-in with callbacks cannot be kept in rows: the decision says so, until it is forgotten.
TEST_F(HypothesesTest, ControllersThatAreNoBatchControllersAreErrors) {
  Belief::Options options;
  options.kinds[0].body = kRanger;
  Belief belief(file_, "r", options);
  BeliefEngine engine(&belief, OptionsWith(2));
  GoalJudge judge(5, 0, 0.2);
  ASSERT_TRUE(belief.SetOther(OtherAt(1, Pose(-2, 0, 0, 0), Behaviour("wander"))));
  const std::string error = engine.Choose(question_, Budget(), &judge).error;
  EXPECT_NE(error.find("futures cannot be simulated in rows, because"), std::string::npos) << error;
  ASSERT_TRUE(belief.RemoveOther(1));
  EXPECT_EQ(engine.Choose(question_, Budget(), &judge).error, "");
}

/// A crowd of all kinds of behaviours.
void FillCrowd(Belief* belief, uint64_t seed) {
  RandomStream random(seed);
  belief->ClearOthers();
  belief->SetRobot(Pose(0, 0, 0, 0.1), Velocity(0.2, 0, 0, 0), Covariance(0.05, 0.05, 0.02));
  const uint32_t count = 1 + random.Choose(9);
  const auto drift = std::make_shared<Chase>();
  for (uint32_t id = 0; id < count; id++) {
    TrackedOther other(7 * id);
    other.kind = random.Choose(2);
    other.pose = Pose(6 * random.Uniform() - 3, 6 * random.Uniform() - 3, 0, random.Uniform());
    other.velocity = Velocity(random.Uniform() - 0.5, random.Uniform() - 0.5, 0, 0);
    other.pose_covariance = Covariance(0.1, 0.1, 0.1);
    const std::vector<Behaviour> all = {Behaviour(Behaviour::kStand),
                                        Behaviour(Behaviour::kGoOn),
                                        Behaviour(Behaviour::kGoTo, 1, 1, 0.5),
                                        Behaviour(Behaviour::kSocialForce, -1, 1, 0.5),
                                        Behaviour(Behaviour::kOrca, 1, -1, 0.5),
                                        Behaviour("stage/goal x=-2 y=1"),
                                        Behaviour("stage/pedestrian x=2 y=1", 2),
                                        Behaviour(drift)};
    for (uint32_t i = 1 + random.Choose(4); i > 0; i--)
      other.behaviours.push_back(all[random.Choose(8)]);
    ASSERT_TRUE(belief->SetOther(other));
  }
}

TEST_F(HypothesesTest, DecisionsAreTheSameInAnyWayOfSimulatingThem) {
  Belief::Options of_belief;
  of_belief.kinds = {OtherKind(0.25, 1.7, 2), OtherKind(0.4, 1.7, 2)};
  Belief belief(file_, "r", of_belief);
  BeliefEngine::Options options = OptionsWith(6);
  options.most_samples = 24;
  BeliefEngine engine(&belief, options);
  options.threads = 3;
  BeliefEngine parallel(&belief, options);
  options.device_steps = true;
  const bool has_device = device::WhyNone().empty();
  std::unique_ptr<BeliefEngine> on_device;
  if (has_device) on_device = std::make_unique<BeliefEngine>(&belief, options);
  GoalJudge judge(5, 0, 0.2);
  LateJudge late;
  int collisions = 0;
  for (uint64_t seed = 1; seed <= 8; seed++) {
    FillCrowd(&belief, seed);
    const Decision wanted = engine.Choose(question_, Budget(), &judge);
    ASSERT_EQ(wanted.error, "");
    for (const Outcome& outcome : wanted.outcomes)
      for (const uint8_t collided : outcome.collided) collisions += collided;
    ExpectSameInAll(parallel.Choose(question_, Budget(), &judge), wanted);
    ExpectSameInAll(engine.Replay(question_, wanted, &judge), wanted);
    if (has_device) ExpectSameInAll(on_device->Choose(question_, Budget(), &judge), wanted);
    const Decision whole = parallel.Choose(question_, Budget(), &late);
    for (size_t plan = 0; plan < wanted.outcomes.size(); plan++) {
      EXPECT_EQ(whole.outcomes[plan].scores, wanted.outcomes[plan].scores) << seed;
      EXPECT_EQ(whole.outcomes[plan].collided, wanted.outcomes[plan].collided) << seed;
    }
    EXPECT_EQ(whole.best, wanted.best);
  }
  EXPECT_GT(collisions, 60);
  EXPECT_GT(late.calls, 8) << "some decisions need more samples";
  if (!has_device) GTEST_SKIP() << device::WhyNone();
  EXPECT_GT(on_device->steps_on_device(), 0u);
}

/// A decision that the budget ends shows the futures so far.
TEST_F(HypothesesTest, JudgesOfFuturesScoreWhatABudgetAllows) {
  Belief belief(file_, "r");
  Budget budget;
  budget.scenario_steps = 3 * 2 * 20;
  BeliefEngine engine(&belief, OptionsWith(2));
  LateJudge judge;
  const Decision decision = engine.Choose(question_, budget, &judge);
  EXPECT_FALSE(decision.complete);
  EXPECT_EQ(decision.steps, 20u);
  EXPECT_NEAR(decision.outcomes[1].score, -(5 - 0.05 * 10.5) / 2, 1e-9);
}

}  // namespace
}  // namespace Stg
