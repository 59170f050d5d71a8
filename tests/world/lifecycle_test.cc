// SPDX-License-Identifier: GPL-2.0-or-later
//
// The life cycle of worlds: repeated loading, several worlds at once, reloading and deleting.

#include <cstdlib>

#include "models/body.hh"
#include "support/model_testing.hh"
#include "support/resident_memory.hh"

namespace Stg {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// A world with models of many types.
const char* const kSmallWorld = R"(
define robot position
(
  size [0.4 0.4 0.3] mass 2 joules 100 take_watts 10
  ranger( alwayson 1 sensor( range [0 3] fov 180 samples 30 noise [0.01 0.01 1] ) )
  block( points 3 point[0] [0 0] point[1] [1 0] point[2] [0 1] z [0 1] )
)
model( size [6 6 1] noblocks 1 boundary 1 say "a room" )
model( name "charger" size [1 1 1] pose [2 2 0 0] joules -1 give_watts 50 alwayson 1 )
robot( name "r0" pose [1.5 2 0 0] alwayson 1 )
robot( name "r1" pose [-1 0 0 45] alwayson 1 )
)";

bool LoadSmallWorld(World* world) {
  std::istringstream text(kSmallWorld);
  return world->Load(text, "small.world");
}

int Drive(Model* mod, void*) {
  static_cast<ModelPosition*>(mod)->SetSpeed(0.3, 0, 0.2);
  return 0;
}

/// The state hash of a small world after some steps.
uint64_t HashAfter(World* world, int steps) {
  for (const char* robot : {"r0", "r1"})
    Find(*world, robot)->AddCallback(Model::CB_UPDATE, Drive, nullptr);
  Step(*world, steps);
  return world->StateHash();
}

TEST(Lifecycle, TenThousandCyclesNeedNoMoreMemoryThanAFew) {
  constexpr int kWarmUp = kSanitized ? 20 : 500, kCycles = kSanitized ? 300 : 10000;
  const auto world = EmptyWorld();
  long start = 0;
  OutputOf([&] {
    for (int i = 0; i < kWarmUp + kCycles; i++) {
      if (i == kWarmUp) start = ResidentMemory();
      ASSERT_TRUE(LoadSmallWorld(world.get()));
      ASSERT_FALSE(world->Update());
      world->UnLoad();
    }
  });
  const long growth = ResidentMemory() - start;
  RecordProperty("growth_in_bytes", static_cast<int>(growth));
  EXPECT_GT(start, 0);
  if (!kSanitized) {  // sanitizers delay the release of freed memory
    EXPECT_LT(growth, 1 << 20);
  }
}

TEST(Lifecycle, MakingAndDestroyingWorldsNeedsNoMoreMemoryEither) {
  constexpr int kWarmUp = kSanitized ? 10 : 100, kCycles = kSanitized ? 100 : 2000;
  InitLibrary();
  long start = 0;
  OutputOf([&] {
    for (int i = 0; i < kWarmUp + kCycles; i++) {
      if (i == kWarmUp) start = ResidentMemory();
      World world;
      ASSERT_TRUE(LoadSmallWorld(&world));
      ASSERT_FALSE(world.Update());
    }
  });
  if (!kSanitized) {
    EXPECT_LT(ResidentMemory() - start, 1 << 20);
  }
}

TEST(Lifecycle, AWorldLoadedAgainBeginsAnew) {
  const auto fresh = EmptyWorld(), used = EmptyWorld();
  ASSERT_TRUE(LoadSmallWorld(fresh.get()));
  ASSERT_TRUE(LoadSmallWorld(used.get()));
  HashAfter(used.get(), 40);
  used->AddUpdateCallback([](World*, void*) -> int { abort(); }, nullptr);
  ASSERT_TRUE(LoadSmallWorld(used.get()));  // unloads the previous world
  EXPECT_EQ(used->SimTimeNow(), 0u);
  EXPECT_EQ(used->UpdateCount(), 0u);
  EXPECT_EQ(used->GetAllModels().size(), fresh->GetAllModels().size());
  EXPECT_EQ(used->GetModel("r0")->TokenStr(), "r0");
  const uint64_t expected = HashAfter(fresh.get(), 50);
  EXPECT_EQ(HashAfter(used.get(), 50), expected);
  used->UnLoad();
  ASSERT_TRUE(LoadSmallWorld(used.get()));
  EXPECT_EQ(HashAfter(used.get(), 50), expected);
}

TEST(Lifecycle, AnUnloadedWorldIsEmptyAndHarmless) {
  const auto world = EmptyWorld();
  ASSERT_TRUE(LoadSmallWorld(world.get()));
  HashAfter(world.get(), 5);
  world->UnLoad();
  EXPECT_EQ(world->TokenStr(), "[unloaded]");
  EXPECT_EQ(world->GetAllModels().size(), 1u);
  EXPECT_EQ(world->GetWorldFile(), nullptr);
  EXPECT_EQ(world->SimTimeNow(), 0u);
  EXPECT_EQ(world->GetGround()->TokenStr(), "_ground_model");
  OutputOf([&] { EXPECT_EQ(world->GetModel("r0"), nullptr); });
  Step(*world, 3);
  world->UnLoad();
  Step(*world, 3);
  EXPECT_FALSE(world->Save(nullptr));
  EXPECT_TRUE(LoadSmallWorld(world.get()));
}

