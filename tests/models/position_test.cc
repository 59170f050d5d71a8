// SPDX-License-Identifier: GPL-2.0-or-later
//
// The position model: commands, drives, bounds, odometry, motion and stalls. Figures are those of
// Stage 4.3, except where a comment describes a deliberate difference.

#include <algorithm>
#include <cmath>

#include "position_testing.hh"

namespace Stg {
namespace {

using Command = void (*)(ModelPosition*);

// ---- figures of Stage 4.3 -----------------------------------------------------------------------

struct DriveCase {
  const char* name;
  const char* properties;
  Command command;
  double poses[3][3];  // x, y, a after each of three steps
};

class Drive : public testing::TestWithParam<DriveCase> {};

TEST_P(Drive, MovesAsStageDoes) {
  const DriveCase& c = GetParam();
  Robot robot(c.properties);
  c.command(robot.position);
  for (const auto& pose : c.poses) {
    Step(*robot.world);
    ExpectPose(robot.position->GetPose(), pose[0], pose[1], 0, pose[2], 1e-6);
    EXPECT_FALSE(robot.position->Stalled());
  }
}

const DriveCase kDriveCases[] = {
    {"Diff",
     "pose [6 2 0 90]",
     [](ModelPosition* p) { p->SetSpeed(0.5, 0, 0.2); },
     {{6, 2.05, 1.590796}, {5.999000, 2.099990, 1.610796}, {5.997001, 2.149950, 1.630796}}},
    {"DiffIgnoresSideways",
     "pose [6 2 0 90]",
     [](ModelPosition* p) { p->SetSpeed(0.5, 0.7, 0.2); },
     {{6, 2.05, 1.590796}, {5.999000, 2.099990, 1.610796}, {5.997001, 2.149950, 1.630796}}},
    {"Car",
     "pose [0 30 0 0] drive \"car\" wheelbase 0.5",
     [](ModelPosition* p) { p->SetSpeed(0.8, 0, 0.3); },
     {{0.076427, 30, 0.047283}, {0.152768, 30.003612, 0.094566}, {0.228854, 30.010829, 0.141850}}},
    {"OmniClippedByDefaultBounds",
     "pose [0 60 0 0] drive \"omni\"",
     [](ModelPosition* p) { p->SetSpeed(5, -5, 5); },
     {{0.1, 59.9, 0.157080}, {0.214412, 59.816875, 0.314159}, {0.340420, 59.752671, 0.471239}}},
    {"OmniClippedByOwnBounds",
     "pose [0 50 0 0] drive \"omni\" velocity_bounds [-0.1 0.2 -0.3 0.4 0 0 -10 20]",
     [](ModelPosition* p) { p->SetSpeed(5, -5, 5); },
     {{0.02, 49.97, 0.034907}, {0.041035, 49.940716, 0.069813}, {0.063079, 49.912184, 0.104720}}},
    {"DiffAccelerated",
     "pose [0 80 0 0]",
     [](ModelPosition* p) { p->SetAcceleration(5, 5, 5); },
     {{0.01, 80, 0.015708}, {0.029998, 80.000314, 0.047124}, {0.059964, 80.001727, 0.094248}}},
    {"OmniAcceleratedWithinOwnBounds",
     "pose [0 70 0 0] drive \"omni\" acceleration_bounds [-0.5 0.5 -0.5 0.25 0 0 -10 20]",
     [](ModelPosition* p) { p->SetAcceleration(5, 5, 5); },
     {{0.005, 70.0025, 0.003491},
      {0.014982, 70.007535, 0.010472},
      {0.029903, 70.015192, 0.020944}}},
};
INSTANTIATE_TEST_SUITE_P(Figures, Drive, testing::ValuesIn(kDriveCases),
                         [](const auto& test) { return std::string(test.param.name); });

// Stage limits left turns only by the velocity bounds and turns 0.152133 in the first step. Here
// both directions have Stage's limit for right turns, 1 rad/s; the rest is as in Stage. In Stage
// the estimate is also (0, 0) until the first update.
TEST(GoTo, SteersWithTheEstimateOfTheUpdateBefore) {
  Robot robot("pose [0 100 0 0]");
  ExpectPose(robot.position->est_pose, 0, 100, 0, 0);
  robot.position->GoTo(5, 101, 0);
  const double course = std::atan2(1, 5);
  Step(*robot.world);
  double heading = 0.1 * course;
  ExpectPose(robot.position->GetPose(), 0, 100, 0, heading);  // off course by more than pi / 16
  Step(*robot.world);
  heading += 0.1 * course;  // by the estimate of the first update, before any turn
  ExpectPose(robot.position->GetPose(), 0, 100, 0, heading);
  Step(*robot.world);
  ExpectPose(robot.position->GetPose(), 0.04 * std::cos(heading), 100 + 0.04 * std::sin(heading), 0,
             heading + 0.1 * (course - 0.1 * course));
}

// Stage's estimates are a step ahead of these and turn before moving: (0.054546, 0.007050,
// 0.128540) after the first step.
TEST(Odometry, TheErrorsOfStageOnTheMotionThatWasMade) {
  Robot robot("pose [0 10 0 90] localization \"odom\" odom_error [0.1 0.2 0.3 90]");
  robot.position->SetSpeed(0.5, 0, 0.5);
  const double ahead = 0.05 * 1.1, turn = 0.05 * (1 + M_PI / 2);
  Pose expected;
  for (int i = 0; i < 4; i++) {
    Step(*robot.world);
    ExpectPose(robot.position->est_pose, expected.x, expected.y, 0, expected.a);
    expected = expected + Pose(ahead, 0, 0, turn);
  }
}

// ---- commands -----------------------------------------------------------------------------------

TEST(Speed, TakesEffectAtTheNextUpdate) {
  Robot robot("");
  robot.position->SetSpeed(0.5, 0, 0.25);
  ExpectPose(robot.position->GetVelocity(), 0, 0, 0, 0);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0.5, 0, 0, 0.25);
}

TEST(Speed, ComponentsAreSetOneByOne) {
  Robot robot("drive \"omni\"");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.1, 0.2, 0.3);
  p.SetXSpeed(0.4);
  Step(*robot.world);
  ExpectPose(p.GetVelocity(), 0.4, 0.2, 0, 0.3);
  p.SetYSpeed(-0.5);
  Step(*robot.world);
  ExpectPose(p.GetVelocity(), 0.4, -0.5, 0, 0.3);
  p.SetTurnSpeed(-0.6);
  Step(*robot.world);
  ExpectPose(p.GetVelocity(), 0.4, -0.5, 0, -0.6);
  p.Stop();
  Step(*robot.world);
  ExpectPose(p.GetVelocity(), 0, 0, 0, 0);
}

