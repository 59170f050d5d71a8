// SPDX-License-Identifier: GPL-2.0-or-later
//
// fasr: foraging. Carries flags from the model "source" to the model "sink", and recharges when
// power runs low. It navigates by fixed tables made for one world of 16 m by 16 m.
//
// The robot needs a power pack, a laser ranger:1 and a fiducial finder that sees the charger.
// Rejects robots that lack one of these.

#include "support/fasr_tables.hh"
#include "support/foraging.hh"

namespace {

constexpr double kRechargeBelow = 0.25;  // fraction of the power pack's capacity
constexpr int kWorkUpdates = 20;         // duration of loading or unloading a flag
constexpr unsigned kPayload = 1;         // flags
constexpr double kUndockedRange = 0.3;   // m
const Stg::Pose kSourcePlace(-7, -7, 0, 0), kSinkPlace(7, 7, 0, 0);
constexpr double kNearSource = 2.0, kNearSink = 1.0;  // m

struct Robot {
  enum class Mode { kWork, kDock, kUndock };

  Stg::ModelPosition* position = nullptr;
  Stg::ModelRanger* laser = nullptr;
  Stg::ModelFiducial* fiducial = nullptr;
  Stg::PowerPack* power = nullptr;
  Stg::Model *source = nullptr, *sink = nullptr;
  Mode mode = Mode::kWork;
  ctrl::ObstacleState obstacles;
  ctrl::ChargerSight charger;
  int loading = 0, unloading = 0;  // updates so far

  void ExchangeState(Stg::StateExchange& exchange) {
    exchange(mode, obstacles, charger, loading, unloading);
  }

  bool Hungry() const { return power->ProportionRemaining() < kRechargeBelow; }
  bool Full() const { return power->ProportionRemaining() > ctrl::kStopChargingAt; }
};

// ---- flags

void LoadAndUnload(Robot* robot) {
  const Stg::Pose pose = robot->position->GetPose();
  if (robot->position->GetFlagCount() < kPayload && pose.Distance(kSourcePlace) < kNearSource &&
      ++robot->loading > kWorkUpdates) {
    robot->position->PushFlag(robot->source->PopFlag());
    robot->loading = 0;
  }
  if (pose.Distance(kSinkPlace) < kNearSink && ++robot->unloading > kWorkUpdates) {
    robot->sink->PushFlag(robot->position->PopFlag());
    robot->unloading = 0;
  }
}

void LookForCharger(Robot* robot) {
  robot->charger.seen = false;
  for (const auto& fiducial : robot->fiducial->GetFiducials()) {
    if (fiducial.id != ctrl::kChargerId) continue;
    robot->charger.Remember(fiducial);
    return;
  }
}

// ---- driving

bool Avoid(Robot* robot) {
  return ctrl::AvoidObstaclesInTheWay(*robot->laser, robot->position, &robot->obstacles);
}

ctrl::Errand ErrandOf(const Robot& robot) {
  if (robot.Hungry()) return ctrl::Errand::kRefuel;
  return robot.position->GetFlagCount() > 0 ? ctrl::Errand::kDeliver : ctrl::Errand::kFetch;
}

void Work(Robot* robot) {
  if (Avoid(robot)) return;
  const Stg::Pose pose = robot->position->GetPose();
  const ctrl::Errand errand = ErrandOf(*robot);
  const double goal = ctrl::HeadingFor(errand, pose.x, pose.y);
  if (errand == ctrl::Errand::kRefuel && robot->charger.seen) robot->mode = Robot::Mode::kDock;
  robot->position->SetXSpeed(ctrl::kCruiseSpeed);
  robot->position->SetTurnSpeed(Stg::normalize(goal - pose.a));
}

void Dock(Robot* robot) {
  const ctrl::ChargerSight& charger = robot->charger;
  if (!charger.seen) {
    robot->position->Stop();
    robot->mode = Robot::Mode::kWork;
  } else if (charger.range <= ctrl::kDockingRange) {
    ctrl::CreepIn(charger, charger.bearing, robot->position);
  } else if (!Avoid(robot)) {
    robot->position->SetXSpeed(ctrl::kCruiseSpeed);
    robot->position->SetTurnSpeed(charger.bearing);
  }
  if (robot->Full()) robot->mode = Robot::Mode::kUndock;
}

void Undock(Robot* robot) {
  robot->position->SetXSpeed(robot->charger.range < kUndockedRange ? -0.05 : 0.0);
  if (robot->charger.range > kUndockedRange) robot->mode = Robot::Mode::kWork;
}

void Drive(Robot* robot) {
  switch (robot->mode) {
    case Robot::Mode::kWork:
      return Work(robot);
    case Robot::Mode::kDock:
      return Dock(robot);
    case Robot::Mode::kUndock:
      return Undock(robot);
  }
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs*) {
  Robot* robot = ctrl::NewRobot<Robot>("fasr", model);
  robot->position = ctrl::RequirePosition("fasr", model);
  robot->power = ctrl::RequirePowerPack("fasr", *model);
  robot->laser = ctrl::RequireRanger("fasr", *model, "ranger:1");
  robot->fiducial = ctrl::RequireUnusedFiducial("fasr", model);
  robot->source = ctrl::RequireModel("fasr", *model, "source");
  robot->sink = ctrl::RequireModel("fasr", *model, "sink");
  ctrl::CallOnUpdate<Robot, LoadAndUnload>(robot->position, robot);
  ctrl::CallOnUpdate<Robot, Drive>(robot->laser, robot);
  ctrl::CallOnUpdate<Robot, LookForCharger>(robot->fiducial, robot);
  robot->position->Subscribe();
  robot->laser->Subscribe();
  robot->fiducial->Subscribe();
  return 0;
}
