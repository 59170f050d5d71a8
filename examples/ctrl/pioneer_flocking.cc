// SPDX-License-Identifier: GPL-2.0-or-later
//
// pioneer_flocking: a flock of Pioneers, each with eight front sonars and a fiducial finder that
// sees the others. A robot drives to open space and aligns with the heading of its nearest
// neighbour. Rejects models that are not positions, and robots without a ranger of eight sensors or
// without a fiducial finder.

#include "support/expand_rule.hh"
#include "support/foraging.hh"

namespace {

constexpr size_t kSonars = 8;
constexpr double kSafe = 1.0;  // m
// Sonars 3 and 4 look ahead.
constexpr ctrl::Clearance kClearances[] = {{2, kSafe}, {3, kSafe},       {4, kSafe},
                                           {5, kSafe}, {1, kSafe / 2.0}, {6, kSafe / 2.0}};
const ctrl::ExpandRule kRule{0.4, kClearances, 0.3};
constexpr double kFlockGain = 0.3;  // rad/s per rad
constexpr double kMinTurn = 0.1;    // rad/s; a blocked robot that turns less is stuck

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* sonars = nullptr;
  Stg::ModelFiducial* fiducial = nullptr;
  bool has_neighbour = false;
  double neighbour_heading = 0;  // rad, relative to the robot's

  void ExchangeState(Stg::StateExchange& exchange) { exchange(has_neighbour, neighbour_heading); }
};

void LookForNeighbour(Robot* robot) {
  const Stg::ModelFiducial::Fiducial* nearest = nullptr;
  for (const auto& fiducial : robot->fiducial->GetFiducials())
    if (!nearest || fiducial.range < nearest->range) nearest = &fiducial;
  robot->has_neighbour = nearest != nullptr;
  if (nearest) robot->neighbour_heading = nearest->geom.a;
}

void Drive(Robot* robot) {
  const ctrl::Sensors& sensors = robot->sonars->GetSensors();
  if (sensors.size() < kSonars) return;
  auto drive = ctrl::Expand({sensors.data(), kSonars}, kRule);
  if (!drive) return;
  if (drive->forward > 0) {
    if (robot->has_neighbour) drive->turn += kFlockGain * robot->neighbour_heading;
  } else if (std::fabs(drive->turn) < kMinTurn) {
    drive->turn = robot->position->random().Uniform();
  }
  robot->position->SetSpeed(drive->forward, 0, drive->turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  Robot* robot = ctrl::NewRobot<Robot>("pioneer_flocking", model);
  robot->position = ctrl::RequirePosition("pioneer_flocking", model);
  robot->sonars = ctrl::RequireUnusedRanger("pioneer_flocking", model);
  if (robot->sonars->GetSensors().size() < kSonars)
    ctrl::GiveUp("pioneer_flocking", *model, "found a ranger of fewer than 8 sensors, expected 8");
  robot->fiducial = ctrl::RequireUnusedFiducial("pioneer_flocking", model);
  ctrl::CallOnUpdate<Robot, LookForNeighbour>(robot->fiducial, robot);
  ctrl::CallOnUpdate<Robot, Drive>(robot->sonars, robot);
  robot->fiducial->Subscribe();
  robot->sonars->Subscribe();
  robot->position->Subscribe();
  return 0;
}
