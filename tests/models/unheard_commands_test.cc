// SPDX-License-Identifier: GPL-2.0-or-later
//
// Commands to robots without subscribers have no effect and cause a warning.

#include "support/model_testing.hh"

namespace Stg {
namespace {

constexpr char kLine[] =
    "stage: warning: r: found a command for a robot without subscribers; it has no effect; "
    "Subscribe() to it, or give it alwayson 1 in the world file\n";

struct Robot {
  explicit Robot(const std::string& properties = "")
      : world(LoadText("position( name \"r\" drive \"omni\" " + properties + " )")),
        position(Find<ModelPosition>(*world, "r")) {}
  std::string Steps(int count) {
    return ErrorsOf([&] { Step(*world, count); });
  }
  std::unique_ptr<World> world;
  ModelPosition* position;
};

using Command = std::function<void(ModelPosition&)>;

const Command kCommands[] = {
    [](ModelPosition& r) { r.SetSpeed(1, 0, 0); },
    [](ModelPosition& r) { r.SetSpeed(Velocity(0, 0, 0, 1)); },
    [](ModelPosition& r) { r.SetXSpeed(1); },
    [](ModelPosition& r) { r.SetYSpeed(1); },
    [](ModelPosition& r) { r.SetZSpeed(1); },
    [](ModelPosition& r) { r.SetTurnSpeed(1); },
    [](ModelPosition& r) { r.GoTo(0, 0, 0); },
    [](ModelPosition& r) { r.GoTo(Pose(1, 2, 0, 0)); },
    [](ModelPosition& r) { r.SetAcceleration(1, 0, 0); },
    [](ModelPosition& r) { r.SetVelocity(Velocity(1, 0, 0, 0)); },
    [](ModelPosition& r) { r.SetGlobalVelocity(Velocity(1, 0, 0, 0)); },
};

TEST(UnheardCommand, WarnsOncePerModel) {
  for (const Command& command : kCommands) {
    Robot robot;
    EXPECT_EQ(robot.Steps(1), "");
    command(*robot.position);
    EXPECT_EQ(robot.Steps(1), kLine);
    command(*robot.position);
    EXPECT_EQ(robot.Steps(2), "");
    ExpectPose(robot.position->GetPose(), 0, 0, 0, 0);
  }
}

TEST(UnheardCommand, DoesNotWarnWithSubscribers) {
  for (const Command& command : kCommands) {
    Robot running("alwayson 1"), late;
    command(*running.position);
    EXPECT_EQ(running.Steps(2), "");
    command(*late.position);  // before subscribing, as controllers do in Init()
    late.position->Subscribe();
    EXPECT_EQ(late.Steps(2), "");
  }
}

TEST(UnheardCommand, DoesNotWarnOfZeroSpeed) {
  Robot robot;
  robot.position->Stop();
  robot.position->SetSpeed(0, 0, 0);
  EXPECT_EQ(robot.Steps(2), "");
}

TEST(UnheardCommand, WarnsOfEachRobot) {
  const auto world = LoadText("position( name \"a\" ) position( name \"b\" pose [2 0 0 0] )");
  for (const char* name : {"a", "b"}) Find<ModelPosition>(*world, name)->SetSpeed(1, 0, 0);
  const std::string errors = ErrorsOf([&] { Step(*world, 3); });
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 2) << errors;
  EXPECT_NE(errors.find("warning: a: "), std::string::npos);
  EXPECT_NE(errors.find("warning: b: "), std::string::npos);
}

/// There is no warning for a robot that is deleted before the step.
TEST(UnheardCommand, DoesNotWarnOfDeletedRobots) {
  Robot robot;
  robot.position->SetSpeed(1, 0, 0);
  delete robot.position;
  EXPECT_EQ(robot.Steps(1), "");
}

}  // namespace
}  // namespace Stg
