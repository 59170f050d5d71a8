// SPDX-License-Identifier: GPL-2.0-or-later
//
// wander_accel: like wander, but commands accelerations within the robot's acceleration bounds.
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
  double turn = 0;  // wanted turn speed, rad/s

  void ExchangeState(Stg::StateExchange& exchange) { exchange(state, turn); }
};

void Update(Robot* robot) {
  const auto& sensors = robot->laser->GetSensors();
  if (sensors.empty()) return;
  const auto command = ctrl::AvoidObstacles(sensors[0].ranges, ctrl::ObstacleRule(), &robot->state,
                                            ctrl::DrawFrom(robot->position));
  if (!command) return;
  if (command->turn) robot->turn = *command->turn;
  // The acceleration that reaches the wanted speeds after one update.
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
