// SPDX-License-Identifier: GPL-2.0-or-later
//
// expand_pioneer: drives a Pioneer with its sonar ring towards open space, where it rests.

#include "support/expand_rule.hh"

namespace {

// Sonars 3 and 4 look ahead; 2 and 5, then 1 and 6, look increasingly sideways.
constexpr ctrl::Clearance kClearances[] = {{3, 0.75},  {4, 0.75},   {2, 0.375},
                                           {5, 0.375}, {1, 0.1875}, {6, 0.1875}};
constexpr size_t kSensorsNeeded = 7;
const ctrl::ExpandRule kRule{0.2, kClearances};

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* sonars = nullptr;
};

void Update(Robot* robot) {
  const ctrl::Sensors& sensors = robot->sonars->GetSensors();
  if (sensors.size() < kSensorsNeeded) return;
  if (const auto drive = ctrl::Expand(sensors, kRule))
    robot->position->SetSpeed(drive->forward, 0, drive->turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  Robot* robot = ctrl::NewRobot<Robot>("expand_pioneer", model);
  robot->position = ctrl::RequirePosition("expand_pioneer", model);
  robot->sonars = ctrl::RequireUnusedRanger("expand_pioneer", model);
  if (robot->sonars->GetSensors().size() < kSensorsNeeded)
    ctrl::GiveUp("expand_pioneer", *model, "found a ranger of fewer than 7 sensors, expected 16");
  model->GetUnusedModelOfType("ranger");  // reserves the laser, so that no other controller uses it
  ctrl::CallOnUpdate<Robot, Update>(robot->sonars, robot);
  robot->sonars->Subscribe();
  robot->position->Subscribe();
  return 0;
}