TEST(Lifecycle, AWorldThatWasNeverLoadedSteps) {
  const auto world = EmptyWorld();
  Step(*world, 3);
  EXPECT_EQ(world->SimTimeNow(), 300000u);
  EXPECT_TRUE(LoadSmallWorld(world.get()));
  Step(*world, 3);
}

// It needs a separate process, in which nothing has called Init() before.
TEST(LifecycleDeathTest, AWorldThatIsMadeBeforeInitCallsIt) {
  testing::GTEST_FLAG(death_test_style) = "threadsafe";
  const auto run = [] {
    if (InitDone()) std::exit(2);
    World world, second;
    std::istringstream text(
        "model( pose [3 0 0 0] ) position( ranger( ) )");  // nothing to warn about
    const bool works = world.Load(text, "small.world") && !world.Update() && !second.Update();
    Init(nullptr, nullptr);
    std::exit(works && InitDone() && world.GetAllModels().size() == 4 ? 0 : 1);
  };
  EXPECT_EXIT(
      run(), testing::ExitedWithCode(0),
      "^stage: warning: a World was created before Init\\(\\); Init\\(\\) is called now\n$");
}

TEST(Lifecycle, WorldCanLoadAfterAFailedLoad) {
  const auto world = EmptyWorld();
  ASSERT_TRUE(LoadSmallWorld(world.get()));
  for (const char* text : {"robot( )", "model( joules \"nan\" )", "model( watts 5 joules 3 "}) {
    const LoadOutcome outcome = TryToLoad(world.get(), text);
    EXPECT_FALSE(outcome.loaded) << text;
    EXPECT_EQ(outcome.status, 1) << text;
    EXPECT_EQ(outcome.models, 1u) << text;
    EXPECT_EQ(world->GetWorldFile(), nullptr);
    EXPECT_EQ(world->SimTimeNow(), 0u);
  }
  ASSERT_TRUE(LoadSmallWorld(world.get()));
  const auto fresh = EmptyWorld();
  ASSERT_TRUE(LoadSmallWorld(fresh.get()));
  EXPECT_EQ(HashAfter(world.get(), 20), HashAfter(fresh.get(), 20));
  EXPECT_FALSE(TryToLoad(world.get(), "robot( )").loaded);
  EXPECT_NE(world->CreateModel(nullptr, "position"), nullptr);
  Step(*world, 2);
}

TEST(Lifecycle, SeveralWorldsDoNotDisturbEachOther) {
  const auto alone = EmptyWorld();
  ASSERT_TRUE(LoadSmallWorld(alone.get()));
  const uint64_t expected = HashAfter(alone.get(), 30);

  std::vector<std::unique_ptr<World>> worlds;
  for (int i = 0; i < 3; i++) {
    worlds.push_back(EmptyWorld());
    ASSERT_TRUE(LoadSmallWorld(worlds.back().get()));
    HashAfter(worlds.back().get(), 0);
  }
  for (int i = 0; i < 15; i++) EXPECT_FALSE(World::UpdateAll());
  worlds.erase(worlds.begin() + 1);
  for (int i = 0; i < 15; i++) EXPECT_FALSE(World::UpdateAll());
  for (const auto& world : worlds) EXPECT_EQ(world->StateHash(), expected);
  EXPECT_EQ(alone->UpdateCount(), 60u);

  for (const auto& world : worlds) world->Quit();
  EXPECT_FALSE(World::UpdateAll()) << "one world continues";
  alone->Quit();
  EXPECT_TRUE(World::UpdateAll());
}

TEST(Lifecycle, ModelsWithChildrenAreDeletedWhole) {
  const auto world = LoadText(
      "model( name \"m\" model( ) position( alwayson 1 ) ranger( alwayson 1 sensor( ) model( ) ) "
      "model( joules 4 alwayson 1 ) )\n"
      "model( name \"n\" )");
  Step(*world, 2);
  delete Find(*world, "m");
  EXPECT_EQ(world->GetAllModels().size(), 2u);
  Step(*world, 2);
  EXPECT_EQ(world->GetChildren().size(), 2u);
}

TEST(Lifecycle, ReloadReadsThePropertiesAgain) {
  const auto world = LoadText(
      "define box model( size [1 1 1] block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 1] "
      "point[3] [0 1] z [0 1] ) )\n"
      "box( name \"m\" pose [1 2 0 0] color \"blue\" boundary 1 joules 5 watts 10 alwayson 1 )\n"
      "position( name \"r\" pose [-1 0 0 0] ranger( sensor( ) ) )");
  Model* m = Find(*world, "m");
  Step(*world, 2);
  const size_t models = world->GetAllModels().size(), blocks = m->body().blocks().size();
  m->SetPose(Pose(5, 5, 0, 0));
  m->SetColor(Color::red);
  world->Reload();
  ExpectPose(m->GetPose(), 1, 2, 0, 0);
  EXPECT_EQ(m->GetColor(), Color::blue);
  EXPECT_EQ(m->FindPowerPack()->GetStored(), 5);
  EXPECT_EQ(m->GetSubscriptionCount(), 1u);
  EXPECT_EQ(m->body().blocks().size(), blocks);
  EXPECT_EQ(Find<ModelRanger>(*world, "r.ranger:0")->GetSensors().size(), 1u);
  EXPECT_EQ(world->GetAllModels().size(), models);
  EXPECT_EQ(world->SimTimeNow(), 200000u);
  Step(*world);
  EXPECT_EQ(m->FindPowerPack()->GetStored(), 4);
  EmptyWorld()->Reload();
}

}  // namespace
}  // namespace Stg
