// SPDX-License-Identifier: GPL-2.0-or-later
//
// The actuator: start position, motion and stops. In Stage 4.3 actuators never move.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>

#include "support/model_testing.hh"

namespace Stg {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A world with a subscribed actuator "j".
struct Joint {
  explicit Joint(const std::string& properties, const std::string& rest = "")
      : world(LoadText("actuator( name \"j\" size [0.2 0.2 0.2] " + properties + " )\n" + rest)),
        actuator(FindRunning<ModelActuator>(*world, "j")) {}
  double PositionAfter(int steps) {
    Step(*world, steps);
    return actuator->GetPosition();
  }
  std::unique_ptr<World> world;
  ModelActuator* actuator;
};

// ---- properties ---------------------------------------------------------------------------------

TEST(Actuator, Defaults) {
  const auto world = LoadText("actuator( name \"j\" pose [1 2 3 45] )");
  const ModelActuator* joint = Find<ModelActuator>(*world, "j");
  EXPECT_EQ(joint->GetType(), ModelActuator::TYPE_LINEAR);
  EXPECT_EQ(joint->GetAxis().x, 1);  // in Stage (0, 0, 0)
  EXPECT_EQ(joint->GetAxis().y, 0);
  EXPECT_EQ(joint->GetMaxPosition(), 1);
  EXPECT_EQ(joint->GetMinPosition(), 0);
  EXPECT_EQ(joint->GetSpeed(), 0);
  EXPECT_EQ(joint->GetPosition(), 0);
  ExpectPose(joint->GetPose(), 1, 2, 3, M_PI / 4);
}

TEST(Actuator, PropertiesAreRead) {
  const auto world = LoadText(
      "unit_angle \"radians\"\nactuator( name \"j\" type \"rotational\" max_position 3 "
      "min_position -2 )\n"
      "actuator( name \"k\" type \"linear\" axis [0 3 4] )");
  const ModelActuator *j = Find<ModelActuator>(*world, "j"), *k = Find<ModelActuator>(*world, "k");
  EXPECT_EQ(j->GetType(), ModelActuator::TYPE_ROTATIONAL);
  EXPECT_EQ(j->GetMaxPosition(), 3);
  EXPECT_EQ(j->GetMinPosition(), -2);
  EXPECT_EQ(j->GetAxis().x, 0);
  EXPECT_EQ(k->GetType(), ModelActuator::TYPE_LINEAR);
  EXPECT_DOUBLE_EQ(k->GetAxis().y, 0.6);
  EXPECT_DOUBLE_EQ(k->GetAxis().z, 0.8);
}

TEST(Actuator, UnknownTypeAndZeroAxisAreWarnings) {
  const LoadOutcome type = TryToLoad("actuator( type \"wobbly\" )");
  EXPECT_TRUE(type.loaded);
  EXPECT_NE(type.errors.find("t.world:1:16: warning: found type \"wobbly\""), std::string::npos)
      << type.errors;
  const auto world = EmptyWorld();
  const LoadOutcome axis = TryToLoad(world.get(), "actuator( name \"j\" axis [0 0 0] )");
  EXPECT_TRUE(axis.loaded);
  EXPECT_NE(axis.errors.find("axis without direction"), std::string::npos) << axis.errors;
  EXPECT_EQ(Find<ModelActuator>(*world, "j")->GetAxis().x, 1);
}

TEST(Actuator, BadPropertiesAreRefused) {
  for (const char* bad : {"max_speed -1", "min_position 2", "axis [1 0]", "max_position nan"}) {
    const LoadOutcome outcome = TryToLoad("actuator( " + std::string(bad) + " )");
    EXPECT_FALSE(outcome.loaded) << bad;
    EXPECT_EQ(outcome.errors.find("t.world:1:"), 0u) << outcome.errors;
  }
}

// In Stage 4.3 the start position replaces the pose.
TEST(Actuator, StartPositionIsAddedToThePose) {
  const auto world = LoadText(
      "actuator( name \"j\" pose [1 2 3 90] axis [3 4 0] start_position 2 max_position 5 )\n"
      "actuator( name \"k\" pose [1 2 3 90] type \"rotational\" start_position 0.5 )");
  const ModelActuator *j = Find<ModelActuator>(*world, "j"), *k = Find<ModelActuator>(*world, "k");
  ExpectPose(j->GetPose(), 1 - 1.6, 2 + 1.2, 3, M_PI / 2);
  EXPECT_DOUBLE_EQ(j->GetPosition(), 2);
  ExpectPose(k->GetPose(), 1, 2, 3, M_PI / 2 + 0.5);
  EXPECT_DOUBLE_EQ(k->GetPosition(), 0.5);
}

TEST(Actuator, IsSavedWithItsPosition) {
  const std::string path = testing::TempDir() + "actuator.world";
  std::ofstream(path) << "actuator( name \"j\" pose [1 2 0 0] axis [0 1 0] start_position 0.25 )\n";
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(path));
  auto* joint = FindRunning<ModelActuator>(*world, "j");
  joint->SetSpeed(0.5);
  Step(*world, 5);
  ExpectPose(joint->GetPose(), 1, 2.5, 0, 0);
  ASSERT_TRUE(world->Save(nullptr));
  ASSERT_TRUE(world->Load(path));
  joint = Find<ModelActuator>(*world, "j");
  ExpectPose(joint->GetPose(), 1, 2.5, 0, 0);
  EXPECT_NEAR(joint->GetPosition(), 0.5, 1e-9);
  std::remove(path.c_str());
}