TEST(Speed, UpAndDownHaveNoEffect) {
  Robot robot("drive \"omni\"");
  robot.position->SetSpeed(Velocity(0.1, 0.2, 0.3, 0.4));
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0.1, 0.2, 0, 0.4);
  robot.position->SetZSpeed(0.5);
  Step(*robot.world, 3);
  EXPECT_EQ(robot.position->GetPose().z, 0);
}

TEST(Speed, AfterGoToTheOtherComponentsOfTheGoalBecomeSpeeds) {
  Robot robot("drive \"omni\"");
  robot.position->GoTo(0.3, 0.2, 0.1);
  robot.position->SetXSpeed(0.5);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0.5, 0.2, 0, 0.1);
}

TEST(Speed, NotANumberIsIgnored) {
  Robot robot("drive \"omni\"");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.1, 0.2, 0.3);
  const std::string errors = ErrorsOf([&] {
    p.SetSpeed(kNaN, 0, 0);
    p.SetSpeed(Velocity(0, kNaN, 0, 0));
    p.SetSpeed(0, 0, kNaN);
    p.SetXSpeed(kNaN);
    p.SetTurnSpeed(kNaN);
    p.GoTo(kNaN, 0, 0);
    p.GoTo(Pose(0, 0, 0, kNaN));
    p.SetAcceleration(0, kNaN, 0);
    p.SetVelocity(Velocity(0, 0, 0, kNaN));
  });
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 9) << errors;
  Step(*robot.world);
  ExpectPose(p.GetVelocity(), 0.1, 0.2, 0, 0.3);
  ExpectPose(p.GetPose(), 0.01, 0.02, 0, 0.03);
}

TEST(Speed, InfinityIsClippedToTheBounds) {
  Robot robot("drive \"omni\"");
  robot.position->SetSpeed(kInfinity, -kInfinity, kInfinity);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 1, -1, 0, M_PI / 2);
  ExpectPose(robot.position->GetPose(), 0.1, -0.1, 0, M_PI / 20);
}

TEST(Speed, InfinityWithoutBoundsIsAStall) {
  Robot robot("");
  robot.position->velocity_bounds[0] = Bounds(-kInfinity, kInfinity);
  robot.position->SetSpeed(kInfinity, 0, 0);
  Step(*robot.world, 2);
  ExpectPose(robot.position->GetPose(), 0, 0, 0, 0);
  EXPECT_TRUE(robot.position->Stalled());
}

