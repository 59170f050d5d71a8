// SPDX-License-Identifier: GPL-2.0-or-later
//
// expand_swarm: drives a small round robot towards open space, where it rests. The robot has a ring
// of twelve infrared sensors; the first looks ahead, the others follow counter-clockwise.

#include "support/expand_rule.hh"

namespace {

constexpr size_t kSensorsNeeded = 12;
constexpr double kClear = 0.5;  // clearance ahead, m; less at the sides
constexpr ctrl::Clearance kClearances[] = {
    {0, kClear},        {1, kClear / 1.5}, {11, kClear / 1.5}, {2, kClear / 3.0},
    {10, kClear / 3.0}, {3, kClear / 5.0}, {9, kClear / 5.0}};
const ctrl::ExpandRule kRule{0.3, kClearances};

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* ring = nullptr;
};

void Update(Robot* robot) {
  const ctrl::Sensors& sensors = robot->ring->GetSensors();
  if (sensors.size() < kSensorsNeeded) return;
  if (const auto drive = ctrl::Expand(sensors, kRule))
    robot->position->SetSpeed(drive->forward, 0, drive->turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  Robot* robot = ctrl::NewRobot<Robot>("expand_swarm", model);
  robot->position = ctrl::RequirePosition("expand_swarm", model);
  robot->ring = ctrl::RequireUnusedRanger("expand_swarm", model);
  if (robot->ring->GetSensors().size() < kSensorsNeeded)
    ctrl::GiveUp("expand_swarm", *model, "found a ranger of fewer than 12 sensors, expected 12");
  ctrl::CallOnUpdate<Robot, Update>(robot->ring, robot);
  robot->ring->Subscribe();
  robot->position->Subscribe();
  return 0;
}
