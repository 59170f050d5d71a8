// SPDX-License-Identifier: GPL-2.0-or-later
//
// stest: a separate program that drives many robots from one callback. A benchmark, and an example
// of using the library without a controller plug-in.
//
//   stest WORLD N
//
// Loads the world and runs it without a window until its quit time, or forever if it has none. The
// robots r0 to r(N-1), each with a ranger ranger:0 of four or more single-ray sensors, drive
// towards open space.

#include <charconv>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/expand_rule.hh"

namespace {

struct Robot {
  Stg::ModelPosition* position;
  Stg::ModelRanger* ranger;
};
typedef std::vector<Robot> Robots;

constexpr size_t kMinSensors = 4;
constexpr double kSpeed = 0.4;         // m/s
constexpr double kClearAhead = 0.1;    // m
constexpr double kClearBeside = 0.02;  // m
constexpr double kAhead = 0.3;         // rad

/// Commands one robot.
void Drive(const Robot& robot) {
  const ctrl::Sensors& sensors = robot.ranger->GetSensors();
  if (sensors.size() < kMinSensors) return;
  const size_t front = sensors.size() / 2 - 1;
  const ctrl::Clearance clearances[] = {
      {front, kClearAhead}, {front - 1, kClearBeside}, {front + 1, kClearBeside}};
  if (const auto drive = ctrl::Expand(sensors, {kSpeed, clearances, 1.0, kAhead}))
    robot.position->SetSpeed(drive->forward, 0, drive->turn);
}

int DriveAll(Stg::World*, void* robots) {
  for (const Robot& robot : *static_cast<Robots*>(robots)) Drive(robot);
  return 0;  // stay registered
}

Robot FindRobot(const Stg::World& world, int number) {
  const std::string name = "r" + std::to_string(number);
  Stg::Model* model = world.GetModel(name);
  if (!model)
    throw std::runtime_error("stest: found no model called \"" + name + "\" in the world");
  Robot robot{ctrl::RequirePosition("stest", model),
              dynamic_cast<Stg::ModelRanger*>(model->GetChild("ranger:0"))};
  if (!robot.ranger || robot.ranger->GetSensors().size() < kMinSensors)
    ctrl::GiveUp("stest", *model, "found no ranger:0 of 4 or more sensors, expected one");
  return robot;
}

}  // namespace

int main(int argc, char* argv[]) {
  if (argc < 3) {
    std::printf("usage: %s WORLD N\n", argv[0]);
    return 0;
  }
  int count = 0;
  const char* end = argv[2] + std::strlen(argv[2]);
  const auto [stop, error] = std::from_chars(argv[2], end, count);
  if (error != std::errc() || stop != end || count < 0) {
    std::fprintf(stderr, "stest: found \"%s\", expected a number of robots\n", argv[2]);
    return 1;
  }

  Stg::Init(&argc, &argv);
  Stg::World world("Stage Benchmark Program");
  if (!world.Load(argv[1])) return world.LoadStatus();
  Robots robots;
  try {
    for (int i = 0; i < count; i++) robots.push_back(FindRobot(world, i));
  } catch (const std::runtime_error& reason) {
    std::fprintf(stderr, "%s\n", Stg::Printable(reason.what(), 200).c_str());
    return 1;
  }
  for (const Robot& robot : robots) {
    robot.position->Subscribe();
    robot.ranger->Subscribe();
  }
  world.AddUpdateCallback(DriveAll, &robots);
  world.Start();
  Stg::World::Run();
  return 0;
}