TEST(Speed, ATurnOfMoreThanHalfARevolutionInAStep) {
  Robot robot("velocity_bounds [-1 1 -1 1 -1 1 -10000 10000]");
  robot.position->SetSpeed(0, 0, 40);
  Step(*robot.world);
  EXPECT_NEAR(robot.position->GetPose().a, 4 - 2 * M_PI, 1e-12);
}

/// World files with swapped bounds are refused, but programs can set them.
TEST(Bounds, LowerWinsBelowUpperWinsAboveWhereTheyAreSwapped) {
  Robot robot("");
  robot.position->velocity_bounds[0] = Bounds(0.5, -0.5);
  robot.position->SetSpeed(0.2, 0, 0);
  Step(*robot.world);
  EXPECT_EQ(robot.position->GetVelocity().x, 0.5);
  robot.position->SetSpeed(0.7, 0, 0);
  Step(*robot.world);
  EXPECT_EQ(robot.position->GetVelocity().x, -0.5);
}

TEST(Bounds, CanBeChangedAtRunTime) {
  Robot robot("");
  robot.position->SetSpeed(5, 0, 0);
  Step(*robot.world);
  EXPECT_EQ(robot.position->GetVelocity().x, 1);
  robot.position->velocity_bounds->max = 0.3;
  Step(*robot.world);
  EXPECT_EQ(robot.position->GetVelocity().x, 0.3);
}

TEST(Defaults, AreThoseOfStage) {
  Robot robot("");
  const ModelPosition& p = *robot.position;
  for (int i = 0; i < 3; i++) {
    EXPECT_EQ(p.velocity_bounds[i].min, -1);
    EXPECT_EQ(p.velocity_bounds[i].max, 1);
    EXPECT_EQ(p.acceleration_bounds[i].min, -1);
    EXPECT_EQ(p.acceleration_bounds[i].max, 1);
  }
  EXPECT_EQ(p.velocity_bounds[3].max, M_PI / 2);
  EXPECT_EQ(p.acceleration_bounds[3].min, -M_PI / 2);
  EXPECT_TRUE(p.waypoints.empty());
  ExpectPose(p.est_pose_error, 0, 0, 0, 0);
}

TEST(Units, ScaleBoundsErrorsAndWheelbase) {
  const auto world = LoadText(
      "unit_length \"cm\" unit_angle \"radians\"\n"
      "position( name \"r\" velocity_bounds [-10 20 -30 40 -50 60 -0.1 0.2]\n"
      " odom_error [10 20 30 0.5] drive \"car\" wheelbase 50 )");
  ModelPosition* p = FindRunning<ModelPosition>(*world, "r");
  EXPECT_DOUBLE_EQ(p->velocity_bounds[0].min, -0.1);
  EXPECT_DOUBLE_EQ(p->velocity_bounds[1].max, 0.4);
  EXPECT_DOUBLE_EQ(p->velocity_bounds[2].max, 0.6);
  EXPECT_DOUBLE_EQ(p->velocity_bounds[3].max, 0.2);
  ExpectPose(p->GetOdomError(), 0.1, 0.2, 0.3, 0.5);
  p->SetSpeed(0.1, 0, 0.5);
  Step(*world);
  EXPECT_NEAR(p->GetVelocity().a, 0.1 * std::sin(0.5) / 0.5, 1e-12);
}

// ---- acceleration -------------------------------------------------------------------------------

// Stage uses the world's step as dt, so a model that updates every other step gets half the
// acceleration. Here dt is the time since the last update.
TEST(Acceleration, CountsTheTimeSinceTheLastUpdate) {
  for (const int interval : {100, 200, 300}) {
    Robot robot("update_interval " + std::to_string(interval));
    robot.position->SetAcceleration(0.5, 0, 0);
    Step(*robot.world, 6);
    EXPECT_NEAR(robot.position->GetVelocity().x, 0.3, 1e-12) << interval;
  }
}

TEST(Acceleration, StartsFromTheVelocityThatIsSet) {
  Robot robot("");
  robot.position->SetAcceleration(0.5, 0, 0);
  robot.position->SetVelocity(Velocity(0.2, 0, 0.05, 0));
  Step(*robot.world, 2);
  EXPECT_NEAR(robot.position->GetVelocity().x, 0.3, 1e-12);
  // A robot can only rise in this way.
  EXPECT_NEAR(robot.position->GetPose().z, 0.01, 1e-12);
}

