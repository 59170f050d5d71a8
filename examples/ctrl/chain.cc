// SPDX-License-Identifier: GPL-2.0-or-later
//
// chain: robots stand in a row, each within hearing of the next, from a nest to a prey.
//
//   ctrl "chain nest"    the nest
//   ctrl "chain prey"    the prey
//   ctrl "chain [join=0.05] [leave=0.005] [distance=0.7] [speed=0.2] [turn=2.0]"    a robot
//
// Needs a radio. The nest and the members of a chain tell their number in each step: the nest is 0,
// and a robot that joins has the next number after the highest one that it hears. Explorers drive
// along the chain to its end and past it; at `distance` metres from the last member they join with
// the probability `join` in each step, or at once if they hear the prey. The last member leaves
// with the probability `leave` in each step and drives back to the nest, from where it explores
// anew. Members between the nest and the prey know that they are and never leave. The idea is that
// of Nouyan and Dorigo, Chain based path formation in swarms of robots, 2006, with numbers instead
// of colours.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>

#include "geometry/trigonometry.hh"
#include "support/arguments.hh"
#include "support/set_up.hh"

namespace {

constexpr unsigned char kPrey = 255, kHighest = 250;  // numbers in messages
constexpr double kNear = 0.3;                         // m, from the nest: a robot has come back
constexpr double kMargin = 0.9;                       // of the range, where explorers turn back

enum State : uint8_t { kExplores, kIsMember, kReturns, kDeparts, kNest, kPreyItself };

struct Robot {
  Stg::ModelPosition* position = nullptr;
  Stg::ModelRadio* radio = nullptr;
  double join = 0.05, leave = 0.005, distance = 0.7, speed = 0.2, turn = 2.0;
  uint8_t state = kExplores, number = 0, is_connected = 0;

  void ExchangeState(Stg::StateExchange& exchange) {
    exchange(state);
    exchange(number);
    exchange(is_connected);
  }
};

using Message = Stg::ModelRadio::Message;

unsigned char NumberIn(const Message& message) { return message.data[0]; }

/// Returns the nearest message with a number, or null.
const Message* Find(const Robot& robot, int number) {
  for (const Message& message : robot.radio->Received())
    if (NumberIn(message) == number) return &message;
  return nullptr;
}

/// Returns the nearest of the messages with the highest (1) or lowest (-1) number, or null.
const Message* FindExtreme(const Robot& robot, int sign) {
  const Message* found = nullptr;
  for (const Message& message : robot.radio->Received())
    if (NumberIn(message) <= kHighest &&
        (!found || sign * NumberIn(message) > sign * NumberIn(*found)))
      found = &message;
  return found;
}

/// Drives into a direction, seen from the robot.
void DriveTo(Robot* robot, double bearing) {
  if (robot->position->Stalled())  // all evade to the same side
    return robot->position->SetSpeed(robot->speed, 0, robot->turn);
  const double forward = std::fabs(bearing) < 1 ? robot->speed : 0;
  robot->position->SetSpeed(forward, 0, Stg::constrain(2 * bearing, -robot->turn, robot->turn));
}

void Wander(Robot* robot) { DriveTo(robot, 0.5 * robot->position->random().Uniform(-1, 1)); }

/// Returns the place of a sender in the frame of the receiver.
Stg::point_t PlaceOf(const Message& message) {
  const Stg::SineCosine turn = Stg::SinCos(message.bearing);
  return {message.range * turn.cosine, message.range * turn.sine};
}

/// Returns the direction of a place beyond the end of a chain, from the last two members.
double BearingBeyond(const Message& last, const Message& before, double distance) {
  const Stg::point_t end = PlaceOf(last), from = PlaceOf(before);
  const double dx = end.x - from.x, dy = end.y - from.y;
  const double length = std::max(Stg::Hypotenuse(dx, dy), 1e-9);
  return Stg::ArcTangent(end.y + distance * dy / length, end.x + distance * dx / length);
}

void Join(Robot* robot, const Message& last) {
  robot->state = kIsMember;
  robot->number = static_cast<uint8_t>(NumberIn(last) + 1);
  robot->is_connected = 0;
  robot->position->Stop();
}

void Explore(Robot* robot) {
  const Message* const last = FindExtreme(*robot, 1);
  if (!last || NumberIn(*last) == kHighest) return Wander(robot);
  if (Find(*robot, kPrey)) return Join(robot, *last);
  if (const Message* const before = Find(*robot, NumberIn(*last) - 1))
    return DriveTo(robot, BearingBeyond(*last, *before, robot->distance));
  if (last->range >= robot->distance && robot->position->random().Uniform() < robot->join)
    return Join(robot, *last);
  if (last->range > kMargin * robot->radio->range) return DriveTo(robot, last->bearing);
  Wander(robot);
}

void Stay(Robot* robot) {
  const Message* const next = Find(*robot, robot->number + 1);
  const bool has_connected_next = next && next->data[1];
  robot->is_connected = Find(*robot, kPrey) || has_connected_next;
  const bool leaves =
      !next && !robot->is_connected && robot->position->random().Uniform() < robot->leave;
  if (leaves || !Find(*robot, robot->number - 1)) robot->state = kReturns;
}

/// Drives back along the chain.
void Return(Robot* robot) {
  const Message* const lowest = FindExtreme(*robot, -1);
  if (!lowest) return Wander(robot);
  if (NumberIn(*lowest) == 0 && lowest->range < kNear) robot->state = kDeparts;
  DriveTo(robot, lowest->bearing);
}

/// Drives away from the nest, to explore from there.
void Depart(Robot* robot) {
  const Message* const nest = Find(*robot, 0);
  if (!nest || nest->range >= robot->distance) robot->state = kExplores;
  Wander(robot);
}

void Update(Robot* robot) {
  switch (robot->state) {
    case kExplores:
      Explore(robot);
      break;
    case kIsMember:
      Stay(robot);
      break;
    case kReturns:
      Return(robot);
      break;
    case kDeparts:
      Depart(robot);
      break;
  }
  if (robot->state != kIsMember && robot->state != kNest && robot->state != kPreyItself) return;
  const unsigned char message[] = {robot->number, robot->is_connected};
  robot->radio->Send(message, sizeof message);
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* const robot = ctrl::NewRobot<Robot>("chain", model);
  robot->position = ctrl::RequirePosition("chain", model);
  const std::vector<std::string> words = ctrl::SplitWords(args->worldfile);
  std::string mistake;
  if (words.size() == 2 && words[1] == "nest") {
    robot->state = kNest;
  } else if (words.size() == 2 && words[1] == "prey") {
    robot->state = kPreyItself;
    robot->number = kPrey;
  } else {
    mistake = ctrl::ReadArguments(args->worldfile, {{"join", &robot->join, 0, 1},
                                                    {"leave", &robot->leave, 0, 1},
                                                    {"distance", &robot->distance, 0, 1e6},
                                                    {"speed", &robot->speed, 0, 10},
                                                    {"turn", &robot->turn, 0, 10}});
  }
  if (!mistake.empty()) ctrl::GiveUp("chain", *model, mistake + ", or nest, or prey");
  robot->radio = ctrl::RequireChild<Stg::ModelRadio>("chain", *model, "radio");
  ctrl::CallOnUpdateInParallel<Robot, Update>(model, robot);
  robot->radio->Subscribe();
  robot->position->Subscribe();
  return 0;
}
