// SPDX-License-Identifier: GPL-2.0-or-later
//
// transport: a swarm pushes a thing to a light, without communication and places.
//
//   ctrl "transport [distance=1.15] [speed=0.3] [turn=2.0] [restless=0.003]"
//
// Needs a fiducial finder that sees the thing, the only one that has a fiducial_return, and a light
// sensor with one element. A robot drives to the thing. Where the thing hides the light, it goes on
// and pushes; otherwise it drives around the thing at `distance` metres from its middle, on a side
// that it has drawn. A robot that pushes in vain drives around for 5 s, too, with the probability
// `restless` in each step; otherwise robots that push against each other would do so forever. The
// idea is that of Chen, Gauci, Li, Kolling and Gross, Occlusion-based cooperative transport with a
// swarm of miniature mobile robots, 2015.

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "support/set_up.hh"

namespace {

constexpr double kVicinity = 0.5;  // m, beyond `distance`: from there on a robot drives around
constexpr uint32_t kDetour = 50;   // steps that a restless robot drives around
constexpr double kAhead = 0.8;     // rad: a robot drives into directions that are nearer to ahead

struct Robot {
  Stg::ModelPosition* position = nullptr;
  const Stg::ModelFiducial* finder = nullptr;
  const Stg::ModelLightSensor* eye = nullptr;
  double distance = 1.15, speed = 0.3, turn = 2.0, restless = 0.003;
  double side = 1;      // 1: drives around with the thing on the left, -1: on the right
  uint32_t detour = 0;  // steps that it still drives around

  void ExchangeState(Stg::StateExchange& exchange) {
    exchange(side);
    exchange(detour);
  }
};

/// Returns the bearing into which a robot drives around a thing at a range and a bearing.
double Around(const Robot& robot, double range, double bearing) {
  const double inwards = Stg::constrain(2 * (range - robot.distance), -1, 1);
  return Stg::normalize(bearing - robot.side * (M_PI / 2 - 0.8 * inwards));
}

void DrawSide(Robot* robot) { robot->side = robot->position->random().Choose(2) == 0 ? 1 : -1; }

/// True if the robot drives around the thing instead of to it.
bool Evades(Robot* robot, double range, bool sees_light) {
  if (range >= robot->distance + kVicinity) return false;
  if (robot->detour > 0) {
    robot->detour--;
    return true;
  }
  if (!sees_light && robot->position->Stalled() &&
      robot->position->random().Uniform() < robot->restless) {
    DrawSide(robot);
    robot->detour = kDetour;
  }
  return sees_light;
}

void Update(Robot* robot) {
  const std::vector<Stg::ModelFiducial::Fiducial>& found = robot->finder->GetFiducials();
  const std::vector<double>& light = robot->eye->GetIntensities();
  if (found.empty() || light.empty()) return robot->position->Stop();
  const double range = found[0].range, bearing = found[0].bearing;
  const bool evades = Evades(robot, range, light[0] > 0);
  const double aim = evades ? Around(*robot, range, bearing) : bearing;
  robot->position->SetSpeed(std::fabs(aim) < kAhead ? robot->speed : 0, 0,
                            Stg::constrain(2 * aim, -robot->turn, robot->turn));
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("transport", model);
  robot->position = ctrl::RequirePosition("transport", model);
  ctrl::RequireArguments("transport", *model, args->worldfile,
                         {{"distance", &robot->distance, 0, 1e6},
                          {"speed", &robot->speed, 0, 10},
                          {"turn", &robot->turn, 0, 10},
                          {"restless", &robot->restless, 0, 1}});
  auto* const finder =
      ctrl::RequireChild<Stg::ModelFiducial>("transport", *model, "fiducial finder");
  auto* const eye = ctrl::RequireChild<Stg::ModelLightSensor>("transport", *model, "light sensor");
  robot->finder = finder;
  robot->eye = eye;
  DrawSide(robot);
  ctrl::CallOnUpdateInParallel<Robot, Update>(model, robot);
  finder->Subscribe();
  eye->Subscribe();
  model->Subscribe();
  return 0;
}
