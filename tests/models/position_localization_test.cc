// SPDX-License-Identifier: GPL-2.0-or-later
//
// Localization of position models: GPS and odometry. Figures are those of Stage 4.3, except where a
// comment describes a deliberate difference.

#include <algorithm>
#include <cmath>

#include "position_testing.hh"

namespace Stg {
namespace {

// ---- localization -------------------------------------------------------------------------------

TEST(Localization, GpsTellsThePoseBeforeTheMove) {
  Robot robot("pose [1 2 0 90]");
  ExpectPose(robot.position->est_pose, 1, 2, 0, M_PI / 2);  // in Stage (0, 0, 0) until the update
  ExpectPose(robot.position->est_origin, 1, 2, 0, M_PI / 2);
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 1, 2, 0, M_PI / 2);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 1, 2.05, 0, M_PI / 2);
  ExpectPose(robot.position->GetPose(), 1, 2.1, 0, M_PI / 2);
}

// In Stage 4.3 the origin also affects GPS, but only the estimate before the first update.
TEST(Localization, OriginIsThatOfTheOdometryAndNothingToGps) {
  Robot gps("pose [3 2 0 0] localization_origin [1 2 0.5 450]");
  EXPECT_DOUBLE_EQ(gps.position->est_origin.a, 2.5 * M_PI);  // as it was given
  Robot odometry(
      "pose [3 2 0 0] localization_origin [1 2 0.5 450] localization \"odom\""
      " odom_error [0 0 0 0]");
  for (int step = 0; step < 3; step++) {
    ExpectPose(gps.position->est_pose, 3, 2, 0, 0);
    ExpectPose(odometry.position->est_pose, 0, -2, 0, -M_PI / 2);
    Step(*gps.world);
    Step(*odometry.world);
  }
}

TEST(Localization, FirstStepDoesNotJump) {
  for (const char* localization : {"gps", "odom"})
    for (const char* origin :
         {"", "localization_origin [1 2 0 30]", "localization_origin [0 0 0 0]"})
      for (const int step : {5, 20, 100}) {
        Robot robot("pose [3 2 0 45] localization \"" + std::string(localization) + "\" " + origin,
                    "interval_sim " + std::to_string(step));
        const Pose first = robot.position->est_pose;
        robot.position->SetSpeed(0.5, 0, 1.2);
        while (robot.position->GetLastUpdate() == 0) Step(*robot.world);
        // The first update senses before it moves.
        ExpectPose(robot.position->est_pose, first.x, first.y, first.z, first.a);
        ExpectPose(robot.position->GetSensedPose(), 3, 2, 0, M_PI / 4);
      }
}

TEST(Odometry, StartsAtTheOriginGiven) {
  Robot robot(
      "pose [3 2 0 0] localization \"odom\" localization_origin [0 0 0 0]"
      " odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 3);
  ExpectPose(robot.position->est_pose, 3.1, 2, 0, 0);
}

// In Stage 4.3 the sideways part has the wrong sign: (0.05, -0.04).
TEST(Odometry, SidewaysIsToTheLeft) {
  Robot robot("drive \"omni\" localization \"odom\" odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0.4, 0);
  Step(*robot.world, 2);
  ExpectPose(robot.position->est_pose, 0.05, 0.04, 0, 0);
  ExpectPose(robot.position->GetPose(), 0.1, 0.08, 0, 0);
}

// Stage integrates the command before the motion that it causes, and turns first, whereas the
// motion turns last.
TEST(Odometry, IsTheMotionThatWasMade) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0, 1);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 0, 0, 0, 0);
  ExpectPose(robot.position->GetPose(), 0.05, 0, 0, 0.1);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 0.05, 0, 0, 0.1);
}

TEST(Odometry, WithoutErrorsDoesNotDrift) {
  for (const char* drive : {"diff", "omni", "car"})
    for (const int step : {5, 20, 100})
      for (const int interval : {step, 100, 130}) {
        Robot robot("pose [1 2 0 30] localization \"odom\" odom_error [0 0 0 0] update_interval " +
                        std::to_string(interval) + " drive \"" + drive + "\"",
                    "interval_sim " + std::to_string(step));
        ModelPosition& p = *robot.position;
        double worst = 0;
        for (int i = 0; i < 600 * 1000 / step; i++) {
          if (i % 997 == 0) p.SetSpeed(0.5 + 0.001 * (i % 7), 0.1, 0.3 - 0.1 * (i % 11));
          Step(*robot.world);
          const Pose seen = p.est_origin + p.est_pose, truth = p.GetSensedPose();
          worst = std::max({worst, std::hypot(seen.x - truth.x, seen.y - truth.y),
                            std::fabs(std::remainder(seen.a - truth.a, 2 * M_PI))});
        }
        EXPECT_LT(worst, 1e-9) << drive << ", steps of " << step << " ms, updates each "
                               << interval;
        EXPECT_NE(p.GetPose().x, 1);
      }
}