TEST(Actuator, ReloadingRestoresTheStartPosition) {
  for (const std::string pose : {"pose [1 2 0 0]", ""}) {
    const auto world = LoadText("actuator( name \"j\" start_position 0.25 " + pose + " )");
    auto* joint = FindRunning<ModelActuator>(*world, "j");
    const Pose start = joint->GetPose();
    joint->SetSpeed(0.5);
    Step(*world, 5);
    EXPECT_NEAR(joint->GetPosition(), 0.5, 1e-9);
    world->Reload();
    EXPECT_NEAR(joint->GetPosition(), 0.25, 1e-9);
    EXPECT_EQ(joint->GetPose(), start);
  }
}

// ---- motion -------------------------------------------------------------------------------------

TEST(Actuator, MovesAlongItsAxisInItsOwnFrame) {
  Joint joint("pose [1 2 0 90] axis [3 4 0] max_position 5");
  joint.actuator->SetSpeed(0.5);
  EXPECT_EQ(joint.actuator->GetSpeed(), 0.5);
  EXPECT_NEAR(joint.PositionAfter(1), 0.05, 1e-12);
  ExpectPose(joint.actuator->GetPose(), 1 - 0.04, 2 + 0.03, 0, M_PI / 2);
  EXPECT_NEAR(joint.PositionAfter(9), 0.5, 1e-12);
}

TEST(Actuator, MovesUp) {
  Joint joint("axis [0 0 2]");
  joint.actuator->SetSpeed(1);
  EXPECT_NEAR(joint.PositionAfter(5), 0.5, 1e-12);
  ExpectPose(joint.actuator->GetPose(), 0, 0, 0.5, 0);
}

TEST(Actuator, SpeedIsLimited) {
  Joint joint("max_speed 0.25 max_position 100 min_position -100");
  joint.actuator->SetSpeed(7);
  EXPECT_NEAR(joint.PositionAfter(10), 0.25, 1e-12);
  joint.actuator->SetSpeed(-kInfinity);
  EXPECT_NEAR(joint.PositionAfter(20), -0.25, 1e-12);
  joint.actuator->GoTo(50);
  EXPECT_NEAR(joint.PositionAfter(20), 0.25, 1e-12);
}

TEST(Actuator, StopsAtItsLimits) {
  Joint joint("max_position 0.33 min_position -0.12 max_speed 10");
  joint.actuator->SetSpeed(1);
  EXPECT_NEAR(joint.PositionAfter(3), 0.3, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(1), 0.33, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(5), 0.33, 1e-12);
  EXPECT_FALSE(joint.actuator->Stalled());
  joint.actuator->SetSpeed(-1);
  EXPECT_NEAR(joint.PositionAfter(10), -0.12, 1e-12);
}

TEST(Actuator, StopsAtItsLimitsBetweenUpdatesToo) {
  Joint joint("update_interval 1000 max_position 0.33", "interval_sim 10");
  joint.actuator->SetSpeed(0.5);
  EXPECT_EQ(joint.PositionAfter(99), 0);  // the command takes effect at the next update
  EXPECT_NEAR(joint.PositionAfter(11), 0.055, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(80), 0.33, 1e-12);
}

