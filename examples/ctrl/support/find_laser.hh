// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds the laser among a robot's rangers, for Init() of controllers that drive by laser.

#ifndef EXAMPLES_CTRL_SUPPORT_FIND_LASER_HH
#define EXAMPLES_CTRL_SUPPORT_FIND_LASER_HH

#include "set_up.hh"

namespace ctrl {

/// Returns the first of the children ranger:0 to ranger:15 whose first sensor has more than 8
/// samples. Gives up if there is none.
inline Stg::ModelRanger* RequireLaser(const std::string& controller, const Stg::Model& model) {
  constexpr int kNamesTried = 16;
  constexpr unsigned kFewSamples = 8;  // a laser has more
  for (int i = 0; i < kNamesTried; i++) {
    const std::string name = "ranger:" + std::to_string(i);
    auto* ranger = dynamic_cast<Stg::ModelRanger*>(FindChild(model, name));
    const bool good = ranger && !ranger->GetSensors().empty() &&
                      ranger->GetSensors()[0].sample_count > kFewSamples;
    if (good) return ranger;
  }
  GiveUp(controller, model,
         "found none of ranger:0 to ranger:15 with more than 8 samples, expected one");
}

/// Creates and returns the state of a robot that drives by laser: a struct with the members
/// position and laser. Subscribes to both; kUpdate is called whenever the laser has new data.
template <class Robot, void (*kUpdate)(Robot*)>
Robot* DriveByLaser(const std::string& controller, Stg::Model* model) {
  Robot* robot = NewRobot<Robot>(controller, model);
  robot->position = RequirePosition(controller, model);
  robot->position->Subscribe();
  robot->laser = RequireLaser(controller, *model);
  CallOnUpdate<Robot, kUpdate>(robot->laser, robot);
  robot->laser->Subscribe();
  return robot;
}

}  // namespace ctrl

#endif
