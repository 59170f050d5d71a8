// SPDX-License-Identifier: GPL-2.0-or-later
//
// Where positions believe to be: GPS and odometry. The figures are those of Stage 4.3, except where
// a comment says that it is deliberately not followed.

#include <algorithm>
#include <cmath>

#include "position_testing.hh"

namespace Stg {
namespace {

// ---- localization -------------------------------------------------------------------------------

TEST(Localization, GpsTellsThePoseBeforeTheMove) {
  Robot robot("pose [1 2 0 90]");
  ExpectPose(robot.position->est_pose, 0, 0, 0, 0);
  ExpectPose(robot.position->est_origin, 1, 2, 0, M_PI / 2);
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 1, 2, 0, M_PI / 2);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 1, 2.05, 0, M_PI / 2);
  ExpectPose(robot.position->GetPose(), 1, 2.1, 0, M_PI / 2);
}

TEST(Localization, OriginCountsInTheFirstEstimateOnly) {
  Robot robot("pose [3 2 0 0] localization_origin [1 2 0.5 450]");
  EXPECT_DOUBLE_EQ(robot.position->est_origin.a, 2.5 * M_PI);  // as it was given
  ExpectPose(robot.position->est_pose, 0, -2, 0, -M_PI / 2);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 3, 2, 0, 0);
}

TEST(Odometry, StartsAtTheOriginGiven) {
  Robot robot(
      "pose [3 2 0 0] localization \"odom\" localization_origin [0 0 0 0]"
      " odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 2);
  ExpectPose(robot.position->est_pose, 3.1, 2, 0, 0);
}

// Stage gives the sideways part the wrong sign: (0.05, -0.04).
TEST(Odometry, SidewaysIsToTheLeft) {
  Robot robot("drive \"omni\" localization \"odom\" odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0.4, 0);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 0.05, 0.04, 0, 0);
  ExpectPose(robot.position->GetPose(), 0.05, 0.04, 0, 0);
}

TEST(Odometry, TurnsFirstThenMoves) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]");
  robot.position->SetSpeed(0.5, 0, 1);
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 0.05 * std::cos(0.1), 0.05 * std::sin(0.1), 0, 0.1);
  ExpectPose(robot.position->GetPose(), 0.05, 0, 0, 0.1);
}

// Stage adds one step for each update however long ago the last one was.
TEST(Odometry, CountsTheTimeSinceTheLastUpdate) {
  for (const int interval : {100, 200, 400}) {
    Robot robot("localization \"odom\" odom_error [0 0 0 0] update_interval " +
                std::to_string(interval));
    robot.position->SetSpeed(0.5, 0, 0);
    Step(*robot.world, 8);
    EXPECT_NEAR(robot.position->est_pose.x, 0.4, 1e-12) << interval;
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
  Step(*robot.world);
  EXPECT_NEAR(p.est_pose.x, 0.15, 1e-12);
}

TEST(Odometry, CountsWheelSlip) {
  Robot robot("localization \"odom\" odom_error [0 0 0 0]", "model( pose [0.7 0 0 0] )");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 10);
  EXPECT_NEAR(robot.position->est_pose.x, 0.5, 1e-12);
  EXPECT_LT(robot.position->GetPose().x, 0.31);
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
  Step(*robot.world);
  ExpectPose(robot.position->est_pose, 5 + 0.05 * std::cos(0.3), 6 + 0.05 * std::sin(0.3), 0, 0.3);
  // The true pose, seen in the frame of est_origin, is the estimate.
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
