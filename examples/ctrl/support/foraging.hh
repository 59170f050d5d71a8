// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shared by the two foraging controllers: obstacle avoidance, flags, and recharging at a charger
// that is identified by its fiducial.

#ifndef EXAMPLES_CTRL_SUPPORT_FORAGING_HH
#define EXAMPLES_CTRL_SUPPORT_FORAGING_HH

#include "obstacle_rule.hh"
#include "set_up.hh"

namespace ctrl {

constexpr int kChargerId = 2;             // fiducial id of chargers
constexpr double kStopChargingAt = 0.95;  // stop charging at this fraction of the capacity
constexpr double kCruiseSpeed = 0.4;      // m/s
constexpr double kDockingRange = 0.5;     // m; closer than this, drive straight into the charger
constexpr double kDockedRange = 0.08;     // m; stop here

/// Foragers look further to the sides than `wander`, and stop earlier.
constexpr ObstacleRule kForagerRule{4, 0.7, 0.5, kCruiseSpeed, 0.05, 0.5, 10};

/// The last sight of a charger.
struct ChargerSight {
  bool seen = false;   ///< visible now
  double bearing = 0;  ///< rad, relative to the robot
  double range = 0;    ///< m
  double heading = 0;  ///< rad, relative to the robot's heading

  void ExchangeState(Stg::StateExchange& exchange) { exchange(seen, bearing, range, heading); }

  void Remember(const Stg::ModelFiducial::Fiducial& charger) {
    seen = true;
    bearing = charger.bearing;
    range = charger.range;
    heading = charger.geom.a;
  }
};

/// Avoids obstacles that the laser sees in the way. Returns false if there are none.
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

/// Creeps into the charger ahead. Stops and returns true once the robot touches it.
inline bool CreepIn(const ChargerSight& charger, double turn, Stg::ModelPosition* position) {
  position->SetTurnSpeed(turn);
  position->SetXSpeed(0.02);
  const bool docked = charger.range < kDockedRange;
  if (docked) position->Stop();
  if (position->Stalled()) position->SetXSpeed(-0.01);  // too close
  return docked;
}

/// Returns the power pack of a forager. Gives up if it has none.
inline Stg::PowerPack* RequirePowerPack(const std::string& controller, const Stg::Model& model) {
  if (Stg::PowerPack* pack = model.FindPowerPack()) return pack;
  GiveUp(controller, model, "found no power pack, expected the property \"joules\"");
}

/// Returns a child that is a ranger. Gives up if there is none of that name.
inline Stg::ModelRanger* RequireRanger(const std::string& controller, const Stg::Model& model,
                                       const std::string& name) {
  if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(FindChild(model, name))) return ranger;
  GiveUp(controller, model, "found no " + name + ", expected a ranger of that name");
}

/// Returns the first fiducial finder that no controller uses yet. Gives up if there is none.
inline Stg::ModelFiducial* RequireUnusedFiducial(const std::string& controller, Stg::Model* model) {
  Stg::Model* found = model->GetUnusedModelOfType("fiducial");
  if (auto* fiducial = dynamic_cast<Stg::ModelFiducial*>(found)) return fiducial;
  GiveUp(controller, *model, "found no fiducial that is not in use, expected one on the robot");
}

/// Returns a model of the world by name. Gives up if there is none.
inline Stg::Model* RequireModel(const std::string& controller, const Stg::Model& model,
                                const std::string& name) {
  if (Stg::Model* found = model.GetWorld()->GetModel(name)) return found;
  GiveUp(controller, model, "found no model called \"" + name + "\" in the world, expected one");
}

}  // namespace ctrl

#endif
