// SPDX-License-Identifier: GPL-2.0-or-later
//
// flocking: flies with its neighbours (Reynolds, 1987) with noise (Vicsek, Czirok, Ben-Jacob, Cohen
// and Shochet, 1995).
//
//   ctrl "flocking [align=1] [gather=1] [near=0.4] [noise=0.1] [speed=0.1] [gain=5]"
//
// Robots send their headings by the first radio that they carry, which measures where the sender
// is. A robot turns to the sum of two vectors: `align` times the mean heading of its neighbours and
// itself, and `gather` times the mean of vectors to its neighbours, which point away from those
// nearer than `near` (m). `noise` times a random angle from -pi to pi is added to the direction.
// speed is the forward speed (m/s), gain the turn speed for each radian to turn (1/s). Rejects
// models that are not positions, robots without a radio, and invalid arguments.

#include <cmath>
#include <cstring>

#include "geometry/trigonometry.hh"
#include "support/set_up.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRadio* radio = nullptr;
  double align = 1, gather = 1, near = 0.4, noise = 0.1, speed = 0.1, gain = 5;
};

/// The vector to which a robot turns, in its own frame.
struct Aim {
  double x, y;

  void Add(double weight, double angle) {
    const Stg::SineCosine direction = Stg::SinCos(angle);
    x += weight * direction.cosine;
    y += weight * direction.sine;
  }
};

Aim AimOf(const Robot& robot, double heading) {
  const auto& messages = robot.radio->Received();
  Aim headings{1, 0}, places{0, 0};
  for (const Stg::ModelRadio::Message& message : messages) {
    double other;
    std::memcpy(&other, message.data, sizeof other);
    headings.Add(1, other - heading);
    places.Add(std::fmin(1, (message.range - robot.near) / robot.near), message.bearing);
  }
  const auto count = static_cast<double>(messages.size());
  const double align = robot.align / (count + 1);
  const double gather = count > 0 ? robot.gather / count : 0;
  return {align * headings.x + gather * places.x, align * headings.y + gather * places.y};
}

void Update(Robot* robot) {
  const double heading = robot->position->GetGlobalPose().a;
  const Aim aim = AimOf(*robot, heading);
  double turn = aim.x != 0 || aim.y != 0 ? Stg::ArcTangent(aim.y, aim.x) : 0;
  if (robot->noise > 0)
    turn = Stg::normalize(turn + robot->noise * robot->position->random().Uniform(-M_PI, M_PI));
  robot->position->SetSpeed(robot->speed, 0, robot->gain * turn);
  robot->radio->Send(&heading, sizeof heading);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("flocking", model);
  robot->position = ctrl::RequirePosition("flocking", model);
  ctrl::RequireArguments("flocking", *model, args->worldfile,
                         {{"align", &robot->align, 0, 100},
                          {"gather", &robot->gather, 0, 100},
                          {"near", &robot->near, 0.001, 100},
                          {"noise", &robot->noise, 0, 1},
                          {"speed", &robot->speed, 0, 10},
                          {"gain", &robot->gain, 0, 100}});
  robot->radio = ctrl::RequireChild<Stg::ModelRadio>("flocking", *model, "radio");
  ctrl::CallOnUpdateInParallel<Robot, Update>(robot->radio, robot);
  robot->radio->Subscribe();
  robot->position->Subscribe();
  return 0;
}
