// SPDX-License-Identifier: GPL-2.0-or-later
//
// Drives in worlds: acceleration bounds in every mode of control, cars with a limited steering, and
// drives from plug-ins, on any number of threads and across snapshots and copies.

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "position_testing.hh"

namespace Stg {
namespace {

// ---- acceleration bounds ------------------------------------------------------------------------

TEST(LimitAcceleration, IsOffUnlessTheWorldAsksForIt) {
  Robot robot("acceleration_bounds [-0.2 0.2 -0.2 0.2 0 0 -10 10]");
  robot.position->SetSpeed(1, 0, 0.5);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 1, 0, 0, 0.5);
}

TEST(LimitAcceleration, MakesVelocityARampOfTheTimeBetweenUpdates) {
  for (const char* drive : {"diff", "omni", "car"})
    for (const int step : {10, 100})
      for (const int interval : {step, 200}) {
        Robot robot(
            "limit_acceleration 1 acceleration_bounds [-0.4 0.2 -0.4 0.2 0 0 -90 90] drive \"" +
                std::string(drive) + "\" update_interval " + std::to_string(interval),
            "interval_sim " + std::to_string(step));
        ModelPosition& p = *robot.position;
        p.SetSpeed(0.3, 0, 0);
        Step(*robot.world, 1000 / step);
        EXPECT_NEAR(p.GetVelocity().x, 0.2, 1e-9) << drive;
        Step(*robot.world, 1000 / step);
        EXPECT_EQ(p.GetVelocity().x, 0.3) << drive;
        p.Stop();
        Step(*robot.world, 400 / step);
        EXPECT_NEAR(p.GetVelocity().x, 0.3 - 0.4 * 0.4, 1e-9) << drive;
        Step(*robot.world, 600 / step);
        EXPECT_EQ(p.GetVelocity().x, 0) << drive;
      }
}

TEST(LimitAcceleration, HoldsForGoalsWhichAreReached) {
  for (const char* drive : {"diff", "omni"}) {
    Robot robot("limit_acceleration 1 acceleration_bounds [-0.1 0.1 -0.1 0.1 0 0 -45 45] drive \"" +
                std::string(drive) + "\"");
    ModelPosition& p = *robot.position;
    p.GoTo(3, 1, 0);
    Velocity before;
    for (int i = 0; i < 600; i++) {
      Step(*robot.world);
      const Velocity now = p.GetVelocity();
      EXPECT_LE(std::fabs(now.x - before.x), 0.01 + 1e-12);
      EXPECT_LE(std::fabs(now.y - before.y), 0.01 + 1e-12);
      EXPECT_LE(std::fabs(now.a - before.a), 0.1 * M_PI / 4 + 1e-12);
      before = now;
    }
    EXPECT_NEAR(p.GetPose().x, 3, 0.03) << drive;
    EXPECT_NEAR(p.GetPose().y, 1, 0.03) << drive;
  }
}

TEST(LimitAcceleration, DrawsThePowerOfTheRampNotOfTheCommand) {
  Robot robot("mass 2 joules 1000 limit_acceleration 1");
  robot.position->SetSpeed(1, 0, 0);
  Step(*robot.world);
  const double watts = 1 + 10 * 2 * 0.1;  // at 0.1 m/s
  EXPECT_NEAR(robot.position->FindPowerPack()->GetStored(), 1000 - 0.1 * watts, 1e-9);
}

TEST(LimitAcceleration, OnlyExplainMentionsBoundsThatLimitNoOtherCommands) {
  const std::string bounds = "acceleration_bounds [-1 1 -1 1 -1 1 -9 9] ";
  const std::string two =
      "define robot position( " + bounds + ")\nrobot( ) robot( pose [2 0 0 0] )";
  const auto world = EmptyWorld();
  EXPECT_EQ(TryToLoad(world.get(), two).errors, "") << "many worlds for Stage 4.3 have such bounds";
  const std::vector<std::string> lines = Summarize(*world).load_warnings;
  ASSERT_EQ(lines.size(), 1u) << "one line for each place";
  EXPECT_EQ(lines[0].rfind("t.world:1:", 0), 0u) << lines[0];
  EXPECT_NE(lines[0].find("limit_acceleration 1"), std::string::npos) << lines[0];
  for (const char* limit : {"limit_acceleration 0", "limit_acceleration 1"})
    EXPECT_TRUE(Summarize(*LoadText("position( " + bounds + limit + " )")).load_warnings.empty());
}

// ---- cars ---------------------------------------------------------------------------------------

/// Radius of the circle through three points.
double RadiusOf(const Pose& a, const Pose& b, const Pose& c) {
  const double ab = a.Distance(b), bc = b.Distance(c), ca = c.Distance(a);
  const double area = std::fabs((b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y)) / 2;
  return ab * bc * ca / (4 * area);
}

TEST(Car, DrivesACircleWhoseRadiusIsWheelbaseByTheTangentOfTheSteering) {
  for (const char* command : {"steering", "turn"})
    for (const double limit : {10.0, 25.0}) {
      Robot robot("obstacle_return 0 drive \"car\" wheelbase 0.8 steering_limit " +
                      std::to_string(limit) + " car_command \"" + command + "\"",
                  "interval_sim 1\n");
      ModelPosition& p = *robot.position;
      p.SetSpeed(0.5, 0, 9);  // more than the limit allows
      Step(*robot.world, 1000);
      const Pose first = p.GetPose();
      Step(*robot.world, 1000);
      const Pose second = p.GetPose();
      Step(*robot.world, 1000);
      const double expected = 0.8 / std::tan(limit * M_PI / 180);
      EXPECT_NEAR(RadiusOf(first, second, p.GetPose()), expected, 1e-3 * expected) << command;
      EXPECT_NEAR(p.GetSteering(), limit * M_PI / 180, 1e-12);
    }
}

TEST(Car, SteersInARampOfTheSteeringRate) {
  for (const int step : {20, 100}) {
    Robot robot(
        "drive \"car\" steering_rate 30 wheelbase 0.5 update_interval " + std::to_string(step),
        "interval_sim " + std::to_string(step));
    ModelPosition& p = *robot.position;
    p.SetSpeed(0.5, 0, M_PI / 4);
    Step(*robot.world, 1000 / step);
    EXPECT_NEAR(p.GetSteering(), M_PI / 6, 1e-9);
    EXPECT_NEAR(p.GetVelocity().x, 0.5 * std::cos(M_PI / 6), 1e-9);
    EXPECT_NEAR(p.GetVelocity().a, 0.5 * std::sin(M_PI / 6) / 0.5, 1e-9);
    Step(*robot.world, 1000 / step);
    EXPECT_NEAR(p.GetSteering(), M_PI / 4, 1e-9);
  }
}

TEST(Car, ATurnCommandKeepsTheSpeedOfTheRearAxle) {
  Robot robot("drive \"car\" wheelbase 0.5 car_command \"turn\"");
  robot.position->SetSpeed(0.6, 0, 0.4);
  Step(*robot.world);
  ExpectPose(robot.position->GetVelocity(), 0.6, 0, 0, 0.4, 1e-12);
  EXPECT_NEAR(robot.position->GetSteering(), std::atan(0.4 * 0.5 / 0.6), 1e-12);
}

TEST(Car, RefusesNegativeLimitsAndReportsUnknownCommands) {
  EXPECT_FALSE(TryToLoad("position( steering_limit -1 )").loaded);
  EXPECT_FALSE(TryToLoad("position( steering_rate -1 )").loaded);
  EXPECT_NE(TryToLoad("position( car_command \"wheel\" )").errors.find("car_command"),
            std::string::npos);
}

// ---- every combination, threads, snapshots and copies -------------------------------------------

constexpr int kCombinations = 72;

/// Robots with the product of drives, bounds, odometry and update intervals, far from each other.
std::string EveryKind(int step) {
  std::string text = "plugins \"lagging_drive\"\ninterval_sim " + std::to_string(step) + "\n";
  int count = 0;
  for (const std::string drive :
       {"\"diff\"", "\"omni\"", "\"car\"", "\"car\" steering_rate 20 steering_limit 30",
        "\"car\" car_command \"turn\" steering_rate 40", "\"lagging\""})
    for (const std::string limits :
         {"", "limit_acceleration 1 acceleration_bounds [-0.5 0.2 -0.5 0.2 0 0 -40 30]"})
      for (const std::string localization :
           {"localization \"gps\"", "localization \"odom\" odom_error [0.01 0.01 0 2]",
            "localization \"odom\" odom_noise [0.02 0.01 2 1] wheel_slip 0.3"})
        for (const int interval : {0, 150}) {
          text += "position( name \"r" + std::to_string(count) + "\" pose [" +
                  std::to_string(count % 10 * 6) + ' ' + std::to_string(count / 10 * 6) +
                  " 0 0] size [0.3 0.3 0.3] alwayson 1 drive " + drive + ' ' + limits + ' ' +
                  localization + " update_interval " + std::to_string(interval) + " )\n";
          count++;
        }
  EXPECT_EQ(count, kCombinations);
  return text;
}

/// Commands of all modes, which change every half second.
void Command(World* world, int moment) {
  for (int i = 0; i < kCombinations; i++) {
    auto* const robot = Find<ModelPosition>(*world, "r" + std::to_string(i));
    switch ((moment + i) % 4) {
      case 0:
        robot->SetSpeed(0.8, 0.2, 0.5);
        break;
      case 1:
        robot->GoTo(robot->est_pose.x + 0.5, robot->est_pose.y - 0.5, 1);
        break;
      case 2:
        robot->SetAcceleration(-0.3, 0.1, 0.2);
        break;
      default:
        robot->SetSpeed(-0.4, 0, -0.6);
    }
  }
}

/// Runs `moments` half seconds, and returns the state hash after each.
std::vector<uint64_t> RunMoments(World* world, int step, int from, int moments) {
  std::vector<uint64_t> hashes;
  for (int moment = from; moment < from + moments; moment++) {
    Command(world, moment);
    Step(*world, 500 / step);
    hashes.push_back(world->StateHash());
  }
  return hashes;
}

std::unique_ptr<World> LoadEveryKind(int step, int threads) {
  InitLibrary();
  RunOptions options;
  options.threads = threads;
  options.share_from = 1;
  auto world = std::make_unique<World>(options);
  std::istringstream content(EveryKind(step));
  EXPECT_TRUE(world->Load(content, "t.world"));
  return world;
}

class EveryDrive : public testing::TestWithParam<int> {};

TEST_P(EveryDrive, GivesTheSameOnAnyNumberOfThreads) {
  std::vector<uint64_t> expected;
  ErrorsOf([&] { expected = RunMoments(LoadEveryKind(GetParam(), 1).get(), GetParam(), 0, 6); });
  for (const int threads : {2, 5})
    ErrorsOf([&] {
      EXPECT_EQ(RunMoments(LoadEveryKind(GetParam(), threads).get(), GetParam(), 0, 6), expected);
    });
}

TEST_P(EveryDrive, ContinuesFromASnapshotInTheMiddleOfARamp) {
  ErrorsOf([&] {
    const auto world = LoadEveryKind(GetParam(), 1), other = LoadEveryKind(GetParam(), 1);
    RunMoments(world.get(), GetParam(), 0, 2);
    Command(world.get(), 2);
    Step(*world, 2);
    Snapshot snapshot;
    ASSERT_TRUE(world->Take(&snapshot));
    const uint64_t hash = world->StateHash();
    const std::vector<uint64_t> expected = RunMoments(world.get(), GetParam(), 3, 3);
    ASSERT_TRUE(world->Restore(snapshot));
    EXPECT_EQ(world->StateHash(), hash);
    EXPECT_EQ(RunMoments(world.get(), GetParam(), 3, 3), expected);
    ASSERT_TRUE(other->Restore(snapshot));
    EXPECT_EQ(other->StateHash(), hash);
    EXPECT_EQ(RunMoments(other.get(), GetParam(), 3, 3), expected);
  });
}

TEST_P(EveryDrive, GivesTheSameInACopyOfTheWorld) {
  ErrorsOf([&] {
    const auto world = LoadEveryKind(GetParam(), 1);
    RunOptions options;
    World copy(options);
    ASSERT_TRUE(copy.LoadCopy(*world));
    EXPECT_EQ(RunMoments(&copy, GetParam(), 0, 4), RunMoments(world.get(), GetParam(), 0, 4));
  });
}
INSTANTIATE_TEST_SUITE_P(Steps, EveryDrive, testing::Values(10, 100));

// ---- the state hash -----------------------------------------------------------------------------

TEST(MotionState, EveryPropertyChangesTheHashAndDefaultsDoNot) {
  const auto hash = [](const std::string& properties) {
    return Robot("drive \"car\" localization \"odom\" odom_error [0 0 0 0] " + properties)
        .world->StateHash();
  };
  const uint64_t plain = hash("");
  EXPECT_EQ(hash("limit_acceleration 0 stops_when_empty 1 car_command \"steering\" wheel_slip 0 "
                 "odom_noise [0 0 0 0]"),
            plain);
  for (const char* property :
       {"limit_acceleration 1", "stops_when_empty 0", "car_command \"turn\"", "wheel_slip 0.5",
        "steering_limit 30", "steering_rate 30", "odom_noise [0.1 0 0 0]", "odom_noise [0 0 0 1]"})
    EXPECT_NE(hash(property), plain) << property;
}

TEST(MotionState, TheSteeringAngleIsStateOnlyWhereItDependsOnThePast) {
  const auto changes = [](const std::string& properties) {
    Robot one("drive \"car\" " + properties), other("drive \"car\" " + properties);
    for (const double angle : {0.3, 0.3, 0.0}) {
      one.position->SetSpeed(0, 0, angle);
      Step(*one.world);
    }
    for (const double angle : {0.0, 0.3, 0.0}) {
      other.position->SetSpeed(0, 0, angle);
      Step(*other.world);
    }
    return one.world->StateHash() != other.world->StateHash();
  };
  EXPECT_FALSE(changes(""));
  EXPECT_FALSE(changes("steering_limit 60"));
  EXPECT_TRUE(changes("steering_rate 10"));
}

// ---- drives of plug-ins -------------------------------------------------------------------------

TEST(OwnDrive, ComesFromThePluginOfTheExample) {
  const auto world = LoadText(
      "plugins \"lagging_drive\"\nposition( name \"r\" drive \"lagging\" update_interval 100 )");
  ModelPosition* const p = FindRunning<ModelPosition>(*world, "r");
  p->SetSpeed(0.5, 0, 0.2);
  double left = 1;
  for (int i = 0; i < 10; i++) {
    Step(*world);
    left *= 1 - 0.1 / 0.5;
    EXPECT_NEAR(p->GetVelocity().x, 0.5 * (1 - left), 1e-12);
    EXPECT_NEAR(p->GetVelocity().a, 0.2 * (1 - left), 1e-12);
  }
}

TEST(OwnDrive, AnUnknownNameIsReportedWithThoseThereAreAndMeansDiff) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(world.get(), "position( name \"r\" drive \"hover\" )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("found drive \"hover\", expected \"diff\", \"omni\""),
            std::string::npos)
      << outcome.errors;
  ModelPosition* const p = FindRunning<ModelPosition>(*world, "r");
  p->SetSpeed(0.5, 0.5, 0);
  Step(*world);
  ExpectPose(p->GetVelocity(), 0.5, 0, 0, 0);
}

TEST(OwnDrive, TheExampleWorldRuns) {
  const char* const source = std::getenv("STAGE_SOURCE_DIR");
  ASSERT_NE(source, nullptr);
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(std::string(source) + "/examples/drive/lagging.world"));
  Step(*world, 30);
  EXPECT_NE(Find<ModelPosition>(*world, "slow0")->GetPose().x, 0);
}

}  // namespace
}  // namespace Stg
