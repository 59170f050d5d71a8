// SPDX-License-Identifier: GPL-2.0-or-later
//
// The gripper: fingers, lift, beams, contacts and gripping. Figures are those of Stage 4.3, except
// where a comment describes a deliberate difference.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "gripper_testing.hh"

namespace Stg {
namespace {

// ---- properties ---------------------------------------------------------------------------------

TEST(Gripper, DefaultsAreThoseOfStage) {
  const auto world = LoadText("gripper( name \"g\" )");
  Gripper* gripper = Find<Gripper>(*world, "g");
  const Gripper::config_t config = gripper->GetConfig();
  EXPECT_EQ(gripper->GetGeom().size.x, 0.2);
  EXPECT_EQ(gripper->GetGeom().size.y, 0.3);
  EXPECT_EQ(gripper->GetGeom().size.z, 0.2);
  EXPECT_EQ(gripper->GetColor(), Color(0.3, 0.3, 0.3));
  EXPECT_EQ(config.paddle_size.x, 0.66);
  EXPECT_EQ(config.paddle_size.y, 0.1);
  EXPECT_EQ(config.paddle_size.z, 0.4);
  EXPECT_EQ(config.paddles, Gripper::PADDLE_OPEN);
  EXPECT_EQ(config.lift, Gripper::LIFT_DOWN);
  EXPECT_EQ(config.paddle_position, 0);
  EXPECT_EQ(config.lift_position, 0);
  EXPECT_EQ(config.close_limit, 1);
  EXPECT_NEAR(config.break_beam_inset[0], 0.495, 1e-12);
  EXPECT_NEAR(config.break_beam_inset[1], 0.165, 1e-12);
  EXPECT_EQ(config.gripped, nullptr);
  EXPECT_FALSE(config.autosnatch || config.paddles_stalled || config.beam[0] || config.beam[1] ||
               config.contact[0] || config.contact[1]);
}

// Stage scales the proportions by unit_length, and does not adapt the beams.
TEST(Gripper, PaddleSizeIsProportions) {
  const auto world =
      LoadText("unit_length \"cm\"\ngripper( name \"g\" paddle_size [0.5 0.2 0.3] autosnatch 1 )");
  const Gripper::config_t config = Find<Gripper>(*world, "g")->GetConfig();
  EXPECT_EQ(config.paddle_size.x, 0.5);
  EXPECT_EQ(config.paddle_size.y, 0.2);
  EXPECT_EQ(config.paddle_size.z, 0.3);
  EXPECT_DOUBLE_EQ(config.break_beam_inset[0], 0.375);
  EXPECT_DOUBLE_EQ(config.break_beam_inset[1], 0.125);
  EXPECT_TRUE(config.autosnatch);
}

TEST(Gripper, PaddleState) {
  const auto world = LoadText("gripper( name \"g\" paddle_state [\"closed\" \"up\"] )");
  const Gripper::config_t config = Find<Gripper>(*world, "g")->GetConfig();
  EXPECT_EQ(config.paddles, Gripper::PADDLE_CLOSED);
  EXPECT_EQ(config.lift, Gripper::LIFT_UP);
  EXPECT_EQ(config.paddle_position, 1);
  EXPECT_EQ(config.lift_position, 1);
}

TEST(Gripper, OtherPaddleStatesChangeNothing) {
  const LoadOutcome outcome = TryToLoad("gripper( paddle_state [\"ajar\" \"half\"] )");
  EXPECT_TRUE(outcome.loaded);
  EXPECT_NE(outcome.errors.find("\"ajar\""), std::string::npos);
  EXPECT_NE(outcome.errors.find("\"half\""), std::string::npos);
  EXPECT_FALSE(TryToLoad("gripper( paddle_state [\"open\"] )").loaded);
  EXPECT_FALSE(TryToLoad("gripper( paddle_size [0.5 0.1] )").loaded);
}

TEST(Gripper, IsSavedWithItsState) {
  const std::string path = testing::TempDir() + "gripper.world";
  std::ofstream(path) << "gripper( name \"g\" paddle_size [0.6 0.1 0.4] paddle_state [\"open\" "
                         "\"down\"] update_interval 100 )\n";
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(path));
  auto* gripper = FindRunning<Gripper>(*world, "g");
  gripper->CommandClose();
  Stg::Step(*world, 20);
  gripper->CommandUp();
  Stg::Step(*world, 20);
  ASSERT_TRUE(world->Save(nullptr));
  ASSERT_TRUE(world->Load(path));
  const Gripper::config_t config = Find<Gripper>(*world, "g")->GetConfig();
  EXPECT_EQ(config.paddles, Gripper::PADDLE_CLOSED);
  EXPECT_EQ(config.lift, Gripper::LIFT_UP);
  EXPECT_EQ(config.paddle_size.x, 0.6);
  std::remove(path.c_str());
}

// ---- body ---------------------------------------------------------------------------------------

TEST(GripperBody, OpenAndDown) {
  const auto world = LoadText("gripper( name \"g\" )");
  const Model* gripper = Find(*world, "g");
  ASSERT_EQ(gripper->body().blocks().size(), 3u);
  const bounds3d_t base = BoxOf(gripper, 0), left = BoxOf(gripper, 1), right = BoxOf(gripper, 2);
  ExpectBounds(base.x, -0.1, -0.032);
  ExpectBounds(base.y, -0.15, 0.15);
  ExpectBounds(base.z, 0, 0.2);
  ExpectBounds(left.x, -0.032, 0.1);
  ExpectBounds(left.y, -0.15, -0.12);
  ExpectBounds(left.z, 0, 0.08);
  ExpectBounds(right.x, -0.032, 0.1);
  ExpectBounds(right.y, 0.12, 0.15);
  ExpectBounds(right.z, 0, 0.08);
}

TEST(GripperBody, ClosedAndUp) {
  const auto world = LoadText("gripper( name \"g\" paddle_state [\"closed\" \"up\"] )");
  const bounds3d_t left = BoxOf(Find(*world, "g"), 1), right = BoxOf(Find(*world, "g"), 2);
  ExpectBounds(left.y, -0.03, 0);
  ExpectBounds(right.y, 0, 0.03);
  ExpectBounds(left.z, 0.12, 0.2);
  ExpectBounds(right.z, 0.12, 0.2);
}

// In Stage 4.3 the fingers of a moving gripper jump to wrong places.
TEST(GripperBody, FingersMoveWithTheirPositions) {
  Robot robot;
  robot.gripper->CommandClose();
  robot.Step(10);
  robot.gripper->CommandUp();
  const Gripper::config_t config = robot.Step(5);
  EXPECT_NEAR(config.paddle_position, 0.75, 1e-9);
  EXPECT_NEAR(config.lift_position, 0.25, 1e-9);
  ExpectBounds(BoxOf(robot.gripper, 0).y, -0.15, 0.15);
  ExpectBounds(BoxOf(robot.gripper, 1).y, -0.06, -0.03);
  ExpectBounds(BoxOf(robot.gripper, 2).y, 0.03, 0.06);
  ExpectBounds(BoxOf(robot.gripper, 2).x, -0.032, 0.1);
  ExpectBounds(BoxOf(robot.gripper, 2).z, 0.03, 0.11);
}

/// The distance from outside to the fingers, along a ray across them.
double DistanceToFingers(const World& world, double z) {
  const auto any = [](Model*, const Model*, const void*) { return true; };
  return const_cast<World&>(world)
      .Raytrace(Pose(0.3, -1, z, M_PI / 2), 5, any, nullptr, nullptr, true)
      .range;
}

TEST(GripperBody, IsRasterizedAtItsPosition) {
  Robot robot;
  EXPECT_NEAR(DistanceToFingers(*robot.world, 0.05), 0.85, kCell);
  EXPECT_EQ(DistanceToFingers(*robot.world, 0.15), 5);
  robot.gripper->CommandClose();
  robot.Step(20);
  EXPECT_NEAR(DistanceToFingers(*robot.world, 0.05), 0.97, kCell);
  robot.gripper->CommandUp();
  robot.Step(20);
  EXPECT_EQ(DistanceToFingers(*robot.world, 0.05), 5);
  EXPECT_NEAR(DistanceToFingers(*robot.world, 0.15), 0.97, kCell);
}

TEST(GripperBody, HasTheSizeThatItIsGiven) {
  const auto world = LoadText("gripper( name \"g\" size [1 1 1] paddle_size [0.5 0.25 0.5] )");
  Model* gripper = Find(*world, "g");
  ExpectBounds(BoxOf(gripper, 1).x, 0, 0.5);
  ExpectBounds(BoxOf(gripper, 1).y, -0.5, -0.25);
  gripper->SetGeom(Geom(Pose(), Size(2, 2, 2)));
  ExpectBounds(BoxOf(gripper, 1).y, -1, -0.5);
  auto* running = FindRunning<Gripper>(*world, "g");
  running->CommandClose();
  Stg::Step(*world, 20);
  ExpectBounds(BoxOf(gripper, 1).y, -0.5, 0);
  ExpectBounds(BoxOf(gripper, 1).x, 0, 1);
}

// In Stage 4.3 the fingers then point to deleted blocks.
TEST(GripperBody, AdditionalBlocksExtendTheBody) {
  const auto world = LoadText(
      "gripper( name \"g\" block( points 4 point[0] [0.1 -0.15] point[1] [0.3 -0.15]\n"
      "  point[2] [0.3 0.15] point[3] [0.1 0.15] z [0 0.2] ) )");
  auto* gripper = FindRunning<Gripper>(*world, "g");
  ASSERT_EQ(gripper->body().blocks().size(), 4u);
  ExpectBounds(BoxOf(gripper, 0).x, -0.1, -0.066);  // all blocks together fill the size
  ExpectBounds(BoxOf(gripper, 1).x, -0.066, 0);
  ExpectBounds(BoxOf(gripper, 3).x, 0, 0.1);
  gripper->CommandClose();
  Stg::Step(*world, 20);
  ExpectBounds(BoxOf(gripper, 0).x, -0.1, -0.066);
  ExpectBounds(BoxOf(gripper, 1).x, -0.066, 0);
  ExpectBounds(BoxOf(gripper, 1).y, -0.03, 0);
  ExpectBounds(BoxOf(gripper, 3).x, 0, 0.1);
  ExpectBounds(BoxOf(gripper, 3).y, -0.15, 0.15);
}

TEST(GripperBody, MayBeMissing) {
  for (const bool by_file : {true, false}) {
    Robot robot(Puck(), by_file ? "noblocks 1" : "");
    if (!by_file) {
      robot.gripper->ClearBlocks();
      for (int i = 0; i < 3; i++) robot.gripper->AddBlockRect(5, 5, 1, 1, 1);
    }
    robot.gripper->CommandClose();
    EXPECT_EQ(robot.Step(18).gripped, Find(*robot.world, "puck"));
    EXPECT_EQ(robot.gripper->body().blocks().size(), by_file ? 0u : 3u);
    if (!by_file) ExpectBounds(BoxOf(robot.gripper, 1).x, 5, 6);
  }
}

TEST(GripperBody, SetConfigKeepsTheScale) {
  Robot robot(Puck());
  Gripper::config_t config = robot.Step();
  EXPECT_NE(config.beam[0], nullptr);
  config.paddle_size = Size(0.5, 0.2, 0.5);
  config.paddle_position = 0.5;
  config.lift_position = 1;
  config.gripped = robot.gripper;
  config.beam[0] = nullptr;
  robot.gripper->SetConfig(config);
  ExpectBounds(BoxOf(robot.gripper, 0).x, -0.1, 0);
  ExpectBounds(BoxOf(robot.gripper, 1).x, 0, 0.1);
  ExpectBounds(BoxOf(robot.gripper, 1).y, -0.105, -0.045);
  ExpectBounds(BoxOf(robot.gripper, 2).z, 0.1, 0.2);
  EXPECT_EQ(robot.gripper->GetConfig().gripped, nullptr);  // outputs can't be set
  EXPECT_NE(robot.gripper->GetConfig().beam[0], nullptr);
}

// ---- motion -------------------------------------------------------------------------------------

TEST(Gripper, AFullTravelTakesTwentyUpdates) {
  Robot robot;
  Gripper& gripper = *robot.gripper;
  EXPECT_EQ(robot.Step(3).paddle_position, 0);
  gripper.CommandClose();
  EXPECT_NEAR(robot.Step().paddle_position, 0.05, 1e-12);
  EXPECT_EQ(robot.Step(18).paddles, Gripper::PADDLE_CLOSING);
  EXPECT_EQ(robot.Step().paddles, Gripper::PADDLE_CLOSED);
  EXPECT_EQ(gripper.GetConfig().paddle_position, 1);
  EXPECT_EQ(robot.Step(5).paddle_position, 1);
  gripper.CommandOpen();
  EXPECT_EQ(robot.Step(19).paddles, Gripper::PADDLE_OPENING);
  EXPECT_EQ(robot.Step().paddles, Gripper::PADDLE_OPEN);
  EXPECT_EQ(gripper.GetConfig().paddle_position, 0);

  gripper.CommandUp();
  EXPECT_EQ(robot.Step(19).lift, Gripper::LIFT_UPPING);
  EXPECT_EQ(robot.Step().lift, Gripper::LIFT_UP);
  EXPECT_EQ(gripper.GetConfig().lift_position, 1);
  gripper.CommandDown();
  EXPECT_EQ(robot.Step(19).lift, Gripper::LIFT_DOWNING);
  EXPECT_EQ(robot.Step().lift, Gripper::LIFT_DOWN);
  EXPECT_EQ(gripper.GetConfig().lift_position, 0);
}

TEST(Gripper, MotionContinuesDuringAnotherCommand) {
  Robot robot;
  robot.gripper->CommandClose();
  robot.Step(2);
  robot.gripper->SetCommand(Gripper::CMD_NOOP);
  EXPECT_NEAR(robot.Step(2).paddle_position, 0.2, 1e-9);
  robot.gripper->SetCommand(Gripper::CMD_UP);
  const Gripper::config_t config = robot.Step(2);
  EXPECT_NEAR(config.paddle_position, 0.3, 1e-9);
  EXPECT_NEAR(config.lift_position, 0.1, 1e-9);
  robot.gripper->CommandOpen();  // reverses the fingers; the lift goes on
  EXPECT_NEAR(robot.Step(2).paddle_position, 0.2, 1e-9);
  EXPECT_NEAR(robot.gripper->GetConfig().lift_position, 0.2, 1e-9);
}

TEST(Gripper, WithoutSubscribersNothingMoves) {
  Robot robot(Puck());
  robot.gripper->CommandClose();
  robot.Step(3);
  robot.gripper->Unsubscribe();
  EXPECT_NEAR(robot.Step(20).paddle_position, 0.15, 1e-9);
}

}  // namespace
}  // namespace Stg
