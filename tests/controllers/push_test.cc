// SPDX-License-Identifier: GPL-2.0-or-later
//
// The worlds that show contacts, and their controllers.

#include <cmath>
#include <memory>
#include <string>

#include "support/model_testing.hh"
#include "support/shipped_worlds.hh"

namespace Stg {
namespace {

std::unique_ptr<World> LoadShipped(const std::string& name, ContactModel contacts) {
  InitLibrary();
  RunOptions options;
  options.contacts = contacts;
  auto world = std::make_unique<World>(options);
  EXPECT_TRUE(world->Load(SourceFile("worlds/" + name)));
  return world;
}

double DistanceFromHome(const World& world) {
  const Pose box = Find<>(world, "box")->GetPose(), home = Find<>(world, "home")->GetPose();
  return std::hypot(box.x - home.x, box.y - home.y);
}

TEST(PushWorld, SixRobotsBringTheBoxHome) {
  const auto world = LoadShipped("push.world", ContactModel::kDefault);
  ASSERT_GT(DistanceFromHome(*world), 3);
  Step(*world, 600);
  EXPECT_LT(DistanceFromHome(*world), 0.25);
}

TEST(PushWorld, OneRobotIsTooWeak) {
  const auto world = LoadShipped("push.world", ContactModel::kDefault);
  for (int i = 1; i < 6; i++) delete Find<>(*world, "p" + std::to_string(i));
  const double before = DistanceFromHome(*world);
  Step(*world, 600);
  EXPECT_NEAR(DistanceFromHome(*world), before, 0.02);
}

int CountOutside(const World& world) {
  int outside = 0;
  for (Model* model : world.GetAllModels())
    outside += model->GetModelType() == "position" && model->GetPose().x > 4;
  return outside;
}

TEST(DoorWorld, AllRobotsLeaveWithOutlinesAndFewWithCells) {
  const auto outlines = LoadShipped("door.world", ContactModel::kDefault);
  Step(*outlines, 2300);
  EXPECT_EQ(CountOutside(*outlines), 100);
  const auto cells = LoadShipped("door.world", ContactModel::kCells);
  Step(*cells, 2300);
  EXPECT_LT(CountOutside(*cells), 50);
}

TEST(PushController, RefusesWrongArguments) {
  for (const char* arguments :
       {"push", "push box", "push box 1 x", "push nobody 1 2", "leave 1 2 3", "leave 1 2 3 y"}) {
    const LoadOutcome outcome =
        TryToLoad("model( name \"box\" )\nposition( ctrl \"" + std::string(arguments) + "\" )\n");
    EXPECT_FALSE(outcome.loaded) << arguments;
    EXPECT_NE(outcome.errors.find("expected"), std::string::npos) << outcome.errors;
  }
}

}  // namespace
}  // namespace Stg
