// SPDX-License-Identifier: GPL-2.0-or-later
//
// wander_accel: as wander, but commands accelerations, which the robot's acceleration bounds limit.
//
// Uses the first of the robot's children ranger:0 to ranger:15 whose first sensor has more than 8
// samples. Refuses models that are no positions, and robots without such a ranger.

#include "support/find_laser.hh"
#include "support/obstacle_rule.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* laser = nullptr;
  ctrl::ObstacleState state;
  double turn = 0;  // rad/s, wanted
};

void Update(Robot* robot) {
  const auto& sensors = robot->laser->GetSensors();
  if (sensors.empty()) return;
  const auto command = ctrl::AvoidObstacles(sensors[0].ranges, ctrl::ObstacleRule(), &robot->state,
                                            ctrl::DrawFrom(robot->position));
  if (!command) return;
  if (command->turn) robot->turn = *command->turn;
  // What it takes to have the wanted speeds after one update.
  const double seconds = static_cast<double>(robot->position->GetUpdateInterval()) / Stg::million;
  const Stg::Velocity now = robot->position->GetVelocity();
  robot->position->SetAcceleration((command->forward - now.x) / seconds, 0,
                                   (robot->turn - now.a) / seconds);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  ctrl::DriveByLaser<Robot, Update>("wander_accel", model);
  return 0;
}
