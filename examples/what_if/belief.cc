// SPDX-License-Identifier: GPL-2.0-or-later
//
// belief: a robot that is not in the simulator decides, as explained in docs/what-if.md.
//
//   belief examples/what_if/belief.world

#include <cstdio>

#include "stage.hh"

namespace {

/// Tells the belief what a tracker could say.
void Track(Stg::Belief* belief) {
  Stg::TrackedOther other(17);  // the tracker's number
  other.pose = Stg::Pose(2, 0.3, 0, 0);
  other.velocity = Stg::Velocity(-0.5, 0, 0, 0);  // in the frame of the map
  other.pose_covariance = Stg::Covariance(0.1, 0.1, 0);
  other.behaviours = {Stg::Behaviour(Stg::Behaviour::kGoOn, 3),
                      Stg::Behaviour(Stg::Behaviour::kStand, 1)};
  belief->SetOther(other);
}

}  // namespace

int main(int argc, char** argv) {
  Stg::Init(&argc, &argv);
  if (argc != 2) {
    std::fprintf(stderr, "usage: belief WORLD\n");
    return 2;
  }
  Stg::Belief belief(argv[1], "robot");
  if (!belief.IsReady()) return 1;
  belief.SetRobot(Stg::Pose(), Stg::Velocity(0.3, 0, 0, 0), Stg::Covariance(0.05, 0.05, 0.02));
  belief.SetDelay(0.1);  // seconds until it obeys a command
  Track(&belief);

  Stg::BeliefEngine::Options options;
  options.samples = 100;
  options.preference.max_risk = 0.1;
  Stg::BeliefEngine engine(&belief, options);
  Stg::BeliefQuestion question;
  question.plans = {Stg::Plan("stop"), Stg::Plan("ahead", Stg::Velocity(0.5, 0, 0, 0)),
                    Stg::Plan("right", Stg::Velocity(0.5, 0, 0, -0.2))};
  Stg::GoalJudge judge(5, 0, 0.2);  // the goal, and the robot's radius
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
