// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worlds: defaults, loading, several worlds, world callbacks and saving.

#include <filesystem>
#include <fstream>

#include "models/host.hh"
#include "sensing/scene.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// Appends a word to a journal at each step of a world.
struct Entry {
  Journal* journal;
  std::string text;
};
int Note(World*, void* entry) {
  static_cast<Entry*>(entry)->journal->entries.push_back(static_cast<Entry*>(entry)->text);
  return 0;
}
int NoteOnce(World* world, void* entry) { return Note(world, entry), 1; }

// ---- defaults -----------------------------------------------------------------------------------

TEST(World, DefaultsAreThoseOfStage) {
  const auto world = EmptyWorld();
  EXPECT_EQ(world->Resolution(), 50);
  EXPECT_EQ(int{World::DEFAULT_PPM}, 50);
  EXPECT_EQ(world->sim_interval, 100000u);
  EXPECT_EQ(world->SimTimeNow(), 0u);
  EXPECT_FALSE(world->IsGUI() || world->Paused() || world->TestQuit());
  EXPECT_EQ(world->GetGround()->TokenStr(), "_ground_model");
  EXPECT_EQ(world->GetGround(), world->ground);
  EXPECT_EQ(world->GetGround()->GetModelType(), "model");
  EXPECT_EQ(world->GetAllModels().size(), 1u);
  EXPECT_EQ(world->GetWorldFile(), nullptr);
  EXPECT_EQ(world->GetModel("model:0"), world->GetGround());
  ExpectPose(world->GetGlobalPose(), 0, 0, 0, 0);
}

TEST(World, ResolutionIsThatOfTheConstructorUnlessTheFileSaysOtherwise) {
  InitLibrary();
  World world("w", 10);
  EXPECT_EQ(world.Resolution(), 10);
  std::istringstream silent("model( )"), telling("resolution 0.05");
  EXPECT_TRUE(world.Load(silent));
  EXPECT_EQ(world.Resolution(), 10);
  EXPECT_TRUE(world.Load(telling));
  EXPECT_EQ(world.Resolution(), 20);
  EXPECT_EQ(world.MetersToPixels(0.051), 1);
  EXPECT_EQ(world.MetersToPixels(-0.001), -1);
  EXPECT_EQ(world.MetersToPixels(point_t(1.01, -1.01)).y, -21);
}

TEST(World, ExtentGrowsInSuperregions) {
  const auto world = LoadText("model( pose [1 1 0 0] )");
  const bounds3d_t extent = world->GetExtent();
  EXPECT_GE(extent.x.max, 1.2);
  EXPECT_LE(extent.x.min, 0.8);
  EXPECT_EQ(extent.z.max, 0);
  Model* model = Find(*world, "model:1");
  model->SetPose(Pose(-100, 0, 0, 0));
  EXPECT_LE(world->GetExtent().x.min, -100.2);
  EXPECT_GE(world->GetExtent().x.max, 1.2);
}

TEST(World, UpdateStepsEvenWhilePaused) {
  const auto world = EmptyWorld();
  world->Stop();
  EXPECT_TRUE(world->Paused());
  EXPECT_FALSE(world->Update());
  EXPECT_EQ(world->SimTimeNow(), 100000u);
  world->TogglePause();
  EXPECT_FALSE(world->paused);
  world->TogglePause();
  world->Start();
  EXPECT_FALSE(world->Paused());
}

// ---- loading ------------------------------------------------------------------------------------

TEST(Loading, NamesTheWorldAfterItsFileUnlessItHasAName) {
  const auto world = LoadText("model( )");
  EXPECT_EQ(world->TokenStr(), "t.world");
  EXPECT_NE(world->GetWorldFile(), nullptr);
  std::istringstream content("name \"lab\"");
  EXPECT_TRUE(world->Load(content, "t.world"));
  EXPECT_EQ(world->TokenStr(), "lab");
}

TEST(Loading, TwiceGivesTheSecondWorld) {
  const auto world = LoadText("interval_sim 50 quit_time 3 model( name \"a\" ) position( )");
  Journal journal;
  Entry entry{&journal, "stale"};
  world->AddUpdateCallback(Note, &entry);
  Step(*world, 3);
  journal.entries.clear();
  std::istringstream content("model( name \"b\" ) position( )");
  EXPECT_TRUE(world->Load(content, "u.world"));
  EXPECT_EQ(world->SimTimeNow(), 0u);
  EXPECT_EQ(world->GetUpdateCount(), 0u);
  EXPECT_EQ(world->GetQuitTime(), 0u);
  EXPECT_EQ(world->GetAllModels().size(), 3u);
  EXPECT_EQ(world->GetModel("a"), nullptr);
  EXPECT_EQ(Find(*world, "b"), world->GetModel("model:1"));
  EXPECT_NE(world->GetModel("position:0"), nullptr);
  Step(*world);
  EXPECT_EQ(journal.Text(), "");
}

