// SPDX-License-Identifier: GPL-2.0-or-later
//
// The bumper: the reports of its touch lines.

#include <cmath>

#include "models/body.hh"
#include "support/crowd.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A square robot of 0.4 m at the origin with subscribed bumpers "b". Robots stop before contact,
/// so most tests use a line 0.25 m ahead.
struct Robot {
  explicit Robot(const std::string& bumpers, const std::string& rest,
                 const std::string& pose = "0 0 0 0")
      : world(LoadText("position( name \"r\" pose [" + pose +
                       "] size [0.4 0.4 0.2] bumper( name \"b\" size [0.01 0.01 0.01] " + bumpers +
                       " ) )\n" + rest)),
        bumper(FindRunning<ModelBumper>(*world, "r.b")) {}
  Model* Hit(size_t i = 0) {
    Step(*world);
    return bumper->samples[i].hit;
  }
  std::unique_ptr<World> world;
  ModelBumper* bumper;
};

const char kAhead[] = "bcount 1 blength 0.4 bpose[0] [0.25 0 0 0]";

std::string Box(const std::string& pose, const std::string& more = "") {
  return "model( name \"box\" pose [" + pose + "] size [0.2 0.2 0.2] " + more + " )\n";
}

TEST(Bumper, HasNoLinesWithoutBcount) {
  const auto world = LoadText("bumper( name \"b\" blength 0.3 bpose[0] [1 0 0 0] alwayson 1 )");
  const ModelBumper* bumper = Find<ModelBumper>(*world, "b");
  Step(*world, 2);
  EXPECT_EQ(bumper->bumper_count, 0u);
  EXPECT_EQ(bumper->bumpers, nullptr);
  EXPECT_EQ(bumper->samples, nullptr);
}

TEST(Bumper, DefaultsAreThoseOfStage) {
  const auto world = LoadText("bumper( name \"b\" bcount 2 )");
  const ModelBumper* bumper = Find<ModelBumper>(*world, "b");
  EXPECT_EQ(bumper->GetGeom().size.x, 0.4);
  EXPECT_EQ(bumper->GetGeom().size.z, 1.0);
  EXPECT_FALSE(bumper->body().empty());
  ASSERT_EQ(bumper->bumper_count, 2u);
  EXPECT_EQ(bumper->bumpers[1].length, 0);
  ExpectPose(bumper->bumpers[1].pose, 0, 0, 0, 0);
}

TEST(Bumper, PropertiesAreRead) {
  const auto world = LoadText(
      "unit_length \"cm\"\nbumper( name \"b\" bcount 3 blength 40 bpose[1] [10 20 30 90]\n"
      "  blength[2] 70 )");
  const ModelBumper* bumper = Find<ModelBumper>(*world, "b");
  ASSERT_EQ(bumper->bumper_count, 3u);
  EXPECT_DOUBLE_EQ(bumper->bumpers[0].length, 0.4);
  EXPECT_DOUBLE_EQ(bumper->bumpers[1].length, 0.4);
  EXPECT_DOUBLE_EQ(bumper->bumpers[2].length, 0.7);
  ExpectPose(bumper->bumpers[1].pose, 0.1, 0.2, 0.3, M_PI / 2);
}