TEST(Acceleration, IsNotForCars) {
  Robot robot("drive \"car\"");
  const std::string errors = ErrorsOf([&] {
    robot.position->SetVelocity(Velocity(0.2, 0, 0, 0));
    robot.position->SetAcceleration(1, 0, 0);
    Step(*robot.world, 5);
  });
  EXPECT_NE(errors.find("car"), std::string::npos) << errors;
  EXPECT_EQ(robot.position->GetVelocity().x, 0.2);
  robot.position->GoTo(5, 0, 0);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0, 0, 0, 0);
}

// ---- going to a place ---------------------------------------------------------------------------

TEST(GoTo, TurnsToBothSidesEquallyFast) {
  for (const double side : {1.0, -1.0}) {
    Robot robot("");
    robot.position->GoTo(0, 5 * side, 0);
    Step(*robot.world);
    ExpectPose(robot.position->GetVelocity(), 0, 0, 0, side);
  }
}

TEST(GoTo, ArrivesWithEverySupportedDrive) {
  for (const char* drive : {"diff", "omni"}) {
    for (const double heading : {0.0, 2.0, -2.5}) {
      Robot robot("pose [3 4 0 130] drive \"" + std::string(drive) + "\"");
      robot.position->GoTo(2.2, 5.1, heading);
      Step(*robot.world, 300);
      const Pose pose = robot.position->GetPose();
      EXPECT_NEAR(pose.x, 2.2, 0.02) << drive;
      EXPECT_NEAR(pose.y, 5.1, 0.02) << drive;
      EXPECT_NEAR(normalize(pose.a - heading), 0, 0.01) << drive;
    }
  }
}

// Stage uses the error in the world frame for speeds in the robot's frame, and limits only one
// sign.
TEST(GoTo, OmniGoesTheRightWayWhateverItsHeading) {
  for (int heading = -150; heading <= 180; heading += 30) {
    for (const double goal : {0.0, 1.1, 2.6, -2.0}) {
      Robot robot("pose [5 3 0 " + std::to_string(heading) + "] drive \"omni\"");
      Step(*robot.world);  // updates the estimate
      const double start = robot.position->GetPose().a;
      robot.position->GoTo(5 + 0.3 * std::cos(goal), 3 + 0.3 * std::sin(goal), start);
      Step(*robot.world);
      ExpectPose(robot.position->GetPose(), 5 + 0.03 * std::cos(goal), 3 + 0.03 * std::sin(goal), 0,
                 start);
    }
  }
}

TEST(GoTo, OmniIsLimitedOnBothSides) {
  Robot robot("drive \"omni\"");
  robot.position->GoTo(-7, 7, -2);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), -0.4, 0.4, 0, -1);
  robot.position->GoTo(7, -7, 2);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0.4, -0.4, 0, 1);
}

TEST(GoTo, SteersByTheEstimate) {
  Robot robot("pose [3 4 0 0] drive \"omni\" localization \"odom\" odom_error [0 0 0 0]");
  robot.position->GoTo(0.2, -0.1, 0);  // relative to where it started
  Step(*robot.world, 200);
  ExpectPose(robot.position->GetPose(), 3.2, 3.9, 0, 0, 1e-3);
}

TEST(GoTo, TurnsInPlaceAtTheGoal) {
  Robot robot("");
  robot.position->GoTo(0.019, -0.019, 0.5);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0, 0, 0, 0.5);
  robot.position->GoTo(0.021, 0, 0.5);
  Step(*robot.world);
  EXPECT_GT(robot.position->GetVelocity().x, 0);
}

// ---- velocities ---------------------------------------------------------------------------------

TEST(Velocities, GlobalOnesAreTurned) {
  Robot robot("pose [0 0 0 90] drive \"omni\"");
  robot.position->SetSpeed(0.5, 0.2, 0.3);
  Step(*robot.world);
  const double a = M_PI / 2 + 0.03;
  ExpectPose(robot.position->GetGlobalVelocity(), 0.5 * std::cos(a) - 0.2 * std::sin(a),
             0.5 * std::sin(a) + 0.2 * std::cos(a), 0, 0.3);
  robot.position->SetGlobalVelocity(Velocity(1, 2, 3, 4));
  ExpectPose(robot.position->GetVelocity(), std::cos(a) + 2 * std::sin(a),
             -std::sin(a) + 2 * std::cos(a), 0, 4);
}