// Properties of the first file must not become defaults for the second one.
TEST(Loading, TwiceForgetsTheFirstFilesProperties) {
  const auto world = LoadText("interval_sim 50 resolution 0.1 show_clock 1 show_clock_interval 7");
  std::istringstream content("model( )");
  EXPECT_TRUE(world->Load(content, "u.world"));
  EXPECT_EQ(world->sim_interval, 100000u);
  EXPECT_EQ(world->Resolution(), 50);
  EXPECT_FALSE(world->ShowsClock());
}

TEST(Loading, AMissingFileIsReported) {
  const auto world = EmptyWorld();
  const std::string errors =
      ErrorsOf([&] { EXPECT_FALSE(world->Load("/no/such/folder/t.world")); });
  EXPECT_NE(errors.find("/no/such/folder/t.world"), std::string::npos);
  EXPECT_EQ(world->LoadStatus(), 1);
  Step(*world);
}

/// Loads a crowd many times; threads may keep some memory each, but the grid must not grow on and
/// on.
void LoadManyTimes(int threads, double growth) {
  std::string text = "resolution 0.02 threads " + std::to_string(threads) + "\n";
  for (int i = 0; i < 20; i++)
    text += "position( pose [" + std::to_string(7 * i % 30) + " " + std::to_string(11 * i % 30) +
            " 0 30] alwayson 1 velocity [0.5 0 0 0] update_interval 300 ranger( alwayson 1"
            " sensor( samples 30 fov 180 ) ) model( boundary 1 ) )\n";
  const auto world = EmptyWorld();
  const auto cycle = [&] {
    EXPECT_TRUE(TryToLoad(world.get(), text).loaded);
    Step(*world, 3);
    world->UnLoad();
  };
  for (int i = 0; i < 5; i++) cycle();
  const grid::Grid::Statistics before = world->host().scene.grid.statistics();
  for (int i = 0; i < 50; i++) cycle();
  const grid::Grid::Statistics after = world->host().scene.grid.statistics();
  EXPECT_EQ(after.tiles, 0u);
  EXPECT_EQ(after.superregions, before.superregions);
  EXPECT_LE(static_cast<double>(after.bytes), growth * static_cast<double>(before.bytes));
}

TEST(Loading, ManyTimesLeavesTheGridAsItWas) {
  LoadManyTimes(1, 1.0);
  LoadManyTimes(2, 1.2);
}

// ---- several worlds -----------------------------------------------------------------------------

TEST(SeveralWorlds, StepInTheOrderOfCreation) {
  Journal journal;
  Entry a{&journal, "a"}, b{&journal, "b"};
  const auto first = LoadText(""), second = LoadText("quit_time 0.2");
  second->AddUpdateCallback(Note, &b);
  first->AddUpdateCallback(Note, &a);
  for (int i = 0; i < 3; i++) EXPECT_FALSE(World::UpdateAll());
  EXPECT_EQ(journal.Text(), "a b a b a");
  first->Quit();
  EXPECT_TRUE(World::UpdateAll());
}

TEST(SeveralWorlds, DoNotSeeEachOther) {
  const auto first = LoadText("model( name \"a\" size [1 1 1] )"),
             second = LoadText("model( name \"a\" pose [5 0 0 0] )");
  EXPECT_NE(first->GetModel("a"), second->GetModel("a"));
  EXPECT_FALSE(second->GetModel("a")->HasCollision());
  second->GetModel("a")->SetPose(Pose(0.5, 0, 0, 0));
  EXPECT_FALSE(second->GetModel("a")->HasCollision());
}

TEST(SeveralWorlds, RunEndsWhenAllAreDone) {
  const auto first = LoadText("quit_time 0.3"), second = LoadText("quit_time 0.5");
  World::Run();
  EXPECT_EQ(first->GetUpdateCount(), 3u);
  EXPECT_EQ(second->GetUpdateCount(), 5u);
}

TEST(SeveralWorlds, NoneAreDone) { EXPECT_TRUE(World::UpdateAll()); }

TEST(SeveralWorlds, AreDeletedInAnyOrder) {
  auto first = LoadText("model( alwayson 1 model( ) )"),
       second = LoadText("position( alwayson 1 )");
  EXPECT_FALSE(World::UpdateAll());
  first.reset();
  EXPECT_FALSE(World::UpdateAll());
  EXPECT_EQ(second->GetUpdateCount(), 2u);
}