TEST(Actuator, OutsideItsLimitsMovesOnlyBack) {
  Joint joint("start_position 3");
  joint.actuator->SetSpeed(0.5);
  EXPECT_NEAR(joint.PositionAfter(5), 3, 1e-12);
  joint.actuator->SetSpeed(-0.5);
  EXPECT_NEAR(joint.PositionAfter(2), 2.9, 1e-12);
  joint.actuator->GoTo(4);  // is clipped to 1
  EXPECT_NEAR(joint.PositionAfter(1), 2.8, 1e-12);
  EXPECT_EQ(joint.actuator->GetSpeed(), 1);
}

TEST(Actuator, GoesToAPosition) {
  Joint joint("max_speed 0.2");
  joint.actuator->GoTo(0.5);
  EXPECT_EQ(joint.actuator->GetSpeed(), 0.5);
  EXPECT_NEAR(joint.PositionAfter(1), 0.02, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(14), 0.3, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(1), 0.32, 1e-12);  // from here on a gain of 1/s
  EXPECT_NEAR(joint.PositionAfter(1), 0.338, 1e-12);
  EXPECT_NEAR(joint.PositionAfter(200), 0.5, 1e-6);
}

TEST(Actuator, DoesNotOvershootItsGoalWithRareUpdates) {
  Joint joint("update_interval 3000 max_speed 10 max_position 10");
  joint.actuator->GoTo(2);
  Step(*joint.world, 29);
  for (int i = 0; i < 60; i++) {
    Step(*joint.world);
    EXPECT_LE(joint.actuator->GetPosition(), 2 + 1e-12);
  }
  EXPECT_NEAR(joint.actuator->GetPosition(), 2, 1e-9);
}

TEST(Actuator, TurnsMoreThanHalfATurnIfItsLimitsAllow) {
  Joint joint("pose [0 0 0 45] type \"rotational\" max_position 10 min_position -10 max_speed 2");
  joint.actuator->SetSpeed(2);
  EXPECT_NEAR(joint.PositionAfter(40), 8, 1e-9);
  ExpectPose(joint.actuator->GetPose(), 0, 0, 0, normalize(M_PI / 4 + 8));
  EXPECT_NEAR(joint.PositionAfter(20), 10, 1e-9);
  joint.actuator->GoTo(-5);
  EXPECT_NEAR(joint.PositionAfter(300), -5, 1e-6);
  joint.actuator->SetPose(Pose(0, 0, 0, M_PI / 4 - 4));  // a client turns it
  EXPECT_NEAR(joint.actuator->GetPosition(), -4, 1e-6);
}

TEST(Actuator, TakesItsChildrenAlongAndMovesWithItsParent) {
  const auto world = LoadText(
      "position( name \"r\" pose [1 1 0 90] size [0.4 0.4 0.2]\n"
      "  actuator( name \"j\" pose [0.1 0 0 0] size [0.2 0.2 0.2]\n"
      "    model( name \"tip\" pose [0.1 0 0 0] size [0.1 0.1 0.1] ) ) )");
  auto* robot = FindRunning<ModelPosition>(*world, "r");
  auto* joint = FindRunning<ModelActuator>(*world, "r.j");
  robot->SetSpeed(0.5, 0, 0);
  joint->SetSpeed(0.25);
  Step(*world, 10);
  ExpectPose(Find(*world, "r.j.tip")->GetGlobalPose(), 1, 1 + 0.5 + 0.25 + 0.2, 0.4, M_PI / 2);
  EXPECT_NEAR(joint->GetPosition(), 0.25, 1e-12);
  EXPECT_FALSE(joint->Stalled());
}

TEST(Actuator, ObstaclesStopIt) {
  Joint joint("max_position 5", "model( name \"box\" pose [0.45 0 0 0] size [0.2 0.2 0.2] )");
  joint.actuator->SetSpeed(0.5);  // 0.05 m per step; the gap is 0.25 m
  EXPECT_NEAR(joint.PositionAfter(20), 0.2, 0.051);
  EXPECT_TRUE(joint.actuator->Stalled());
  const Pose stuck = joint.actuator->GetPose();
  Step(*joint.world, 5);
  EXPECT_EQ(joint.actuator->GetPose(), stuck);
  Find(*joint.world, "box")->SetPose(Pose(9, 0, 0, 0));
  const double before = joint.actuator->GetPosition();
  EXPECT_NEAR(joint.PositionAfter(1), before + 0.05, 1e-12);
  EXPECT_FALSE(joint.actuator->Stalled());
}

