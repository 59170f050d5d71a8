// SPDX-License-Identifier: GPL-2.0-or-later
//
// wander: drives about at random and avoids obstacles.
//
// Uses the first of the robot's children ranger:0 to ranger:15 whose first sensor has more than 8
// samples. Rejects models that are not positions, and robots without such a ranger.

#include "support/find_laser.hh"
#include "support/obstacle_rule.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* laser = nullptr;
  ctrl::ObstacleState state;

  void ExchangeState(Stg::StateExchange& exchange) { exchange(state); }
};

void Update(Robot* robot) {
  const auto& sensors = robot->laser->GetSensors();
  if (sensors.empty()) return;
  const auto command = ctrl::AvoidObstacles(sensors[0].ranges, ctrl::ObstacleRule(), &robot->state,
                                            ctrl::DrawFrom(robot->position));
  if (!command) return;
  robot->position->SetXSpeed(command->forward);
  if (command->turn) robot->position->SetTurnSpeed(*command->turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  ctrl::DriveByLaser<Robot, Update>("wander", model);
  return 0;
}
