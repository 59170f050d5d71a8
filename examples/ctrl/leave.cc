// SPDX-License-Identifier: GPL-2.0-or-later
//
// leave: drives through a door and on to a place behind it. A robot that others hinder drives at
// random now and then; otherwise a crowd that meets at a door forms an arch and gets stuck.

#include <cmath>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

constexpr double kSpeed = 0.5, kTurn = 2.0;  // m/s, rad/s
constexpr double kArrived = 0.5;             // m
constexpr unsigned kPatience = 3;  // a hindered robot drives at random in one of so many steps

struct Robot {
  Stg::ModelPosition* position = nullptr;
  double door_x = 0, door_y = 0, place_x = 0, place_y = 0;  // m
};

void Update(Robot* robot) {
  const Stg::Pose here = robot->position->GetGlobalPose();
  const double through_x = robot->place_x - robot->door_x;
  const double through_y = robot->place_y - robot->door_y;
  const bool is_out =
      (here.x - robot->door_x) * through_x + (here.y - robot->door_y) * through_y > 0;
  const double x = (is_out ? robot->place_x : robot->door_x) - here.x;
  const double y = (is_out ? robot->place_y : robot->door_y) - here.y;
  if (is_out && Stg::Hypotenuse(x, y) < kArrived) return robot->position->Stop();
  Stg::RandomStream& random = robot->position->random();
  if (robot->position->Stalled() && random.Choose(kPatience) == 0) {
    const double forward = random.Uniform(-kSpeed, 0);  // drawn in this order by all compilers
    return robot->position->SetSpeed(forward, 0, random.Uniform(-kTurn, kTurn));
  }
  const double error = Stg::normalize(Stg::ArcTangent(y, x) - here.a);
  robot->position->SetSpeed(std::fabs(error) < 1 ? kSpeed : 0, 0,
                            Stg::constrain(4 * error, -kTurn, kTurn));
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("leave", model);
  robot->position = ctrl::RequirePosition("leave", model);
  const std::vector<std::string> words = ctrl::SplitWords(args->worldfile);
  double* const numbers[] = {&robot->door_x, &robot->door_y, &robot->place_x, &robot->place_y};
  bool valid = words.size() == 5;
  for (size_t i = 0; valid && i < 4; i++)
    valid = ctrl::ReadNumber(words[i + 1], {"metres", numbers[i], -1e6, 1e6});
  if (!valid)
    ctrl::GiveUp("leave", *model,
                 "found \"" + args->worldfile +
                     "\", expected the places of a door and of a goal behind it in metres, as in "
                     "\"leave 5 0 9 0\"");
  ctrl::CallOnUpdateInParallel<Robot, Update>(model, robot);
  model->Subscribe();
  return 0;
}
