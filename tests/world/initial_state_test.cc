// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::RestartFrom() either has the same result as Reset(), or refuses.

#include "world/initial_state.hh"

#include <gtest/gtest.h>

#include <memory>
#include <sstream>
#include <string>

#include "support/model_testing.hh"
#include "support/shipped_worlds.hh"
#include "world/engine.hh"

namespace Stg {
namespace {

RunOptions OptionsOf(uint64_t seed) {
  RunOptions options;
  options.seed = seed;
  options.controllers = false;
  options.listed = false;
  return options;
}

int Ignore(Model*, void*) { return 0; }
int IgnoreWorld(World*, void*) { return 0; }

class Beginning : public testing::Test {
 protected:
  static void SetUpTestSuite() { InitLibrary(); }

  static std::unique_ptr<World> Load(const std::string& text, uint64_t seed = 1) {
    auto world = std::make_unique<World>(OptionsOf(seed));
    std::istringstream file(text);
    EXPECT_TRUE(world->Load(file));
    return world;
  }
};

const char* const kRobot =
    "position( name \"r\" localization \"odom\" ranger( sensor( samples 3 ) ) )";

TEST_F(Beginning, IsThatOfAFreshWorldForEverySeed) {
  for (const std::string& file : ShippedWorlds()) {
    World world(OptionsOf(1));
    ASSERT_TRUE(world.Load(file));
    const auto initial_state = world.CaptureInitialState();
    if (!initial_state) continue;
    for (const uint64_t seed : {1, 2, 77}) {
      for (Model* model : world.GetAllModels()) model->Subscribe();
      for (int i = 0; i < 5; i++) world.Update();
      ASSERT_TRUE(world.RestartFrom(*initial_state, seed)) << file;
      World fresh(OptionsOf(seed));
      ASSERT_TRUE(fresh.Load(file));
      EXPECT_EQ(world.StateHash(), fresh.StateHash()) << file << ", seed " << seed;
      EXPECT_EQ(world.seed(), seed);
      EXPECT_EQ(world.statistics().steps, 0u);
    }
  }
}

TEST_F(Beginning, LeavesModelsWhereTheyAreInMemory) {
  const auto world = Load(kRobot);
  const Model* const robot = world->GetModel("r");
  const auto initial_state = world->CaptureInitialState();
  ASSERT_TRUE(initial_state);
  delete world->CreateModel(nullptr, "model");
  world->CreateModel(world->GetModel("r"), "model");
  ASSERT_TRUE(world->RestartFrom(*initial_state, 3));
  EXPECT_EQ(world->GetModel("r"), robot);
  EXPECT_EQ(world->StateHash(), Load(kRobot, 3)->StateHash());
}

TEST_F(Beginning, WorksForCopies) {
  const auto world = Load(kRobot);
  const auto initial_state = world->CaptureInitialState();
  ASSERT_TRUE(initial_state);
  World copy(OptionsOf(9));
  ASSERT_TRUE(copy.LoadCopy(*world));
  copy.Update();
  ASSERT_TRUE(copy.RestartFrom(*initial_state, 4));
  EXPECT_EQ(copy.StateHash(), Load(kRobot, 4)->StateHash());
}

TEST_F(Beginning, IsRefusedIfLoadingMayDependOnTheSeed) {
  EXPECT_FALSE(Load("model( ) population( name \"p\" model \"position\" count 2 area [-4 -4 4 4] )")
                   ->CaptureInitialState());
  World empty(OptionsOf(1));
  EXPECT_FALSE(empty.CaptureInitialState());
}

/// A reset removes callbacks, and clients that have added some may rely on it.
TEST_F(Beginning, IsRefusedWithClientCallbacks) {
  const auto world = Load(kRobot);
  const auto initial_state = world->CaptureInitialState();
  ASSERT_TRUE(initial_state);
  world->GetModel("r")->AddCallback(Model::CB_UPDATE, Ignore, nullptr);
  EXPECT_FALSE(world->RestartFrom(*initial_state, 2));
  world->GetModel("r")->RemoveCallback(Model::CB_UPDATE, Ignore);
  EXPECT_TRUE(world->RestartFrom(*initial_state, 2));
  world->AddUpdateCallback(IgnoreWorld, nullptr);
  EXPECT_FALSE(world->RestartFrom(*initial_state, 2));
  world->RemoveUpdateCallback(IgnoreWorld, nullptr);
  EXPECT_TRUE(world->RestartFrom(*initial_state, 2));
  world->CallAfterStep([](World&) {});
  EXPECT_FALSE(world->RestartFrom(*initial_state, 2));
}

}  // namespace
}  // namespace Stg