TEST(Actuator, ObstaclesStopItsChildren) {
  const auto world = LoadText(
      "actuator( name \"j\" size [0.2 0.2 0.2] type \"rotational\" max_position 3\n"
      "  model( pose [0.5 0 -0.2 0] size [0.1 0.1 0.1] ) )\n"
      "model( pose [0 0.5 0 0] size [0.1 0.1 0.1] )");
  auto* joint = FindRunning<ModelActuator>(*world, "j");
  joint->SetSpeed(0.5);
  Step(*world, 60);
  EXPECT_TRUE(joint->Stalled());
  EXPECT_NEAR(joint->GetPosition(), M_PI / 2 - 0.2, 0.1);
}

TEST(Actuator, TheGroundStopsIt) {
  Joint joint("pose [0 0 0.12 0] axis [0 0 -1]");
  joint.actuator->SetSpeed(0.5);
  EXPECT_NEAR(joint.PositionAfter(10), 0.1, 1e-9);
  EXPECT_TRUE(joint.actuator->Stalled());
}

TEST(Actuator, IsRasterizedAtItsPosition) {
  Joint joint("max_position 5",
              "ranger( name \"l\" pose [0 3 0.1 -90] alwayson 1 sensor( "
              "size [0 0 0] range [0 5] ) )");
  const ModelRanger* ranger = Find<ModelRanger>(*joint.world, "l");
  Step(*joint.world);
  EXPECT_NEAR(ranger->GetSensors()[0].ranges[0], 2.9, kCell);
  joint.actuator->SetSpeed(0.5);
  Step(*joint.world, 10);
  EXPECT_EQ(ranger->GetSensors()[0].ranges[0], 5);
}

// ---- life ---------------------------------------------------------------------------------------

TEST(Actuator, MovesOnlyWhileSubscribedAndEnabled) {
  Joint joint("");
  joint.actuator->SetSpeed(0.5);
  Step(*joint.world, 2);
  joint.actuator->Disable();
  EXPECT_NEAR(joint.PositionAfter(5), 0.1, 1e-12);
  joint.actuator->Enable();
  EXPECT_NEAR(joint.PositionAfter(2), 0.2, 1e-12);
  joint.actuator->Unsubscribe();
  EXPECT_EQ(joint.actuator->GetSpeed(), 0);
  EXPECT_NEAR(joint.PositionAfter(5), 0.2, 1e-12);
  joint.actuator->Subscribe();
  EXPECT_NEAR(joint.PositionAfter(5), 0.2, 1e-12);
}

TEST(Actuator, DrawsPowerWhileSubscribed) {
  Joint joint("joules 5");
  Step(*joint.world, 3);
  EXPECT_NEAR(joint.actuator->FindPowerPack()->GetDissipated(), 0.6, 1e-9);
}

TEST(Actuator, IgnoresNaN) {
  Joint joint("");
  joint.actuator->SetSpeed(0.5);
  const std::string errors = ErrorsOf([&] {
    joint.actuator->SetSpeed(kNaN);
    joint.actuator->GoTo(kNaN);
  });
  EXPECT_EQ(std::count(errors.begin(), errors.end(), '\n'), 2) << errors;
  EXPECT_NEAR(joint.PositionAfter(1), 0.05, 1e-12);
}

TEST(Actuator, MayBeMadeByAProgram) {
  const auto world = EmptyWorld();
  auto* joint = dynamic_cast<ModelActuator*>(world->CreateModel(nullptr, "actuator"));
  ASSERT_NE(joint, nullptr);
  joint->SetPose(Pose(3, 0, 0, M_PI / 2));
  EXPECT_EQ(joint->GetPosition(), 0);
  joint->Subscribe();
  joint->SetSpeed(0.5);
  Step(*world, 2);
  ExpectPose(joint->GetPose(), 3, 0.1, 0, M_PI / 2);
  EXPECT_NEAR(joint->GetPosition(), 0.1, 1e-12);
  delete joint;
  Step(*world, 2);
}

}  // namespace
}  // namespace Stg
