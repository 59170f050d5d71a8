// SPDX-License-Identifier: GPL-2.0-or-later
//
// The gripper: fingers, lift, beams, contacts, what it holds. The figures are those of Stage 4.3,
// except where a comment says that Stage is deliberately not followed.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "model_testing.hh"
#include "models/block.hh"
#include "support/crowd.hh"

namespace Stg {
namespace {

using Gripper = ModelGripper;

/// A robot with a subscribed gripper "r.g", of which the fingers reach from x = 0.198 to 0.33 and
/// from y = -0.15 to 0.15, at a height of 0.02 to 0.1.
struct Robot {
  explicit Robot(const std::string& rest = "", const std::string& properties = "",
                 const std::string& pose = "0 0 0 0")
      : world(LoadText("position( name \"r\" pose [" + pose +
                       "] size [0.3 0.3 0.22] gripper( name \"g\" pose [0.23 0 -0.2 0] " +
                       properties + " ) )\n" + rest)),
        gripper(FindRunning<Gripper>(*world, "r.g")) {}
  Gripper::config_t Step(int count = 1) {
    Stg::Step(*world, count);
    return gripper->GetConfig();
  }
  std::unique_ptr<World> world;
  Gripper* gripper;
};

std::string Puck(const std::string& pose = "0.25 0 0 0", const std::string& more = "") {
  return "model( name \"puck\" pose [" + pose +
         "] size [0.08 0.08 0.1] gripper_return 1 color \"blue\" " + more + " )\n";
}

/// The box that a block of the gripper fills, in the gripper's frame.
bounds3d_t BoxOf(const Model* model, size_t index) {
  const Block& block = *model->body().blocks().at(index);
  bounds3d_t box(Bounds(1e9, -1e9), Bounds(1e9, -1e9), block.z_range());
  for (const point_t& p : block.points()) {
    box.x = Bounds(std::min(box.x.min, p.x), std::max(box.x.max, p.x));
    box.y = Bounds(std::min(box.y.min, p.y), std::max(box.y.max, p.y));
  }
  return box;
}

void ExpectBounds(const Bounds& bounds, double min, double max) {
  EXPECT_NEAR(bounds.min, min, 1e-9);
  EXPECT_NEAR(bounds.max, max, 1e-9);
}

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

// Stage scales the proportions by unit_length and does not move the beams.
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

// In Stage the fingers of a moving gripper jump to wrong places.
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

/// What a ray across the gripper's fingers meets, from outside.
double DistanceToFingers(const World& world, double z) {
  const auto any = [](Model*, const Model*, const void*) { return true; };
  return const_cast<World&>(world)
      .Raytrace(Pose(0.3, -1, z, M_PI / 2), 5, any, nullptr, nullptr, true)
      .range;
}

TEST(GripperBody, IsDrawnWhereItIs) {
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

// In Stage the fingers then refer to deleted blocks.
TEST(GripperBody, FurtherBlocksAreFurtherBody) {
  const auto world = LoadText(
      "gripper( name \"g\" block( points 4 point[0] [0.1 -0.15] point[1] [0.3 -0.15]\n"
      "  point[2] [0.3 0.15] point[3] [0.1 0.15] z [0 0.2] ) )");
  auto* gripper = FindRunning<Gripper>(*world, "g");
  ASSERT_EQ(gripper->body().blocks().size(), 4u);
  ExpectBounds(BoxOf(gripper, 0).x, -0.1, -0.066);  // all together fill the size
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
  EXPECT_EQ(robot.gripper->GetConfig().gripped, nullptr);  // these are not settings
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

TEST(Gripper, MotionGoesOnUnderAnotherCommand) {
  Robot robot;
  robot.gripper->CommandClose();
  robot.Step(2);
  robot.gripper->SetCommand(Gripper::CMD_NOOP);
  EXPECT_NEAR(robot.Step(2).paddle_position, 0.2, 1e-9);
  robot.gripper->SetCommand(Gripper::CMD_UP);
  const Gripper::config_t config = robot.Step(2);
  EXPECT_NEAR(config.paddle_position, 0.3, 1e-9);
  EXPECT_NEAR(config.lift_position, 0.1, 1e-9);
  robot.gripper->CommandOpen();  // turns round, the lift goes on
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

// ---- sensing and gripping -----------------------------------------------------------------------

TEST(Gripper, CaseOfStage) {
  Robot robot(Puck());
  World& world = *robot.world;
  Model* puck = Find(world, "puck");
  Gripper::config_t config = robot.Step();
  EXPECT_EQ(config.beam[0], puck);
  EXPECT_EQ(config.beam[1], puck);
  EXPECT_EQ(config.contact[0], nullptr);
  robot.Step();
  robot.gripper->CommandClose();  // after the update at 0.2 s
  EXPECT_NEAR(robot.Step().paddle_position, 0.05, 1e-12);

  config = robot.Step(9);
  EXPECT_EQ(config.gripped, nullptr);
  config = robot.Step();  // 1.3 s
  EXPECT_EQ(world.SimTimeNow(), 1300000u);
  EXPECT_NEAR(config.paddle_position, 0.55, 1e-9);
  EXPECT_EQ(config.gripped, puck);
  EXPECT_TRUE(config.paddles_stalled);
  EXPECT_NEAR(config.close_limit, 0.68, 1e-9);
  EXPECT_EQ(puck->Parent(), robot.gripper);
  ExpectPose(puck->GetGlobalPose(), 0.23, 0, 0.02, 0);

  config = robot.Step();
  EXPECT_EQ(config.beam[1], nullptr);
  EXPECT_NE(config.beam[0], nullptr);
  config = robot.Step(2);  // 1.6 s
  EXPECT_EQ(config.paddles, Gripper::PADDLE_CLOSED);
  EXPECT_NEAR(config.paddle_position, 0.68, 1e-9);
  EXPECT_EQ(config.beam[0], nullptr);
  EXPECT_EQ(config.beam[1], nullptr);
  EXPECT_EQ(config.contact[0], puck);
  EXPECT_EQ(config.contact[1], puck);

  robot.Step(14);
  robot.gripper->CommandUp();  // at 3.0 s
  EXPECT_EQ(robot.Step(19).lift, Gripper::LIFT_UPPING);
  EXPECT_EQ(robot.Step().lift, Gripper::LIFT_UP);
  robot.Step(5);
  robot.gripper->CommandOpen();  // at 5.5 s
  EXPECT_EQ(robot.Step().gripped, nullptr);
  EXPECT_EQ(puck->Parent(), nullptr);
  ExpectPose(puck->GetPose(), 0.23, 0, 0.02, 0);
}

TEST(Gripper, CarriesAndDropsWhereItIs) {
  Robot robot(Puck("3.25 4 0 30"), "", "3 4 0 0");
  auto* drive = FindRunning<ModelPosition>(*robot.world, "r");
  Model* puck = Find(*robot.world, "puck");
  robot.gripper->CommandClose();
  robot.Step(20);
  drive->SetSpeed(0.5, 0, 0);
  robot.Step(10);
  ExpectPose(puck->GetGlobalPose(), 3.73, 4, 0.02, 0);
  drive->SetSpeed(0, 0, M_PI / 4);
  robot.Step(20);
  ExpectPose(puck->GetGlobalPose(), 3.5, 4.23, 0.02, M_PI / 2);
  drive->Stop();
  robot.Step();
  robot.gripper->CommandOpen();
  robot.Step();
  ExpectPose(puck->GetPose(), 3.5, 4.23, 0.02, M_PI / 2);
  // Stage loses it: it is nobody's child.
  const std::vector<Model*>& top = robot.world->GetChildren();
  EXPECT_EQ(std::count(top.begin(), top.end(), puck), 1);
  EXPECT_EQ(puck->Root(), puck);
  EXPECT_TRUE(robot.gripper->GetChildren().empty());
}

TEST(Gripper, CanGripAgain) {
  Robot robot(Puck());
  for (int i = 0; i < 3; i++) {
    robot.gripper->CommandClose();
    EXPECT_EQ(robot.Step(20).gripped, Find(*robot.world, "puck"));
    robot.gripper->CommandOpen();
    EXPECT_EQ(robot.Step(21).gripped, nullptr);
    EXPECT_EQ(robot.gripper->GetConfig().close_limit, 1);
  }
}

TEST(Gripper, HoldsItInItsOwnPlaceWithoutStackingToo) {
  Robot robot(Puck(), "stack_children 0");
  robot.gripper->CommandClose();
  robot.Step(20);
  ExpectPose(Find(*robot.world, "puck")->GetGlobalPose(), 0.23, 0, 0.02, 0);
}

TEST(Gripper, SeesOnlyWhatCanBeGripped) {
  Robot robot("model( name \"stone\" pose [0.25 0 0 0] size [0.08 0.08 0.1] )");
  robot.gripper->CommandClose();
  Gripper::config_t config = robot.Step(20);
  EXPECT_EQ(config.paddles, Gripper::PADDLE_CLOSED);
  EXPECT_FALSE(config.beam[0] || config.beam[1] || config.contact[0] || config.gripped);
  robot.gripper->CommandOpen();
  robot.Step(20);
  Find(*robot.world, "stone")->SetGripperReturn(true);
  EXPECT_NE(robot.Step().beam[0], nullptr);
}

TEST(Gripper, LooksAtTheHeightOfItsBase) {
  for (const double z : {-0.09, -0.07, 0.01, 0.03}) {  // the beams are at 0.02
    Robot robot(Puck("0.25 0 " + std::to_string(z) + " 0"));
    EXPECT_EQ(robot.Step().beam[0] != nullptr, z > -0.08 && z < 0.02) << z;
  }
}

TEST(Gripper, InnerAndOuterBeam) {
  Robot robot(Puck("0.335 0 0 0"));  // its near side is at 0.295, the beams are at 0.231 and 0.297
  Gripper::config_t config = robot.Step();
  EXPECT_EQ(config.beam[0], nullptr);
  EXPECT_NE(config.beam[1], nullptr);
  Find(*robot.world, "puck")->SetPose(Pose(0.4, 0, 0, 0));
  config = robot.Step();
  EXPECT_FALSE(config.beam[0] || config.beam[1]);
}

TEST(Gripper, EachFingerHasItsContact) {
  Robot robot(Puck("0.27 0.13 0 0"));  // on the +y side
  Gripper::config_t config = robot.Step();
  EXPECT_NE(config.contact[0], nullptr);
  EXPECT_EQ(config.contact[1], nullptr);
  EXPECT_TRUE(config.paddles_stalled);
  EXPECT_EQ(config.gripped, nullptr);  // it is not closing
  Find(*robot.world, "puck")->SetPose(Pose(0.27, -0.13, 0, 0));
  config = robot.Step();
  EXPECT_EQ(config.contact[0], nullptr);
  EXPECT_NE(config.contact[1], nullptr);
  robot.gripper->CommandClose();
  EXPECT_NE(robot.Step().gripped, nullptr);
}

TEST(Gripper, NeverGripsItsOwnRobot) {
  const auto world = LoadText(
      "position( name \"r\" size [0.3 0.3 0.22] gripper_return 1\n"
      "  gripper( name \"g\" pose [0.05 0 -0.2 0] ) )");
  auto* gripper = FindRunning<Gripper>(*world, "r.g");
  gripper->CommandClose();
  Stg::Step(*world, 20);
  EXPECT_EQ(gripper->GetConfig().gripped, nullptr);
  EXPECT_EQ(gripper->GetConfig().contact[0], Find(*world, "r"));
  EXPECT_EQ(gripper->Parent(), Find(*world, "r"));
}

TEST(Gripper, LetsGoOfWhatIsTakenAway) {
  Robot robot(Puck());
  Model* puck = Find(*robot.world, "puck");
  robot.gripper->CommandClose();
  EXPECT_EQ(robot.Step(20).gripped, puck);
  puck->SetParent(nullptr);
  puck->SetPose(Pose(5, 0, 0, 0));
  EXPECT_EQ(robot.gripper->GetConfig().gripped, nullptr);
  EXPECT_EQ(robot.gripper->GetConfig().close_limit, 1);
  ExpectPose((robot.Step(5), puck->GetPose()), 5, 0, 0, 0);

  robot.gripper->CommandOpen();
  robot.Step(20);
  puck->SetPose(Pose(0.25, 0, 0, 0));
  robot.gripper->CommandClose();
  EXPECT_EQ(robot.Step(20).gripped, puck);
  delete puck;
  EXPECT_EQ(robot.gripper->GetConfig().gripped, nullptr);
  robot.gripper->CommandOpen();
  EXPECT_EQ(robot.Step(20).paddles, Gripper::PADDLE_OPEN);
}

// Stage lets go and snatches again, for ever.
TEST(Gripper, AutosnatchClosesAndHolds) {
  Robot robot("", "autosnatch 1");
  EXPECT_EQ(robot.Step(5).paddles, Gripper::PADDLE_OPEN);
  auto* puck = robot.world->CreateModel(nullptr, "model");
  puck->SetGeom(Geom(Pose(), Size(0.08, 0.08, 0.1)));
  puck->SetGripperReturn(true);
  puck->SetPose(Pose(0.25, 0, 0, 0));
  EXPECT_EQ(robot.Step(1).paddle_position, 0);
  EXPECT_NEAR(robot.Step(1).paddle_position, 0.05, 1e-12);
  EXPECT_EQ(robot.Step(20).gripped, puck);
  for (int i = 0; i < 20; i++) EXPECT_EQ(robot.Step().gripped, puck);
  EXPECT_EQ(robot.gripper->GetConfig().paddles, Gripper::PADDLE_CLOSED);
  puck->SetParent(nullptr);
  puck->SetPose(Pose(9, 9, 0, 0));
  EXPECT_EQ(robot.Step(25).paddles, Gripper::PADDLE_OPEN);
}

TEST(Gripper, SnatchesFromAnother) {
  const auto world = LoadText("gripper( name \"a\" )\ngripper( name \"b\" pose [0.16 0 0 180] )\n" +
                              Puck("0.08 0 0 0"));
  auto *a = FindRunning<Gripper>(*world, "a"), *b = FindRunning<Gripper>(*world, "b");
  a->CommandClose();
  Stg::Step(*world, 20);
  Model* puck = Find(*world, "puck");
  EXPECT_EQ(a->GetConfig().gripped, puck);
  b->SetPose(Pose(0.06, 0, 0, M_PI));
  b->CommandClose();
  Stg::Step(*world, 20);
  EXPECT_EQ(b->GetConfig().gripped, puck);
  EXPECT_EQ(a->GetConfig().gripped, nullptr);
  EXPECT_EQ(puck->Parent(), b);
}

int Delete(Model*, void* victim) {
  delete static_cast<Model*>(victim);
  return 1;
}

TEST(Gripper, ModelsMayBeDeletedWhileItsRaysWait) {
  Robot robot(Puck());
  robot.gripper->CommandClose();
  robot.Step(10);
  robot.world->Enqueue(0, 100000, Find(*robot.world, "r"), Delete, Find(*robot.world, "puck"));
  EXPECT_EQ(robot.Step(15).gripped, nullptr);
  robot.world->Enqueue(0, 100000, Find(*robot.world, "r"), Delete, robot.gripper);
  Stg::Step(*robot.world, 3);
  EXPECT_EQ(robot.world->GetAllModels().size(), 2u);  // the ground and the robot
}

TEST(Gripper, CallbacksMayDeleteWhatAnotherGripperTouches) {
  const auto world = LoadText("gripper( name \"a\" )\ngripper( name \"b\" pose [5 0 0 0] )\n" +
                              Puck("0.05 0 0 0") +
                              "model( name \"other\" pose [5.05 0 0 0] size [0.08 0.08 0.1] "
                              "gripper_return 1 )\n");
  auto *a = FindRunning<Gripper>(*world, "a"), *b = FindRunning<Gripper>(*world, "b");
  Find(*world, "puck")->AddCallback(Model::CB_PARENT, Delete, Find(*world, "other"));
  a->CommandClose();
  b->CommandClose();
  Stg::Step(*world, 20);
  EXPECT_EQ(a->GetConfig().gripped, Find(*world, "puck"));
  EXPECT_EQ(b->GetConfig().gripped, nullptr);
}

TEST(Gripper, LoadedAgainItLetsGoAndKeepsItsBody) {
  const auto world = LoadText(
      "gripper( name \"g\" paddle_state [\"open\" \"down\"]\n"
      "  block( points 3 point[0] [0 0] point[1] [0.05 0] point[2] [0 0.05] z [0 0.1] ) )\n" +
      Puck("0.05 0 0 0"));
  auto* gripper = FindRunning<Gripper>(*world, "g");
  gripper->CommandClose();
  Stg::Step(*world, 20);
  EXPECT_NE(gripper->GetConfig().gripped, nullptr);
  world->Reload();
  EXPECT_EQ(gripper->GetConfig().gripped, nullptr);
  EXPECT_EQ(gripper->GetConfig().paddle_position, 0);
  EXPECT_EQ(gripper->body().blocks().size(), 4u);
  ExpectBounds(BoxOf(gripper, 1).y, -0.15, -0.12);
  ExpectPose(Find(*world, "puck")->GetPose(), 0.05, 0, 0, 0);
}

// ---- the same however it is run -----------------------------------------------------------------

TEST(Gripper, ResultsDoNotDependOnHowTheyAreMade) {
  const auto bot_and_thing = [](int i) {
    const std::string row = std::to_string(i / 8 * 0.8);
    return "bot( pose [" + std::to_string(i % 8 * 0.8) + " " + row + " 0 " +
           std::to_string(i * 37) + "] )\nthing( pose [" + std::to_string(i % 8 * 0.8 + 0.4) + " " +
           std::to_string(i / 8 * 0.8 + 0.1) + " 0 0] )\n";
  };
  const auto look = [](const crowd::Robots& robots, std::vector<double>* held) {
    for (size_t i = 0; i < robots.size(); i++)
      if (dynamic_cast<Gripper*>(robots[i]->GetChildren()[0])->GetConfig().gripped)
        held->push_back(static_cast<double>(i));
  };
  const crowd::Outcome outcome = crowd::ExpectSameHoweverItIsRun(
      {"define bot position( size [0.3 0.3 0.22] alwayson 1\n"
       "  gripper( pose [0.23 0 -0.2 0] alwayson 1 autosnatch 1 )\n"
       "  ranger( alwayson 1 sensor( samples 60 fov 360 range [0 3] ) ) )\n"
       "define thing model( size [0.08 0.08 0.1] gripper_return 1 obstacle_return 0 )\n" +
           crowd::Repeat(60, bot_and_thing),
       60, 0.2, [](size_t i) { return i % 2 ? 0.3 : -0.2; }, look});
  EXPECT_GT(outcome.sensed.size(), 100u);  // some of them for a while
}

}  // namespace
}  // namespace Stg
