// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the two foraging controllers share: a robot that is not to run into things, carries flags
// and recharges at a charger, which it knows by its fiducial.

#ifndef EXAMPLES_CTRL_SUPPORT_FORAGING_HH
#define EXAMPLES_CTRL_SUPPORT_FORAGING_HH

#include "obstacle_rule.hh"
#include "set_up.hh"

namespace ctrl {

constexpr int kChargerId = 2;          // the fiducial of chargers
constexpr double kFull = 0.95;         // of the power pack's capacity: stop charging
constexpr double kCruiseSpeed = 0.4;   // m/s
constexpr double kDockingRange = 0.5;  // m: drive straight into the charger from here on
constexpr double kDockedRange = 0.08;  // m: stop

/// Foragers look farther to the sides than `wander` does, and stop earlier.
constexpr ObstacleRule kForagerRule{4, 0.7, 0.5, kCruiseSpeed, 0.05, 0.5, 10};

/// A charger, as it was last seen.
struct ChargerSight {
  bool seen = false;   ///< now
  double bearing = 0;  ///< rad, relative to the robot
  double range = 0;    ///< m
  double heading = 0;  ///< rad, relative to the robot's

  void ExchangeState(Stg::StateExchange& exchange) { exchange(seen, bearing, range, heading); }

  void Remember(const Stg::ModelFiducial::Fiducial& charger) {
    seen = true;
    bearing = charger.bearing;
    range = charger.range;
    heading = charger.geom.a;
  }
};

/// Avoids what the laser sees in the way; false if there is nothing to be avoided.
inline bool AvoidObstaclesInTheWay(const Stg::ModelRanger& laser, Stg::ModelPosition* position,
                                   ObstacleState* state) {
  if (laser.GetSensors().empty()) return false;
  const auto command =
      AvoidObstacles(laser.GetSensors()[0].ranges, kForagerRule, state, DrawFrom(position));
  if (!command || !command->avoiding) return false;
  position->SetXSpeed(command->forward);
  if (command->turn) position->SetTurnSpeed(*command->turn);
  return true;
}

/// Creeps into the charger that is close ahead; true once the robot touches it, where it stops.
inline bool CreepIn(const ChargerSight& charger, double turn, Stg::ModelPosition* position) {
  position->SetTurnSpeed(turn);
  position->SetXSpeed(0.02);
  const bool docked = charger.range < kDockedRange;
  if (docked) position->Stop();
  if (position->Stalled()) position->SetXSpeed(-0.01);  // not that close
  return docked;
}

/// The power pack of a forager. Gives up if it has none.
inline Stg::PowerPack* RequirePowerPack(const std::string& controller, const Stg::Model& model) {
  if (Stg::PowerPack* pack = model.FindPowerPack()) return pack;
  GiveUp(controller, model, "found no power pack, expected the property \"joules\"");
}

/// A child that is a ranger. Gives up if there is none of that name.
inline Stg::ModelRanger* RequireRanger(const std::string& controller, const Stg::Model& model,
                                       const std::string& name) {
  if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(FindChild(model, name))) return ranger;
  GiveUp(controller, model, "found no " + name + ", expected a ranger of that name");
}

/// The first fiducial finder that no controller has taken yet. Gives up if there is none.
inline Stg::ModelFiducial* RequireUnusedFiducial(const std::string& controller, Stg::Model* model) {
  Stg::Model* found = model->GetUnusedModelOfType("fiducial");
  if (auto* fiducial = dynamic_cast<Stg::ModelFiducial*>(found)) return fiducial;
  GiveUp(controller, *model, "found no fiducial that is not in use, expected one on the robot");
}

/// A model of the world by its name. Gives up if there is none.
inline Stg::Model* RequireModel(const std::string& controller, const Stg::Model& model,
                                const std::string& name) {
  if (Stg::Model* found = model.GetWorld()->GetModel(name)) return found;
  GiveUp(controller, model, "found no model called \"" + name + "\" in the world, expected one");
}

}  // namespace ctrl

#endif