// ---- world callbacks ----------------------------------------------------------------------------

class WorldCallbacks : public testing::Test {
 protected:
  std::unique_ptr<World> world = EmptyWorld();
  Journal journal;
  Entry x{&journal, "x"}, y{&journal, "y"}, z{&journal, "z"};
};

TEST_F(WorldCallbacks, AreCalledInOrderDuplicatesAllowed) {
  for (Entry* entry : {&y, &x, &y}) world->AddUpdateCallback(Note, entry);
  Step(*world, 2);
  EXPECT_EQ(journal.Text(), "y x y y x y");
}

// In Stage 4.3, the next callback is skipped, or all are called again.
TEST_F(WorldCallbacks, ThatRemoveThemselvesDoNotDisturbOthers) {
  world->AddUpdateCallback(NoteOnce, &x);
  world->AddUpdateCallback(Note, &y);
  world->AddUpdateCallback(NoteOnce, &z);
  Step(*world, 2);
  EXPECT_EQ(journal.Text(), "x y z y");
}

TEST_F(WorldCallbacks, RemoveTakesTheFirstEqualPair) {
  for (Entry* entry : {&x, &y, &x}) world->AddUpdateCallback(Note, entry);
  EXPECT_EQ(world->RemoveUpdateCallback(Note, &x), 2);
  EXPECT_EQ(world->RemoveUpdateCallback(Note, &z), 2);
  EXPECT_EQ(world->RemoveUpdateCallback(NoteOnce, &x), 2);
  Step(*world);
  EXPECT_EQ(journal.Text(), "y x");
}

TEST_F(WorldCallbacks, CanBeRemovedAndAddedByOthers) {
  struct Plan {
    Entry *remove, *add;
  } plan{&y, &z};
  world->AddUpdateCallback(
      [](World* w, void* p) {
        w->RemoveUpdateCallback(Note, static_cast<Plan*>(p)->remove);
        for (int i = 0; i < 100; i++) w->AddUpdateCallback(NoteOnce, static_cast<Plan*>(p)->add);
        return 1;
      },
      &plan);
  world->AddUpdateCallback(Note, &x);
  world->AddUpdateCallback(Note, &y);
  Step(*world);
  EXPECT_EQ(journal.Text(), "x");
  journal.entries.clear();
  Step(*world);
  EXPECT_EQ(journal.entries.size(), 101u);
  journal.entries.clear();
  Step(*world);
  EXPECT_EQ(journal.Text(), "x");
}

TEST_F(WorldCallbacks, CanUnloadTheWorld) {
  std::istringstream content("model( name \"a\" alwayson 1 )");
  ASSERT_TRUE(world->Load(content));
  world->AddUpdateCallback([](World* w, void*) { return w->UnLoad(), 0; }, nullptr);
  world->AddUpdateCallback(Note, &x);
  Step(*world, 3);
  EXPECT_EQ(journal.Text(), "");  // unloading has removed the callback
  EXPECT_EQ(world->GetAllModels().size(), 1u);
}

TEST_F(WorldCallbacks, CanLoadAnotherWorld) {
  const auto load = [](World* w, void*) {
    std::istringstream content("model( name \"b\" alwayson 1 )");
    EXPECT_TRUE(w->Load(content));
    return 0;
  };
  for (int i = 0; i < 3; i++) {
    load(world.get(), nullptr);
    world->AddUpdateCallback(load, nullptr);
    Step(*world, 2);
    EXPECT_NE(world->GetModel("b"), nullptr);
  }
}

// ---- saving -------------------------------------------------------------------------------------

TEST(Saving, CallsCallbacksAndWritesToTheFileThatWasLoaded) {
  const std::string path = testing::TempDir() + "stage_world_test.world";
  std::ofstream(path) << "position( name \"r\" pose [1 2 0 30] )\n";
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(path));
  Model* robot = Find(*world, "r");
  robot->SetPose(Pose(3, 4, 0, 0));
  int saves = 0;
  robot->AddCallback(
      Model::CB_SAVE, [](Model*, void* count) { return ++*static_cast<int*>(count), 0; }, &saves);
  EXPECT_TRUE(world->Save(nullptr));
  EXPECT_EQ(saves, 1);
  ASSERT_TRUE(world->Load(path));
  ExpectPose(Find(*world, "r")->GetPose(), 3, 4, 0, 0);
  std::filesystem::remove(path);
  EXPECT_FALSE(EmptyWorld()->Save("nowhere.world"));  // no world file was loaded
}

}  // namespace
}  // namespace Stg
