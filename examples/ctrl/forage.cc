// SPDX-License-Identifier: GPL-2.0-or-later
//
// forage: looks for food, carries it to the nest, and leaves a trail on the way, which others
// follow.
//
//   ctrl "forage [x=0] [y=0] [radius=0.3] [speed=0.2] [turn=2.0] [noise=0.2]"
//
// x, y and radius are the nest's, in metres and in the frame of the estimated pose. Uses the first
// ground sensor with two points or more, of which the first one is on the left, to smell trails,
// and the first one with a single point, which reads above 0 where there is food. A robot with food
// drives home and deposits with the deposit_rate that the first sensor has in the world file. One
// without food follows trails away from the nest, and drives about at random where it smells none:
// noise is the random part of turns, from 0 to 1.

#include <cmath>

#include "geometry/trigonometry.hh"
#include "support/set_up.hh"

namespace {

constexpr double kWeak = 0.02;  // weaker trails do not count

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelGroundSensor *nose = nullptr, *belly = nullptr;
  double x = 0, y = 0, radius = 0.3, speed = 0.2, turn = 2.0, noise = 0.2;
  double rate = 0;  // of deposits with food
  bool has_food = false;

  void ExchangeState(Stg::StateExchange& exchange) { exchange(has_food); }
};

/// Returns how a robot without food turns, from -1 to 1. `home` is the bearing of the nest.
double Search(const std::vector<double>& smell, double home, double noise, double random) {
  const double sum = smell[0] + smell[1];
  if (sum < kWeak) return noise * random;
  if (std::fabs(home) < M_PI / 2) return home < 0 ? 1 : -1;
  return (1 - noise) * (smell[0] - smell[1]) / sum + noise * random;
}

void Update(Robot* robot) {
  const std::vector<double>&smell = robot->nose->GetValues(), &taste = robot->belly->GetValues();
  if (smell.size() < 2 || taste.empty()) return;
  const Stg::Pose here = robot->position->est_pose;
  const double dx = robot->x - here.x, dy = robot->y - here.y;
  if (Stg::Hypotenuse(dx, dy) < robot->radius)
    robot->has_food = false;
  else if (taste[0] > 0)
    robot->has_food = true;
  robot->nose->SetDepositRate(robot->has_food ? robot->rate : 0);
  const double home = Stg::normalize(Stg::ArcTangent(dy, dx) - here.a);
  const double random = robot->position->random().Uniform(-1, 1);
  double turn =
      robot->has_food ? home + robot->noise * random : Search(smell, home, robot->noise, random);
  if (robot->position->Stalled()) turn = 1;  // all evade to the same side
  robot->position->SetSpeed(robot->speed, 0, robot->turn * Stg::constrain(turn, -1, 1));
}

/// Returns the first ground sensor with so many points, or with more if there may be.
Stg::ModelGroundSensor* RequireSensor(const Stg::Model& model, size_t least, size_t most) {
  const auto fits = [&](const Stg::ModelGroundSensor& sensor) {
    return sensor.points().size() >= least && sensor.points().size() <= most;
  };
  if (auto* const found = ctrl::FindChildOfType<Stg::ModelGroundSensor>(model, fits)) return found;
  ctrl::GiveUp("forage", model,
               "found no ground sensor with two points, or none with one, expected both");
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("forage", model);
  robot->position = ctrl::RequirePosition("forage", model);
  ctrl::RequireArguments("forage", *model, args->worldfile,
                         {{"x", &robot->x, -1e6, 1e6},
                          {"y", &robot->y, -1e6, 1e6},
                          {"radius", &robot->radius, 0, 1e6},
                          {"speed", &robot->speed, 0, 10},
                          {"turn", &robot->turn, 0, 10},
                          {"noise", &robot->noise, 0, 1}});
  robot->nose = RequireSensor(*model, 2, 10000);
  robot->belly = RequireSensor(*model, 1, 1);
  robot->rate = robot->nose->deposit_rate();
  robot->nose->SetDepositRate(0);
  ctrl::CallOnUpdateInParallel<Robot, Update>(model, robot);
  robot->nose->Subscribe();
  robot->belly->Subscribe();
  robot->position->Subscribe();
  return 0;
}