TEST(Bumper, CountOfZeroIsAWarning) {
  const LoadOutcome outcome = TryToLoad("bumper( bcount 0 )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("t.world:1:16: warning: found 0 bumpers"), std::string::npos)
      << outcome.errors;
}

TEST(Bumper, BadPropertiesAreRefused) {
  for (const char* bad : {"bcount -1", "bcount 100000000", "bcount 1 blength -1",
                          "bcount 2 blength[1] -0.1", "bcount 1 bpose[0] [1 2 3]"}) {
    const LoadOutcome outcome = TryToLoad("bumper( " + std::string(bad) + " )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << outcome.errors;
  }
}

TEST(Bumper, TouchesAcrossTheDirectionThatItFaces) {
  Robot robot(kAhead, Box("0.3 0.25 0 0"));  // the line is x = 0.25, y from -0.2 to 0.2
  EXPECT_EQ(robot.Hit(), Find(*robot.world, "box"));
  Find(*robot.world, "box")->SetPose(Pose(0.3, 0.35, 0, 0));
  EXPECT_EQ(robot.Hit(), nullptr);
  Find(*robot.world, "box")->SetPose(Pose(0.45, 0, 0, 0));
  EXPECT_EQ(robot.Hit(), nullptr);
}

TEST(Bumper, ReportsThePointOfContact) {
  Robot robot(kAhead, Box("0.3 0.25 0 0"));
  Step(*robot.world);
  EXPECT_NEAR(robot.bumper->samples[0].hit_point.x, 0.25, 1e-9);
  EXPECT_NEAR(robot.bumper->samples[0].hit_point.y, 0.15, kCell);
  // The point keeps its value when the contact ends.
  const point_t point = robot.bumper->samples[0].hit_point;
  Find(*robot.world, "box")->SetPose(Pose(9, 9, 0, 0));
  EXPECT_EQ(robot.Hit(), nullptr);
  EXPECT_EQ(robot.bumper->samples[0].hit_point, point);
}

TEST(Bumper, ReportsThePointOfContactOfATurnedRobot) {
  Robot robot("bcount 1 blength 0.4 bpose[0] [0 -0.25 0 -90] origin [0.1 0 0 0]",
              Box("3.3 4.1 0 0"), "3 4 0 90");
  // The robot faces +y, so its right side is +x. The bumper's frame is at (3, 4.1).
  Step(*robot.world);
  ASSERT_NE(robot.bumper->samples[0].hit, nullptr);
  EXPECT_NEAR(robot.bumper->samples[0].hit_point.x, 3.25, 1e-9);
  EXPECT_NEAR(robot.bumper->samples[0].hit_point.y, 4.0, 1.5 * kCell);  // comes from below
}

TEST(Bumper, SamplesAreThereFromTheFirstUpdateUntilShutdown) {
  Robot robot(kAhead, Box("0.3 0.1 0 0"));
  EXPECT_EQ(robot.bumper->samples, nullptr);
  EXPECT_NE(robot.Hit(), nullptr);
  robot.bumper->Unsubscribe();
  EXPECT_EQ(robot.bumper->samples, nullptr);
  Step(*robot.world, 3);
  EXPECT_EQ(robot.bumper->samples, nullptr);
  robot.bumper->Subscribe();
  EXPECT_NE(robot.Hit(), nullptr);
}

TEST(Bumper, TouchesAnyUnrelatedBodyAtAnyHeight) {
  Robot robot("bcount 1 blength 0.4 bpose[0] [0.25 0 0.7 0]",
              Box("0.3 0.1 2 0", "obstacle_return 0 ranger_return -1 blob_return 0"));
  EXPECT_EQ(robot.Hit(), Find(*robot.world, "box"));
}

TEST(Bumper, DoesNotTouchItsOwnTree) {
  Robot robot(kAhead, Box("0.3 0.1 0 0"));
  EXPECT_NE(robot.Hit(), nullptr);
  Find(*robot.world, "box")->SetParent(Find(*robot.world, "r"));
  EXPECT_EQ(robot.Hit(), nullptr);
}

TEST(Bumper, LinesInsideTheBodyTouchNothing) {
  Robot robot("bcount 2 blength 0.2 bpose[0] [0.1 0 0 0] bpose[1] [0.25 0 0 0] blength[1] 0",
              Box("0.31 0.1 0 0"));
  Step(*robot.world);
  EXPECT_EQ(robot.Hit(0), nullptr);
  EXPECT_EQ(robot.Hit(1), nullptr);  // the line has no length
}

TEST(Bumper, SensesBeforeTheBodiesOfTheStepMove) {
  Robot robot(kAhead, Box("0.4 0.1 0 0"));
  auto* drive = FindRunning<ModelPosition>(*robot.world, "r");
  drive->SetSpeed(0.7, 0, 0);  // after the first step of 0.07 m, the line is at 0.32
  EXPECT_EQ(robot.Hit(), nullptr);
  EXPECT_NEAR(drive->GetPose().x, 0.07, 1e-9);
  EXPECT_NE(robot.Hit(), nullptr);
}

TEST(Bumper, DrawsPowerWhileSubscribed) {
  const auto world = LoadText("bumper( name \"b\" joules 5 watts 7 bcount 1 )");
  ModelBumper* bumper = FindRunning<ModelBumper>(*world, "b");
  Step(*world, 3);
  EXPECT_NEAR(bumper->FindPowerPack()->GetDissipated(), 0.03, 1e-9);
  bumper->Unsubscribe();
  Step(*world, 3);
  EXPECT_NEAR(bumper->FindPowerPack()->GetDissipated(), 0.03, 1e-9);
}

TEST(Bumper, Prints) {
  Robot robot("bcount 2 blength 0.4 bpose[0] [0.25 0 0 0] bpose[1] [-0.25 0 0 0]",
              Box("0.3 0.1 0 0"));
  char prefix[] = "> ";
  EXPECT_EQ(OutputOf([&] { robot.bumper->Print(prefix); }), "> r.b bumpers: 0 0\n");
  Step(*robot.world);
  EXPECT_EQ(OutputOf([&] { robot.bumper->Print(nullptr); }), "r.b bumpers: 1 0\n");
}

TEST(Bumper, SensorsMayBeChangedInPlace) {
  Robot robot(kAhead, Box("-0.3 0.1 0 0"));
  EXPECT_EQ(robot.Hit(), nullptr);
  robot.bumper->bumpers[0].pose.x = -0.25;
  EXPECT_NE(robot.Hit(), nullptr);
  robot.bumper->bumper_count = 7;  // larger than the actual number; treated as 1
  EXPECT_NE(robot.Hit(), nullptr);
  EXPECT_EQ(robot.bumper->bumper_count, 1u);
}

int Delete(Model*, void* victim) {
  delete static_cast<Model*>(victim);
  return 1;
}
int Unsubscribe(Model* model, void*) {
  model->Unsubscribe();
  return 1;
}

TEST(Bumper, CanBeDeletedOrStoppedWithPendingRays) {
  Robot robot(kAhead, Box("0.3 0.1 0 0"));
  robot.world->Enqueue(0, 100000, robot.bumper, Unsubscribe, nullptr);
  Step(*robot.world);
  EXPECT_EQ(robot.bumper->samples, nullptr);
  robot.bumper->Subscribe();
  robot.world->Enqueue(0, 100000, Find(*robot.world, "r"), Delete, robot.bumper);
  Step(*robot.world, 2);
  EXPECT_EQ(robot.world->GetAllModels().size(), 3u);  // the ground, the robot, the box
}

// Robots move around and collide with each other.
TEST(Bumper, ResultsDoNotDependOnTheMethod) {
  const auto bot = [](int i) {
    const int column = i % 10, row = i / 10;
    return "bot( pose [" + std::to_string(column * 0.37) + " " + std::to_string(row * 0.37) +
           " 0 " + std::to_string(i * 37) + "] )\n";
  };
  const auto look = [](const crowd::Robots& robots, std::vector<double>* touches) {
    for (const ModelPosition* robot : robots) {
      const auto* bumper = dynamic_cast<ModelBumper*>(robot->GetChildren()[0]);
      for (int b = 0; b < 4; b++)
        if (bumper->samples[b].hit) touches->push_back(b);
    }
  };
  const crowd::Outcome outcome = crowd::ExpectSameHoweverItIsRun(
      {"define bot position( size [0.3 0.3 0.2] alwayson 1\n"
       "  bumper( size [0.01 0.01 0.01] alwayson 1 bcount 4 blength 0.3\n"
       "    bpose[0] [0.17 0 0 0] bpose[1] [0 0.17 0 90] bpose[2] [-0.17 0 0 180]\n"
       "    bpose[3] [0 -0.17 0 -90] ) )\n" +
           crowd::Repeat(100, bot),
       20, 0.3, [](size_t i) { return i % 2 ? 0.5 : -0.5; }, look});
  EXPECT_GT(outcome.sensed.size(), 100u);
}

}  // namespace
}  // namespace Stg
