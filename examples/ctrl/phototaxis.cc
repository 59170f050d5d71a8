// SPDX-License-Identifier: GPL-2.0-or-later
//
// phototaxis: drives to a light, as a vehicle of Braitenberg's with crossed connections.
//
// Needs a child lightsensor:0 with two elements, left and right. The brighter side makes the wheel
// of the other side turn faster. The robot stops where it is brighter than the argument, in W/m2.
// Without light it drives in a circle.

#include <string>
#include <vector>

#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

constexpr double kSpeed = 0.3;   // m/s
constexpr double kGain = 2.0;    // rad/s for light from one side only
constexpr double kSearch = 0.5;  // rad/s without light

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelLightSensor* eyes = nullptr;
  double enough = 4.0;
};

void Update(Robot* robot) {
  const std::vector<double>& light = robot->eyes->GetIntensities();
  if (light.size() != 2) return;
  const double sum = light[0] + light[1];
  if (sum >= robot->enough) return robot->position->SetSpeed(0, 0, 0);
  const double turn = sum > 0 ? kGain * (light[0] - light[1]) / sum : kSearch;
  robot->position->SetSpeed(kSpeed, 0, turn);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("phototaxis", model);
  robot->position = ctrl::RequirePosition("phototaxis", model);
  const std::vector<std::string> words = ctrl::SplitWords(args->worldfile);
  if (words.size() > 2 ||
      (words.size() == 2 && !ctrl::ReadNumber(words[1], {"enough", &robot->enough, 0, 1e6})))
    ctrl::GiveUp("phototaxis", *model,
                 "found \"" + args->worldfile +
                     "\", expected an irradiance in W/m2, as in "
                     "\"phototaxis 4\"");
  robot->eyes = dynamic_cast<Stg::ModelLightSensor*>(ctrl::FindChild(*model, "lightsensor:0"));
  if (!robot->eyes || robot->eyes->directions.size() != 2)
    ctrl::GiveUp("phototaxis", *model, "found no lightsensor:0 with two directions, expected one");
  ctrl::CallOnUpdate<Robot, Update>(robot->eyes, robot);
  robot->eyes->Subscribe();
  robot->position->Subscribe();
  return 0;
}
