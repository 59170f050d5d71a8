// SPDX-License-Identifier: GPL-2.0-or-later
//
// trail: follows what robots have left in a field.
//
//   ctrl "trail [speed=0.2] [turn=2.0] [noise=0.5]"
//
// Uses the first ground sensor with two points or more that the robot carries: the first point is
// the left one. speed is the forward speed (m/s), turn the maximum turn speed (rad/s), and noise
// its random part, from 0 to 1. A robot that is stopped turns away. What robots leave is a matter
// of the world file: see deposit_rate. Rejects models that are not positions, robots without such a
// sensor, and invalid arguments.

#include <cmath>

#include "support/set_up.hh"

namespace {

/// Values that are small beside this one do not count.
constexpr double kWeak = 0.01;

struct Robot {
  Stg::ModelPosition* position = nullptr;
  const Stg::ModelGroundSensor* nose = nullptr;
  double speed = 0.2, turn = 2.0, noise = 0.5;
};

void Update(Robot* robot) {
  const std::vector<double>& values = robot->nose->GetValues();
  if (values.size() < 2) return;
  const double left = std::fabs(values[0]), right = std::fabs(values[1]);
  const double steer = (left - right) / (left + right + kWeak);
  const double random = robot->position->random().Uniform(-1, 1);
  if (robot->position->Stalled())
    robot->position->SetSpeed(-robot->speed / 2, 0, robot->turn);
  else
    robot->position->SetSpeed(robot->speed, 0,
                              robot->turn * ((1 - robot->noise) * steer + robot->noise * random));
}

Stg::ModelGroundSensor* RequireNose(const Stg::Model& model) {
  const auto fits = [](const Stg::ModelGroundSensor& sensor) {
    return sensor.points().size() >= 2;
  };
  if (auto* const found = ctrl::FindChildOfType<Stg::ModelGroundSensor>(model, fits)) return found;
  ctrl::GiveUp("trail", model, "found no ground sensor with two points, expected one on the robot");
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("trail", model);
  robot->position = ctrl::RequirePosition("trail", model);
  ctrl::RequireArguments("trail", *model, args->worldfile,
                         {{"speed", &robot->speed, 0, 10},
                          {"turn", &robot->turn, 0, 10},
                          {"noise", &robot->noise, 0, 1}});
  Stg::ModelGroundSensor* const nose = RequireNose(*model);
  robot->nose = nose;
  ctrl::CallOnUpdateInParallel<Robot, Update>(nose, robot);
  nose->Subscribe();
  robot->position->Subscribe();
  return 0;
}
