// SPDX-License-Identifier: GPL-2.0-or-later
//
// Stalls of position models, and position models on other models.

#include <algorithm>
#include <cmath>

#include "position_testing.hh"

namespace Stg {
namespace {

// ---- stalls -------------------------------------------------------------------------------------

/// Drives a robot that was stopped by a box away and back, and takes the box away.
void ExpectRetries(Robot* robot) {
  ModelPosition& p = *robot->position;
  p.Stop();
  Step(*robot->world, 3);
  EXPECT_TRUE(p.Stalled());  // unchanged, because no move was tried
  p.SetSpeed(-0.5, 0, 0);
  Step(*robot->world);
  EXPECT_FALSE(p.Stalled());
  p.SetSpeed(0.5, 0, 0);
  Step(*robot->world, 3);
  EXPECT_TRUE(p.Stalled());
  Find(*robot->world, "box")->SetPose(Pose(10, 0, 0, 0));
  Step(*robot->world);
  EXPECT_FALSE(p.Stalled());  // the robot goes on without a new command
}

/// Makes four steps. Returns a digit for each: 1 if the robot was stalled.
std::string StallsOfFourSteps(Robot* robot) {
  std::string stalled;
  for (int i = 0; i < 4; i++) {
    Step(*robot->world);
    stalled += robot->position->Stalled() ? '1' : '0';
  }
  return stalled;
}

TEST(Stall, OfCellsRejectsTheMoveAndRetries) {
  // The robot's front is at 0.2 and the face of the box at 0.29, so one step of 0.05 is free.
  Robot robot("", "contacts \"cells\"\nmodel( name \"box\" pose [0.49 0 0 0] size [0.4 0.4 1] )");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0, 0.05);
  EXPECT_EQ(StallsOfFourSteps(&robot), "0111");
  ExpectPose(p.GetPose(), 0.05, 0, 0, 0.005);  // not turned either
  ExpectPose(p.GetVelocity(), 0.5, 0, 0, 0.05);
  ExpectRetries(&robot);
}

TEST(Stall, OfOutlinesEndsAtTheFaceAndRetries) {
  Robot robot("",
              "contacts \"outlines\"\nmodel( name \"box\" pose [0.49 0 0 0] size [0.4 0.4 1] )");
  ModelPosition& p = *robot.position;
  p.SetSpeed(0.5, 0, 0);
  EXPECT_EQ(StallsOfFourSteps(&robot), "0111");
  ExpectPose(p.GetPose(), 0.0896, 0, 0, 0, 1e-6);  // 0.4 mm before the face
  ExpectPose(p.GetVelocity(), 0.5, 0, 0, 0);
  ExpectRetries(&robot);
}

TEST(Stall, ABodyBelowTheGroundNeverMoves) {
  Robot robot("pose [0 0 -0.01 0]");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world, 3);
  ExpectPose(robot.position->GetPose(), 0, 0, -0.01, 0);
  EXPECT_TRUE(robot.position->Stalled());
}

TEST(Stall, SetStallClearsTheFlag) {
  Robot robot("pose [0 0 -0.01 0]");
  robot.position->SetSpeed(0.5, 0, 0);
  Step(*robot.world);
  robot.position->Stop();
  robot.position->SetStall(false);
  Step(*robot.world, 2);
  EXPECT_FALSE(robot.position->Stalled());
}

TEST(Stall, ADisabledRobotStaysWhereItIs) {
  Robot robot("");
  ModelPosition& p = *robot.position;
  EXPECT_TRUE(p.IsEnabled());
  p.SetSpeed(0.5, 0, 0);
  p.Disable();
  EXPECT_FALSE(p.IsEnabled());
  Step(*robot.world, 3);
  ExpectPose(p.GetPose(), 0, 0, 0, 0);
  EXPECT_EQ(p.GetVelocity().x, 0.5);
  EXPECT_FALSE(p.Stalled());
  p.Enable();
  Step(*robot.world);
  ExpectPose(p.GetPose(), 0.05, 0, 0, 0);
}

// ---- positions on positions ---------------------------------------------------------------------

TEST(Attached, MoveInTheirParentsFrame) {
  const auto world = LoadText(
      "position( name \"ship\" pose [1 2 0 90] size [2 2 0.5]\n"
      "  position( name \"deck\" pose [0.3 0 0 90] drive \"omni\"\n"
      "    position( name \"toy\" pose [0 0.1 0 0] ) ) )");
  ModelPosition* ship = FindRunning<ModelPosition>(*world, "ship");
  ModelPosition* deck = FindRunning<ModelPosition>(*world, "ship.deck");
  ModelPosition* toy = FindRunning<ModelPosition>(*world, "ship.deck.toy");
  ship->SetSpeed(0.5, 0, 0);
  deck->SetSpeed(0.1, 0.2, 0);
  toy->SetSpeed(0, 0, 0.5);
  Step(*world, 2);
  ExpectPose(ship->GetPose(), 1, 2.1, 0, M_PI / 2);
  ExpectPose(deck->GetPose(), 0.3 - 0.04, 0.02, 0, M_PI / 2);
  ExpectPose(toy->GetPose(), 0, 0.1, 0, 0.1);
  ExpectPose(deck->GetGlobalPose(), 1 - 0.02, 2.1 + 0.26, 0.5, M_PI);
  ExpectPose(toy->GetGlobalPose(), 0.98, 2.36 - 0.1, 1.5, M_PI + 0.1 - 2 * M_PI);
  EXPECT_FALSE(ship->Stalled() || deck->Stalled() || toy->Stalled());
}

TEST(Attached, ACarriedBodyStallsItsCarrierOnly) {
  const auto world = LoadText(
      "position( name \"ship\" size [0.4 0.4 0.5]\n"
      "  position( name \"mast\" size [0.2 0.2 2] ) )\n"
      "model( name \"bridge\" pose [0.35 0 0.6 0] size [0.4 2 0.2] )");
  ModelPosition* ship = FindRunning<ModelPosition>(*world, "ship");
  ModelPosition* mast = FindRunning<ModelPosition>(*world, "ship.mast");
  ship->SetSpeed(0.5, 0, 0);
  Step(*world, 2);
  EXPECT_TRUE(ship->Stalled());  // only the mast collides with the bridge
  EXPECT_FALSE(mast->Stalled());
  EXPECT_LT(ship->GetPose().x, 0.06);
  mast->SetPose(Pose(-0.5, 0, 0, 0));
  Step(*world, 2);
  EXPECT_FALSE(ship->Stalled());
}

}  // namespace
}  // namespace Stg
