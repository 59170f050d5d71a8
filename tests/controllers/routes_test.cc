// SPDX-License-Identifier: GPL-2.0-or-later
//
// Robots of stage/pedestrian and stage/orca that go to several goals, and in groups.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "support/model_testing.hh"
#include "support/own_worlds.hh"

namespace Stg {
namespace {

std::unique_ptr<World> LoadWalkers(const std::vector<std::string>& robots) {
  InitLibrary();
  std::string text =
      "contacts \"cells\"\ndefine walker position( size [0.3 0.3 0.3] drive \"omni\" "
      "velocity_bounds [-2 2 -2 2 0 0 -180 180] )\n";
  for (const std::string& robot : robots) text += "walker( " + robot + " )\n";
  auto world = std::make_unique<World>(OptionsOf(1));
  std::istringstream content(text);
  EXPECT_TRUE(world->Load(content, "t.world")) << text;
  return world;
}

std::vector<ModelPosition*> WalkersOf(const World& world) {
  std::vector<ModelPosition*> robots;
  for (Model* model : world.GetChildren())
    if (auto* const robot = dynamic_cast<ModelPosition*>(model)) robots.push_back(robot);
  return robots;
}

/// Steps of 0.1 s until the robot is within 0.4 m of a place; 1000 if it never is.
int StepsTo(World* world, const ModelPosition& robot, double x, double y) {
  int steps = 0;
  while (steps < 1000 && robot.GetPose().Distance(Pose(x, y, 0, 0)) > 0.4) {
    world->Update();
    steps++;
  }
  return steps;
}

class Routes : public testing::TestWithParam<std::string> {};

TEST_P(Routes, GoalsAreVisitedInTheirOrderAndTheLastOneIsKept) {
  const auto world =
      LoadWalkers({"ctrl \"" + GetParam() + " speed=1 goals=4,0,4,3,-1,3\" pose [0 0 0 0]"});
  const ModelPosition& robot = *WalkersOf(*world)[0];
  EXPECT_NEAR(StepsTo(world.get(), robot, 4, 0), 40, 8);
  EXPECT_NEAR(StepsTo(world.get(), robot, 4, 3), 30, 8);
  EXPECT_NEAR(StepsTo(world.get(), robot, -1, 3), 50, 8);
  for (int i = 0; i < 100; i++) world->Update();
  EXPECT_LT(robot.GetPose().Distance(Pose(-1, 3, 0, 0)), 0.3);
}

TEST_P(Routes, ALoopLeadsBackToTheFirstGoal) {
  const auto world =
      LoadWalkers({"ctrl \"" + GetParam() + " speed=1 goals=4,0,0,0 loop=1\" pose [0 0 0 0]"});
  const ModelPosition& robot = *WalkersOf(*world)[0];
  for (int round = 0; round < 3; round++) {
    EXPECT_LT(StepsTo(world.get(), robot, 4, 0), 60) << round;
    EXPECT_LT(StepsTo(world.get(), robot, 0, 0), 60) << round;
  }
}

TEST_P(Routes, ARobotWaitsAtEachGoalButTheLastOne) {
  const auto time_of = [](const std::string& wait) {
    const auto world = LoadWalkers(
        {"ctrl \"" + GetParam() + " speed=1 goals=3,0,6,0,9,0" + wait + "\" pose [0 0 0 0]"});
    return StepsTo(world.get(), *WalkersOf(*world)[0], 9, 0);
  };
  EXPECT_NEAR(time_of(" wait=5") - time_of(""), 100, 12);
}

INSTANTIATE_TEST_SUITE_P(Controllers, Routes, testing::Values("stage/pedestrian", "stage/orca"));

TEST(RoutesAlone, AWaypointIsReachedAtTheDistanceNear) {
  // It turns to the second goal as soon as it is within `near` of the first one.
  for (const double near : {0.5, 2.0}) {
    const auto world =
        LoadWalkers({"ctrl \"stage/orca speed=1 goals=4,0,4,9 near=" + std::to_string(near) +
                     "\" pose [0 0 0 0]"});
    const ModelPosition& robot = *WalkersOf(*world)[0];
    double last = 0;
    for (int i = 0; i < 100 && robot.GetPose().y < 0.01; i++) {
      world->Update();
      if (robot.GetPose().y < 0.01) last = robot.GetPose().x;
    }
    EXPECT_NEAR(4 - last, near, 0.25) << near;
  }
}

// ---- groups ----

/// The greatest distance of two robots from each other in the last ten of 30 seconds.
double Spread(const std::string& first, const std::string& second) {
  const auto world = LoadWalkers(
      {"pose [0 0.5 0 0] ctrl \"stage/pedestrian x=90 y=0.5 speed=1.4" + first + "\"",
       "pose [-4 -0.5 0 0] ctrl \"stage/pedestrian x=90 y=-0.5 speed=1.0" + second + "\""});
  const std::vector<ModelPosition*> robots = WalkersOf(*world);
  double most = 0;
  for (int i = 0; i < 300; i++) {
    world->Update();
    if (i >= 200) most = std::max(most, robots[0]->GetPose().Distance(robots[1]->GetPose()));
  }
  return most;
}

TEST(Groups, MembersOfDifferentSpeedsStayTogether) {
  EXPECT_GT(Spread("", ""), 10);
  EXPECT_LT(Spread(" group=2 member=1", " group=2 member=2"), 2.5);
}

TEST(Groups, OnlyMembersOfTheGroupCount) {
  // The group of the first robot consists of itself and one before it, which does not exist.
  EXPECT_EQ(Spread(" group=2 member=2", ""), Spread("", ""));
  EXPECT_NE(Spread(" group=2 member=1", ""), Spread("", ""));
}

TEST(Groups, ARobotWaitsForMembersBehindItByTheGazeAlone) {
  // v = v0 / (1 + gaze * time * (pi - pi / 2)) if the other is straight behind.
  const auto world =
      LoadWalkers({"pose [0 0 0 0] ctrl \"stage/pedestrian x=90 y=0 speed=1.4 "
                   "group=2 member=1 cohesion=0 repulsion=0\"",
                   "pose [-9 0 0 0] ctrl \"stage/goal x=-9 y=0\""});
  const ModelPosition& robot = *WalkersOf(*world)[0];
  for (int i = 0; i < 100; i++) world->Update();
  EXPECT_NEAR(robot.GetVelocity().x, 1.4 / (1 + 4 * 0.5 * 1.5707963), 1e-6);
}

/// The distance after 20 seconds of two robots that walk side by side and feel one force alone.
double GapAfter(double gap, const std::string& force) {
  const auto member = [&](int number) {
    const std::string y = std::to_string(number * gap);
    return "pose [0 " + y + " 0 0] ctrl \"stage/pedestrian x=90 y=" + y +
           " repulsion=0 gaze=0 group=2 member=" + std::to_string(number) + force + "\"";
  };
  const auto world = LoadWalkers({member(1), member(2)});
  for (int i = 0; i < 200; i++) world->Update();
  const std::vector<ModelPosition*> robots = WalkersOf(*world);
  return robots[0]->GetPose().Distance(robots[1]->GetPose());
}

TEST(Groups, CohesionAttractsMembersThatAreFarFromTheirMiddle) {
  EXPECT_NEAR(GapAfter(3, " push=0 cohesion=0"), 3, 0.01);
  EXPECT_LT(GapAfter(3, " push=0"), 1.5);
  EXPECT_NEAR(GapAfter(0.95, " push=0"), 0.95, 0.01);
}

TEST(Groups, MembersThatAreCloseGiveWay) {
  EXPECT_NEAR(GapAfter(0.5, " push=0 cohesion=0"), 0.5, 0.01);
  EXPECT_GT(GapAfter(0.5, " cohesion=0"), 0.75);
}

// ---- mistakes ----

std::string ReasonOf(const std::string& ctrl) {
  const LoadOutcome outcome = TryToLoad("position( name \"r\" ctrl \"" + ctrl + "\" )\n");
  EXPECT_FALSE(outcome.loaded);
  return outcome.errors.substr(outcome.errors.find("\"r\": ") + 5);
}

TEST(RouteArguments, MistakesAreReportedInOneLine) {
  const std::string expected = ", expected goals=X,Y,X,Y,... with 1 to 8 goals in metres\n";
  for (const char* goals :
       {"goals=", "goals=1", "goals=1,2,3", "goals=1,2,", "goals=1;2", "goals=1,x", "goals=1,1e10",
        "goals=1,2,1,2,1,2,1,2,1,2,1,2,1,2,1,2,1,2"})
    for (const char* controller : {"stage/pedestrian ", "stage/orca "})
      EXPECT_EQ(ReasonOf(std::string(controller) + goals),
                "found \"" + std::string(goals) + "\"" + expected);
  EXPECT_EQ(ReasonOf("stage/pedestrian y=1"), "found no argument x, expected x=NUMBER\n");
  EXPECT_NE(ReasonOf("stage/pedestrian goals=1,2 x=1").find("found the argument \"x=1\""),
            std::string::npos);
  EXPECT_EQ(ReasonOf("stage/orca x=1 y=2 loop=0.5"),
            "found \"loop=0.5\", expected a whole number\n");
  EXPECT_EQ(ReasonOf("stage/pedestrian x=1 y=2 group=2.5"),
            "found \"group=2.5\", expected a whole number\n");
  EXPECT_EQ(ReasonOf("stage/pedestrian x=1 y=2 group=2 member=3"),
            "found member=3 of group=2, expected a number from 1 to 2\n");
}

}  // namespace
}  // namespace Stg
