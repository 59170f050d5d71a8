// SPDX-License-Identifier: GPL-2.0-or-later
//
// what_if GOAL_X GOAL_Y [go]: drives to a place (metres) among robots that ignore it.
//
// Twice a second, it tries its present plan and other ways to drive for a second, each for a few
// seconds in a copy of the world. It chooses the one that gets nearest to the goal without a
// collision. The window shows the futures as faint lines: grey for free, red for collisions, blue
// for the chosen one. With `go`, it never asks and always keeps its plan, for comparison.
//
// Uses the first of the robot's children ranger:0 to ranger:15 whose first sensor has more than 8
// samples.

#include <cmath>
#include <memory>
#include <sstream>
#include <vector>

#include "support/find_laser.hh"
#include "support/obstacle_rule.hh"

namespace {

constexpr double kArrived = 0.5;      // m from the goal
constexpr int kUpdatesADecision = 5;  // laser updates per decision, usually 0.1 s each
constexpr int kPlanUpdates = 10;      // duration of a plan
constexpr Stg::usec_t kHorizon = 4000000;
constexpr uint64_t kBudget = 2000;  // steps of all scenarios; equal on every machine
constexpr double kFastest = 0.5;    // m/s
constexpr double kCollision = 10;   // penalty of a collision, m
const char kProperty[] = "what_if.robot";

/// A way to drive for a while.
struct Plan {
  double speed = 0, turn = 0;
  int left = 0;  // remaining updates; 0: go on as now
};

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* laser = nullptr;
  double goal_x = 0, goal_y = 0;
  bool is_predicting = true;
  std::unique_ptr<Stg::ConsequenceEngine> engine;
  // State carried from step to step:
  ctrl::ObstacleState avoidance;
  Plan plan;
  int until_decision = 0;

  void ExchangeState(Stg::StateExchange& exchange) {
    exchange(avoidance, plan.speed, plan.turn, plan.left, until_decision);
  }
  double DistanceFrom(const Stg::Pose& pose) const {
    const double x = goal_x - pose.x, y = goal_y - pose.y;
    return std::sqrt(x * x + y * y);
  }
  double Distance() const { return DistanceFrom(position->GetGlobalPose()); }
};

// ---- driving without prediction -----------------------------------------------------------------

/// Drives towards the goal, and around obstacles.
void KeepPlan(Robot* robot) {
  ctrl::ObstacleRule rule;
  rule.front_distance = 0.8;
  rule.cruise_speed = kFastest;
  const auto command = ctrl::AvoidObstacles(robot->laser->GetSensors()[0].ranges, rule,
                                            &robot->avoidance, ctrl::DrawFrom(robot->position));
  if (!command) return;
  if (command->avoiding) {
    robot->position->SetXSpeed(command->forward);
    if (command->turn) robot->position->SetTurnSpeed(*command->turn);
    return;
  }
  const Stg::Pose pose = robot->position->GetGlobalPose();
  const double bearing = Stg::ArcTangent(robot->goal_y - pose.y, robot->goal_x - pose.x);
  const double error = Stg::normalize(bearing - pose.a);
  robot->position->SetSpeed(std::fabs(error) < 0.8 ? command->forward : 0.1, 0,
                            Stg::constrain(error, -0.8, 0.8));
}

// ---- prediction ---------------------------------------------------------------------------------

std::vector<Plan> Plans() {
  std::vector<Plan> plans = {Plan()};
  for (const double speed : {0.0, 0.25, kFastest})
    for (const double turn : {-1.0, -0.5, 0.0, 0.5, 1.0})
      plans.push_back({speed, turn, kPlanUpdates});
  return plans;
}

/// Scores the progress towards the goal. A collision ends a scenario and is worse than anything
/// else.
class ProgressJudge : public Stg::Judge {
 public:
  ProgressJudge(const Robot& robot, const std::vector<Plan>& plans)
      : robot_(robot),
        plans_(plans),
        distance_(robot.Distance()),
        step_(static_cast<double>(robot.position->GetWorld()->sim_interval) / 1e6 * kFastest) {}

