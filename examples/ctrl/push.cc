// SPDX-License-Identifier: GPL-2.0-or-later
//
// push: pushes a thing to a place together with other robots, without any communication. A robot
// that is behind the thing, seen from the place, pushes; any other one drives around it. Needs
// contacts of outlines and a thing that is pushable. The idea is that of occlusion-based transport
// (Chen, Gauci, Li, Kolling and Gross, 2015), with the true poses instead of a camera.

#include <cmath>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

constexpr double kSpeed = 0.4;      // m/s
constexpr double kTurn = 1.5;       // rad/s
constexpr double kArrived = 0.2;    // m, of the thing from its place
constexpr double kClearance = 0.5;  // m, around the thing while a robot drives around it

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::Model* thing = nullptr;
  double x = 0, y = 0;  // the place, m
};

/// Turns towards a direction and drives when facing it.
void DriveTowards(Stg::ModelPosition* position, double x, double y) {
  const double error = Stg::normalize(Stg::ArcTangent(y, x) - position->GetGlobalPose().a);
  position->SetSpeed(std::fabs(error) < 0.5 ? kSpeed : 0, 0,
                     Stg::constrain(3 * error, -kTurn, kTurn));
}

bool Touches(const Robot& robot) {
  bool touches = false;
  robot.position->ForEachContact(
      [&](const Stg::ContactPoint& contact) { touches |= contact.b == robot.thing; });
  return touches;
}

void Update(Robot* robot) {
  const Stg::Pose thing = robot->thing->GetGlobalPose(), here = robot->position->GetGlobalPose();
  const double home_x = robot->x - thing.x, home_y = robot->y - thing.y;
  const double distance = Stg::Hypotenuse(home_x, home_y);
  if (distance < kArrived) return robot->position->Stop();
  // The robot's place in a frame at the thing whose first axis points home.
  const double ux = home_x / distance, uy = home_y / distance;
  const double dx = here.x - thing.x, dy = here.y - thing.y;
  const double ahead = dx * ux + dy * uy, left = dy * ux - dx * uy;
  const double half = robot->thing->GetGeom().size.x / 2;
  if (ahead < -half * 0.8 && std::fabs(left) < half) {
    // Pushes home, and a little towards the middle of the thing's back. A robot that others keep
    // from the thing drives outwards instead, past them.
    const bool waits = robot->position->Stalled() && !Touches(*robot);
    const double sideways = waits ? (left < 0 ? -3 : 3) : -0.3 * left / half;
    return DriveTowards(robot->position, ux - sideways * uy, uy + sideways * ux);
  }
  // Drives to the nearer side of the thing first, then back beside it, and then behind it.
  const double around = (left < 0 ? -1 : 1) * (half + kClearance);
  double aim_ahead = -half - kClearance, aim_left = 0;
  if (ahead > -half - 0.1) {
    aim_left = around;
    if (std::fabs(left) < half + kClearance / 2) aim_ahead = ahead;
  }
  const double to_ahead = aim_ahead - ahead, to_left = aim_left - left;
  DriveTowards(robot->position, to_ahead * ux - to_left * uy, to_ahead * uy + to_left * ux);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("push", model);
  robot->position = ctrl::RequirePosition("push", model);
  const std::vector<std::string> words = ctrl::SplitWords(args->worldfile);
  if (words.size() != 4 || !ctrl::ReadNumber(words[2], {"x", &robot->x, -1e6, 1e6}) ||
      !ctrl::ReadNumber(words[3], {"y", &robot->y, -1e6, 1e6}))
    ctrl::GiveUp("push", *model,
                 "found \"" + args->worldfile +
                     "\", expected the name of a model and a place in metres, as in "
                     "\"push box 4 0\"");
  robot->thing = model->GetWorld()->GetModel(words[1]);
  if (!robot->thing)
    ctrl::GiveUp("push", *model,
                 "found no model called \"" + words[1] + "\", expected one to push");
  ctrl::CallOnUpdate<Robot, Update>(model, robot);
  model->Subscribe();
  return 0;
}