TEST(Odometry, ATimeWithoutSubscribersDoesNotCount) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0, 0);
  Step(*robot.world, 2);
  p.Unsubscribe();
  Step(*robot.world, 10);
  p.Subscribe();
  p.SetSpeed(0.5, 0, 0);
  Step(*robot.world, 2);
  EXPECT_NEAR(p.est_pose.x, 0.15, 1e-12);
}

// In Stage 4.3 the odometry goes on, as if the wheels slipped.
TEST(Odometry, StandsStillWhileTheRobotIsStalled) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]", "model( pose [0.7 0 0 0] )");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0, 0);
  Step(*robot.world);
  EXPECT_EQ(p.GetActualVelocity().x, 0.5);
  Step(*robot.world, 10);
  EXPECT_TRUE(p.Stalled());
  EXPECT_NEAR(p.est_pose.x, p.GetPose().x, 1e-15);
  EXPECT_LT(p.GetPose().x, 0.31);
  EXPECT_EQ(p.GetVelocity().x, 0.5);  // the command is still in force
  for (const Velocity& v : {p.GetActualVelocity(), p.GetEstimatedVelocity()})
    ExpectPose(v, 0, 0, 0, 0);
}

TEST(Odometry, ErrorsAreSharesOfTheMotionThatWasMade) {
  Robot robot("drive \"omni\" localization \"odom\" odom_error [0.1 -0.2 0 5.729577951308232]");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0.4, 1);
  Step(*robot.world, 2);
  ExpectPose(p.est_pose, 0.055, 0.032, 0, 0.11);
  ExpectPose(p.GetEstimatedVelocity(), 0.55, 0.32, 0, 1.1);
  ExpectPose(p.GetActualVelocity(), 0.5, 0.4, 0, 1);
}

// The estimate is a public variable, which a client may set.
TEST(Odometry, ContinuesFromAClientsEstimate) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0, 0);
  Step(*robot.world, 3);
  p.est_pose = Pose(7, 8, 0, M_PI / 2);
  Step(*robot.world, 2);
  ExpectPose(p.est_pose, 7, 8.1, 0, M_PI / 2);
}

TEST(Odometry, ErrorsAreDrawnFromNarrowIntervals) {
  std::string text;
  for (int i = 0; i < 300; i++) text += "position( name \"r" + std::to_string(i) + "\" )\n";
  const auto world = LoadText(text);
  Velocity largest, sum;
  for (int i = 0; i < 300; i++) {
    const Velocity e = Find<ModelPosition>(*world, "r" + std::to_string(i))->GetOdomError();
    EXPECT_LE(std::fabs(e.x), 0.015);
    EXPECT_LE(std::fabs(e.y), 0.015);
    EXPECT_EQ(e.z, 0);
    EXPECT_LE(std::fabs(e.a), 0.025);
    largest =
        Velocity(std::max(largest.x, e.x), std::max(largest.y, e.y), 0, std::max(largest.a, e.a));
    sum = Velocity(sum.x + e.x, sum.y + e.y, 0, sum.a + e.a);
  }
  EXPECT_GT(largest.x, 0.014);
  EXPECT_GT(largest.y, 0.014);
  EXPECT_GT(largest.a, 0.0235);
  EXPECT_NEAR(sum.x / 300, 0, 0.002);
  EXPECT_NEAR(sum.a / 300, 0, 0.003);
}

TEST(Odometry, SetOdomMakesTheEstimateReadThat) {
  Robot robot("pose [1 30 0 90] localization \"odom\" odom_error [0 0 0 0]");
  robot.position->SetOdom(Pose(5, 6, 0, 0.3));
  ExpectPose(robot.position->est_pose, 5, 6, 0, 0.3);
  ExpectPose(robot.position->est_origin, 5.2544, 23.4502, 0, 1.2708, 1e-4);
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 2);
  ExpectPose(robot.position->est_pose, 5 + 0.05 * std::cos(0.3), 6 + 0.05 * std::sin(0.3), 0, 0.3);
  // The estimate is the true pose at that time in the frame of est_origin.
  const Pose seen = robot.position->est_origin + robot.position->est_pose;
  ExpectPose(seen, 1, 30.05, 0, M_PI / 2);
}

TEST(Odometry, SetOdomLastsOneUpdateWithGps) {
  Robot robot("pose [1 30 0 90]");
  robot.position->SetOdom(Pose(5, 6, 0, 0.3));
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 1, 30, 0, M_PI / 2);
}

}  // namespace
}  // namespace Stg
