// SPDX-License-Identifier: GPL-2.0-or-later
//
// phototaxis: drives to a light, as a vehicle of Braitenberg's with crossed connections (1984).
//
//   ctrl "phototaxis [4] [speed=0.3] [gain=2] [search=0.5]"
//
// Needs a child lightsensor:0 with two elements, left and right. The brighter side makes the wheel
// of the other side turn faster. The robot stops where it is brighter than the number without a
// name, W/m2. speed is the forward speed (m/s), and gain the turn speed for light from one side
// only (rad/s); with a negative gain, connections are not crossed, and the robot turns away.
// Without light it drives in a circle, with the turn speed `search` (rad/s).

#include <string>
#include <vector>

#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelLightSensor* eyes = nullptr;
  double enough = 4.0, speed = 0.3, gain = 2, search = 0.5;
};

void Update(Robot* robot) {
  const std::vector<double>& light = robot->eyes->GetIntensities();
  if (light.size() != 2) return;
  const double sum = light[0] + light[1];
  if (sum >= robot->enough) return robot->position->SetSpeed(0, 0, 0);
  const double turn = sum > 0 ? robot->gain * (light[0] - light[1]) / sum : robot->search;
  robot->position->SetSpeed(robot->speed, 0, turn);
}

/// Reads the arguments, of which the first may be a number without a name. Returns an empty text,
/// or a description of the mistake.
std::string ReadWords(const std::string& text, Robot* robot) {
  std::vector<std::string> words = ctrl::SplitWords(text);
  if (words.size() > 1 && words[1].find('=') == std::string::npos) {
    if (!ctrl::ReadNumber(words[1], {"enough", &robot->enough, 0, 1e6}))
      return "found \"" + words[1] + "\", expected an irradiance in W/m2, as in \"phototaxis 4\"";
    words.erase(words.begin() + 1);
  }
  std::string named;
  for (const std::string& word : words) named += word + " ";
  return ctrl::ReadArguments(named, {{"speed", &robot->speed, 0, 10},
                                     {"gain", &robot->gain, -100, 100},
                                     {"search", &robot->search, -100, 100}});
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("phototaxis", model);
  robot->position = ctrl::RequirePosition("phototaxis", model);
  const std::string mistake = ReadWords(args->worldfile, robot);
  if (!mistake.empty()) ctrl::GiveUp("phototaxis", *model, mistake);
  robot->eyes = dynamic_cast<Stg::ModelLightSensor*>(ctrl::FindChild(*model, "lightsensor:0"));
  if (!robot->eyes || robot->eyes->directions.size() != 2)
    ctrl::GiveUp("phototaxis", *model, "found no lightsensor:0 with two directions, expected one");
  ctrl::CallOnUpdate<Robot, Update>(robot->eyes, robot);
  robot->eyes->Subscribe();
  robot->position->Subscribe();
  return 0;
}
