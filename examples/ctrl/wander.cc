// SPDX-License-Identifier: GPL-2.0-or-later
//
// wander: drives about at random and avoids obstacles.
//
// Uses the first of the robot's children ranger:0 to ranger:15 whose first sensor has more than 8
// samples. Exit status 1: not a position model; 2: no such ranger.

#include <stdlib.h>

#include "support/obstacle_rule.hh"
#include "support/set_up.hh"

namespace {

constexpr int kNamesTried = 16;
constexpr unsigned kFewSamples = 8;  // as many or fewer make no laser

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* laser = nullptr;
  ctrl::ObstacleState state;
};

void Update(Robot* robot) {
  const auto& sensors = robot->laser->GetSensors();
  if (sensors.empty()) return;
  // random() without a seed: the same numbers in every run.
  const auto command = ctrl::AvoidObstacles(sensors[0].ranges, ctrl::ObstacleRule(), &robot->state,
                                            [] { return random(); });
  if (!command) return;
  robot->position->SetXSpeed(command->forward);
  if (command->turn) robot->position->SetTurnSpeed(*command->turn);
}

Stg::ModelRanger* FindLaser(const Stg::Model& model) {
  for (int i = 0; i < kNamesTried; i++) {
    const std::string name = "ranger:" + std::to_string(i);
    auto* ranger = dynamic_cast<Stg::ModelRanger*>(model.GetChild(name));
    const bool good = ranger && !ranger->GetSensors().empty() &&
                      ranger->GetSensors()[0].sample_count > kFewSamples;
    printf("wander: %s: is %s a laser? %s\n", model.Token(), name.c_str(), good ? "yes" : "no");
    if (good) return ranger;
  }
  return nullptr;
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  Robot* robot = ctrl::NewRobot<Robot>();
  robot->position = ctrl::RequirePosition("wander", model);
  robot->position->Subscribe();
  robot->laser = FindLaser(*model);
  if (!robot->laser)
    ctrl::GiveUp("wander", *model,
                 "found none of ranger:0 to ranger:15 with more than 8 samples, expected one", 2);
  ctrl::CallOnUpdate<Robot, Update>(robot->laser, robot);
  robot->laser->Subscribe();
  return 0;
}
