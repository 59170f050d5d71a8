// SPDX-License-Identifier: GPL-2.0-or-later
//
// Beams, contacts and gripping of grippers. Figures are those of Stage 4.3, except where a comment
// describes a deliberate difference.

#include <algorithm>
#include <cmath>

#include "gripper_testing.hh"
#include "support/crowd.hh"

namespace Stg {
namespace {

// ---- sensing and gripping -----------------------------------------------------------------------

TEST(Gripper, MatchesStageReferenceCase) {
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
  // In Stage 4.3 the puck then has no parent and is not a child of the world.
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

TEST(Gripper, HoldsAtTheSamePlaceWithoutStacking) {
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
  EXPECT_EQ(config.gripped, nullptr);  // the gripper is not closing
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

TEST(Gripper, ReleasesAModelThatIsTakenAway) {
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

// Stage 4.3 releases and snatches again endlessly.
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

TEST(Gripper, ModelsCanBeDeletedWithPendingRays) {
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

TEST(Gripper, ReloadingReleasesAndKeepsTheBody) {
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

// ---- equal results with any options -------------------------------------------------------------

TEST(Gripper, ResultsDoNotDependOnTheMethod) {
  const auto bot_and_thing = [](int i) {
    const int column = i % 8, row = i / 8;
    return "bot( pose [" + std::to_string(column * 0.8) + " " + std::to_string(row * 0.8) + " 0 " +
           std::to_string(i * 37) + "] )\nthing( pose [" + std::to_string(column * 0.8 + 0.4) +
           " " + std::to_string(row * 0.8 + 0.1) + " 0 0] )\n";
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
  EXPECT_GT(outcome.sensed.size(), 100u);  // some grippers hold something
}

}  // namespace
}  // namespace Stg