  void Begin(Stg::World& world, size_t candidate) override {
    Stg::Model* const robot = world.FindModel(robot_.position->GetId());
    static_cast<Robot*>(robot->GetProperty(kProperty))->plan = plans_[candidate];
  }
  bool Watch(const Stg::Sighting* watched, size_t, double* score) override {
    const bool collides = watched[0].stalled;
    const double distance = robot_.DistanceFrom(watched[0].pose);
    *score = distance_ - distance - (collides ? kCollision : 0);
    return collides || distance < kArrived;
  }
  Stg::Bounds Outlook(uint64_t steps) const override {
    const double furthest = step_ * static_cast<double>(steps);
    return Stg::Bounds(-furthest - kCollision, furthest);
  }

 private:
  const Robot& robot_;
  const std::vector<Plan>& plans_;
  const double distance_, step_;  // distance to the goal now; maximum distance per step
};

void DrawFuture(Stg::World* world, const Stg::Pose& from, const Stg::Outcome& outcome,
                const Stg::Color& color) {
  Stg::Pose last = from;
  for (const Stg::Sighting& sighting : outcome.sightings) {
    world->RecordLine(last.x, last.y, sighting.pose.x, sighting.pose.y, color);
    last = sighting.pose;
  }
}

void DrawFutures(Stg::World* world, const Stg::Pose& from, const Stg::Decision& decision) {
  const Stg::Color free(0.3, 0.3, 0.3, 0.4), collides(0.9, 0.1, 0.1, 0.4), chosen(0, 0.2, 1, 1);
  world->ClearRays();
  for (const Stg::Outcome& outcome : decision.outcomes)
    DrawFuture(world, from, outcome, outcome.score < -kCollision / 2 ? collides : free);
  DrawFuture(world, from, decision.outcomes[decision.best], chosen);
}

void Decide(Stg::World& world, Robot* robot) {
  if (!robot->engine) {
    Stg::ConsequenceEngine::Options options;
    options.watched = {robot->position->GetId()};
    robot->engine = std::make_unique<Stg::ConsequenceEngine>(world, options);
  }
  const std::vector<Plan> plans = Plans();
  Stg::Question question;
  if (!world.Take(&question.now, Stg::Snapshot::kLean)) return;
  question.candidates.resize(plans.size());
  question.horizon = kHorizon;
  question.seed = 1 + world.UpdateCount();  // the real outcome of random events is unknown
  Stg::Budget budget;
  budget.scenario_steps = kBudget;
  ProgressJudge judge(*robot, plans);
  const Stg::Decision decision = robot->engine->Choose(question, budget, &judge);
  robot->plan = plans[decision.best];
  DrawFutures(&world, robot->position->GetGlobalPose(), decision);
}

// ---- robot --------------------------------------------------------------------------------------

void Update(Robot* robot) {
  if (robot->Distance() < kArrived) return robot->position->Stop();
  Stg::World* const world = robot->position->GetWorld();
  if (robot->is_predicting && !world->IsBranch() && robot->until_decision-- <= 0) {
    robot->until_decision = kUpdatesADecision - 1;
    world->CallAfterStep([robot](Stg::World& now) { Decide(now, robot); });
  }
  if (robot->plan.left <= 0) return KeepPlan(robot);
  robot->plan.left--;
  robot->position->SetSpeed(robot->plan.speed, 0, robot->plan.turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  const std::string name = "what_if";
  std::istringstream words(args->worldfile);
  std::string own_name, how;
  double x = 0, y = 0;
  if (!(words >> own_name >> x >> y))
    ctrl::GiveUp(name, *model, "found no goal, expected \"what_if X Y\"");
  if (words >> how && how != "go")
    ctrl::GiveUp(name, *model,
                 "found \"" + Stg::Printable(how, 30) + "\", expected \"go\" or nothing");
  Robot* const robot = ctrl::DriveByLaser<Robot, Update>(name, model);
  robot->goal_x = x;
  robot->goal_y = y;
  robot->is_predicting = how.empty();
  model->SetProperty(kProperty, robot);
  return 0;
}
