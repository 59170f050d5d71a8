// SPDX-License-Identifier: GPL-2.0-or-later
//
// firefly: flashes together with the others (Mirollo and Strogatz, 1990; Christensen, O'Grady and
// Dorigo, 2009).
//
//   ctrl "firefly [coupling=0.1] [period=4] [flash=0.2] [speed=0.05] [turn=1]"
//
// A robot has a phase, which grows by 1 in each period (s). At 1, it begins again at 0, and the
// light of the robot shines for `flash` (s). In each step in which the light sensor of the robot
// senses a light, the phase grows by `coupling` times itself. So robots that see each other soon
// flash at once. The heading at the beginning is the first phase. Meanwhile the robot drives ahead
// (m/s), and turns while it is stopped (rad/s). Rejects models that are not positions, robots
// without a light or a light sensor, and invalid arguments.

#include <cmath>

#include "support/set_up.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelLight* light = nullptr;
  const Stg::ModelLightSensor* eye = nullptr;
  double coupling = 0.1, period = 4, flash = 0.2, speed = 0.05, turn = 1;
  double step = 0;  // s
  double phase = 0;

  void ExchangeState(Stg::StateExchange& exchange) { exchange(phase); }
};

void Update(Robot* robot) {
  if (robot->eye->GetIntensities().empty()) return;
  robot->phase += robot->step / robot->period;
  if (robot->eye->GetIntensities()[0] > 0) robot->phase += robot->coupling * robot->phase;
  if (robot->phase >= 1) robot->phase = 0;
  robot->light->SetOn(robot->phase < robot->flash / robot->period);
  robot->position->SetSpeed(robot->speed, 0, robot->position->Stalled() ? robot->turn : 0);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("firefly", model);
  robot->position = ctrl::RequirePosition("firefly", model);
  ctrl::RequireArguments("firefly", *model, args->worldfile,
                         {{"coupling", &robot->coupling, 0, 100},
                          {"period", &robot->period, 0.001, 1e6},
                          {"flash", &robot->flash, 0, 1e6},
                          {"speed", &robot->speed, 0, 10},
                          {"turn", &robot->turn, -10, 10}});
  robot->light = ctrl::RequireChild<Stg::ModelLight>("firefly", *model, "light");
  auto* const eye = ctrl::RequireChild<Stg::ModelLightSensor>("firefly", *model, "lightsensor");
  robot->eye = eye;
  robot->step = static_cast<double>(eye->GetUpdateInterval()) / 1e6;
  robot->phase = (model->GetGlobalPose().a + M_PI) / (2 * M_PI);
  ctrl::CallOnUpdateInParallel<Robot, Update>(eye, robot);
  eye->Subscribe();
  robot->position->Subscribe();
  return 0;
}
