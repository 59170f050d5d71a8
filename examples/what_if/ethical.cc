// SPDX-License-Identifier: GPL-2.0-or-later
//
// ethical: a robot keeps somebody from a hole by getting in his way, as explained in
// docs/what-if.md. The experiment is that of Winfield, Blum and Liu: Towards an ethical robot,
// TAROS 2014.
//
//   ethical examples/what_if/belief.world

#include <cstdio>
#include <string>

#include "stage.hh"

namespace {

const Stg::Pose kHole(2, 0, 0, 0);
constexpr double kHoleRadius = 0.5;  // m

/// Scores a future by the errand of the robot, and by what happens to the other.
class EthicalJudge : public Stg::Judge {
 public:
  bool NeedsWorld() const override { return false; }
  void BeginDecision(const Stg::DecisionTask& task) override {
    share_ = 1.0 / static_cast<double>(task.steps);
    errand_.BeginDecision(task);
  }
  bool WatchSample(const Stg::Sighting* watched, const Stg::Sample& sample,
                   Stg::SampleResult* result) override {
    const Stg::Pose& human = watched[1].pose;
    if (Stg::Hypotenuse(human.x - kHole.x, human.y - kHole.y) < kHoleRadius)
      result->score -= 100 * share_;  // for each step that he is in it
    errand_.WatchSample(watched, sample, result);
    return result->collided;  // not at the goal: he may fall later
  }

 private:
  Stg::GoalJudge errand_{3, -1.6, 0.2, 10};  // the goal of the robot, its radius, cost of contact
  double share_ = 0;
};

/// Somebody walks towards the hole, which he does not see. He makes way for the robot.
Stg::TrackedOther Human() {
  Stg::TrackedOther human(1);
  human.pose = Stg::Pose(-1.5, 0.1, 0, 0);
  human.velocity = Stg::Velocity(0.4, 0, 0, 0);
  human.pose_covariance = Stg::Covariance(0.03, 0.03, 0);
  human.behaviours = {Stg::Behaviour(Stg::Behaviour::kSocialForce, 6, 0, 0.4)};
  return human;
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: ethical WORLD\n");
    return 2;
  }
  Stg::Belief belief(argv[1], "robot");
  if (!belief.IsReady() || !belief.SetOther(Human())) return 1;
  belief.SetRobot(Stg::Pose(0.5, -1.6, 0, Stg::dtor(90)));
  Stg::BeliefEngine::Options options;
  options.samples = 20;
  Stg::BeliefEngine engine(&belief, options);
  Stg::BeliefQuestion question;
  question.horizon = 10000000;  // us
  question.hold = 1000000;
  const Stg::Velocity right(0, 0, 0, Stg::dtor(-90)), ahead(0.5, 0, 0, 0);
  question.plans = {Stg::Plan("stand"), Stg::Plan("to its goal"), Stg::Plan("between them")};
  question.plans[1].commands = {right, ahead, ahead, ahead, ahead, ahead, Stg::Velocity()};
  question.plans[2].commands = {ahead, ahead, ahead, Stg::Velocity()};
  EthicalJudge judge;
  const Stg::Decision decision = engine.Choose(question, Stg::Budget(), &judge);
  if (!decision.error.empty()) {
    std::fprintf(stderr, "no decision: %s\n", decision.error.c_str());
    return 1;
  }
  for (size_t i = 0; i < question.plans.size(); i++)
    std::printf("%s: score %.2f, risk %.2f%s\n", question.plans[i].name.c_str(),
                decision.outcomes[i].score, decision.outcomes[i].CollisionRisk(),
                i == decision.best ? ", chosen" : "");
  return 0;
}