TEST(Velocities, WorldFileVelocityLastsUntilTheFirstUpdate) {
  const std::string robot = "velocity [0.5 0 0 0] alwayson 1 ";
  const auto at_once = LoadText("position( name \"r\" " + robot + ")");
  Step(*at_once, 3);
  ExpectPose(Find(*at_once, "r")->GetPose(), 0, 0, 0, 0);

  const auto later = LoadText("position( name \"r\" " + robot + "update_interval 300 )");
  Step(*later, 2);
  ExpectPose(Find(*later, "r")->GetPose(), 0.1, 0, 0, 0);
  Step(*later, 5);
  ExpectPose(Find(*later, "r")->GetPose(), 0.1, 0, 0, 0);

  const auto never = LoadText("position( name \"r\" velocity [0.5 0 0 0] )");
  Step(*never, 3);
  ExpectPose(Find(*never, "r")->GetPose(), 0, 0, 0, 0);
}

TEST(Velocities, MotionGoesOnBetweenUpdates) {
  Robot robot("update_interval 300");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 2);
  EXPECT_EQ(robot.position->GetPose().x, 0);
  Step(*robot.world, 4);
  EXPECT_NEAR(robot.position->GetPose().x, 0.2, 1e-12);
}

TEST(Velocities, EndWithTheLastSubscriber) {
  Robot robot("");
  robot.position->Subscribe();
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world);
  robot.position->Unsubscribe();
  Step(*robot.world);
  EXPECT_NEAR(robot.position->GetPose().x, 0.1, 1e-12);
  robot.position->Unsubscribe();
  ExpectPose(robot.position->GetVelocity(), 0, 0, 0, 0);
  Step(*robot.world, 3);
  EXPECT_NEAR(robot.position->GetPose().x, 0.1, 1e-12);
  robot.position->Subscribe();  // the goal has been dropped, too
  Step(*robot.world, 3);
  EXPECT_NEAR(robot.position->GetPose().x, 0.1, 1e-12);
}

TEST(Velocities, CallbacksTellOfThem) {
  Robot robot("");
  int velocities = 0, poses = 0;
  const auto count = [](Model*, void* counter) { return ++*static_cast<int*>(counter), 0; };
  robot.position->AddCallback(Model::CB_VELOCITY, count, &velocities);
  robot.position->AddCallback(Model::CB_POSE, count, &poses);
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 4);
  EXPECT_EQ(velocities, 4);  // one per update
  EXPECT_EQ(poses, 0);       // driving does not call SetPose()
  robot.position->SetVelocity(Velocity());
  EXPECT_EQ(velocities, 5);
}

// ---- loading ------------------------------------------------------------------------------------

TEST(Loading, RefusesAWheelbaseThatIsNotPositive) {
  for (const char* value : {"0", "-0.5"}) {
    const LoadOutcome outcome = TryToLoad("\nposition( wheelbase " + std::string(value) + " )");
    EXPECT_FALSE(outcome.loaded);
    EXPECT_EQ(outcome.status, 1);
    EXPECT_EQ(outcome.errors.rfind("t.world:2:21: ", 0), 0u) << outcome.errors;
    EXPECT_NE(outcome.errors.find("wheelbase"), std::string::npos) << outcome.errors;
  }
}

TEST(Loading, RefusesShortTuples) {
  for (const char* property : {"velocity_bounds [-1 1 -1 1 -1 1 -90]", "acceleration_bounds [0 1]",
                               "velocity [1 0 0]", "localization_origin [1 2]", "odom_error [1]"}) {
    const LoadOutcome outcome = TryToLoad("position( " + std::string(property) + " )");
    EXPECT_FALSE(outcome.loaded) << property;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
  }
}

TEST(Loading, UnknownWordsAreReportedAndChangeNothing) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(
      world.get(), "position( name \"r\" drive \"hover\" localization \"stars\" odom [0 0 0] )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("hover"), std::string::npos) << outcome.errors;
  EXPECT_NE(outcome.errors.find("stars"), std::string::npos) << outcome.errors;
  EXPECT_NE(outcome.errors.find("localization_origin"), std::string::npos) << outcome.errors;
  ModelPosition* p = FindRunning<ModelPosition>(*world, "r");
  p->SetSpeed(0.5, 0.5, 0);
  Step(*world);
  ExpectPose(p->GetVelocity(), 0.5, 0, 0, 0);  // a differential drive
  ExpectPose(p->est_pose, 0, 0, 0, 0);
}

TEST(Waypoints, AreKept) {
  Robot robot("");
  robot.position->waypoints.emplace_back(1, 2, 0, 0.5, Color(1, 0, 0));
  robot.position->waypoints.emplace_back(Pose(3, 4, 0, 0), Color());
  EXPECT_EQ(robot.position->waypoints[1].pose.y, 4);
  EXPECT_TRUE(ModelPosition::Waypoint().pose.IsZero());
}

}  // namespace
}  // namespace Stg
