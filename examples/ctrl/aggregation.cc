// SPDX-License-Identifier: GPL-2.0-or-later
//
// aggregation: gathers robots without computation (Gauci, Chen, Li, Dodd and Gross, 2014).
//
//   ctrl "aggregation [clear_left=-0.7] [clear_right=-1] [seen_left=1] [seen_right=-1]
//         [speed=0.128] [axle=0.052]"
//
// A robot knows one bit: whether the first ray of its first ranger meets something. Each value of
// the bit has a speed for the left and one for the right wheel, as fractions of `speed` (m/s).
// `axle` is the distance between the wheels, m. With the default numbers, a robot that sees nothing
// drives backwards on a circle, and one that sees something turns clockwise on the spot. Rejects
// models that are not positions, robots without a ranger, and invalid arguments.

#include <string>
#include <vector>

#include "support/set_up.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  const Stg::ModelRanger::Sensor* eye = nullptr;
  double clear_left = -0.7, clear_right = -1, seen_left = 1, seen_right = -1;
  double speed = 0.128, axle = 0.052;
};

void Update(Robot* robot) {
  if (robot->eye->intensities.empty()) return;
  const bool seen = robot->eye->intensities[0] > 0;
  const double left = robot->speed * (seen ? robot->seen_left : robot->clear_left);
  const double right = robot->speed * (seen ? robot->seen_right : robot->clear_right);
  robot->position->SetSpeed((left + right) / 2, 0, (right - left) / robot->axle);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("aggregation", model);
  robot->position = ctrl::RequirePosition("aggregation", model);
  ctrl::RequireArguments("aggregation", *model, args->worldfile,
                         {{"clear_left", &robot->clear_left, -1, 1},
                          {"clear_right", &robot->clear_right, -1, 1},
                          {"seen_left", &robot->seen_left, -1, 1},
                          {"seen_right", &robot->seen_right, -1, 1},
                          {"speed", &robot->speed, 0, 10},
                          {"axle", &robot->axle, 0.001, 10}});
  Stg::ModelRanger* const ranger = ctrl::RequireUnusedRanger("aggregation", model);
  if (ranger->GetSensors().empty())
    ctrl::GiveUp("aggregation", *model, "found a ranger without sensors, expected one ray");
  robot->eye = &ranger->GetSensors()[0];
  ctrl::CallOnUpdateInParallel<Robot, Update>(ranger, robot);
  ranger->Subscribe();
  robot->position->Subscribe();
  return 0;
}
