// SPDX-License-Identifier: GPL-2.0-or-later
//
// Worlds: their life, several of them, world callbacks, what may be made and deleted when.

#include <sys/resource.h>

#include <filesystem>
#include <fstream>

#include "model_testing.hh"
#include "sensing/scene.hh"

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

TEST(World, PausingConcernsOthers) {
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

TEST(Loading, UpdateBeforeLoadIsHarmless) {
  const auto world = EmptyWorld();
  Step(*world, 3);
  std::istringstream content("model( name \"a\" alwayson 1 )");
  EXPECT_TRUE(world->Load(content));
  Step(*world, 3);
}

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

// What the first file says must not be a default for the second.
TEST(Loading, TwiceForgetsTheFirstFilesProperties) {
  const auto world = LoadText("interval_sim 50 resolution 0.1 show_clock 1 show_clock_interval 7");
  std::istringstream content("model( )");
  EXPECT_TRUE(world->Load(content, "u.world"));
  EXPECT_EQ(world->sim_interval, 100000u);
  EXPECT_EQ(world->Resolution(), 50);
  EXPECT_FALSE(world->ShowsClock());
}

TEST(Loading, TwiceGivesTheSameRun) {
  const std::string text =
      "position( name \"r\" alwayson 1 drive \"omni\" localization \"odom\" ranger( alwayson 1"
      " sensor( samples 90 fov 270 noise [0.01 0.02 10] ) ) )\n"
      "model( pose [2 0.3 0 20] ) model( pose [-1 2 0 70] size [2 0.3 1] )";
  const auto world = LoadText(text);
  std::vector<uint64_t> hashes;
  for (int round = 0; round < 3; round++) {
    if (round == 2) world->UnLoad();
    if (round > 0) {
      std::istringstream content(text);
      EXPECT_TRUE(world->Load(content, "t.world"));
    }
    Find<ModelPosition>(*world, "r")->SetSpeed(0.3, 0.1, 0.2);
    Step(*world, 20);
    hashes.push_back(world->StateHash());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
  EXPECT_EQ(hashes[0], hashes[2]);
}

TEST(Loading, ABadFileLeavesAnEmptyWorldThatCanBeUsed) {
  const auto world = LoadText("model( name \"a\" alwayson 1 )");
  Step(*world, 2);
  const LoadOutcome bad = TryToLoad(world.get(), "model( name \"b\" ) unicorn( )");
  EXPECT_FALSE(bad.loaded);
  EXPECT_EQ(bad.status, 1);
  EXPECT_EQ(bad.models, 1u);
  EXPECT_EQ(world->GetWorldFile(), nullptr);
  EXPECT_EQ(world->SimTimeNow(), 0u);
  Step(*world, 2);
  EXPECT_NE(world->CreateModel(nullptr, "position"), nullptr);
  Step(*world, 2);
  const LoadOutcome good = TryToLoad(world.get(), "model( name \"c\" )");
  EXPECT_TRUE(good.loaded);
  EXPECT_EQ(good.status, 0);
  EXPECT_NE(world->GetModel("c"), nullptr);
  EXPECT_EQ(world->GetModel("b"), nullptr);
}

TEST(Loading, AMissingFileIsReported) {
  const auto world = EmptyWorld();
  const std::string errors =
      ErrorsOf([&] { EXPECT_FALSE(world->Load("/no/such/folder/t.world")); });
  EXPECT_NE(errors.find("/no/such/folder/t.world"), std::string::npos);
  EXPECT_EQ(world->LoadStatus(), 1);
  Step(*world);
}

TEST(Loading, UnLoadMakesRoomForTheNext) {
  const auto world = LoadText("model( name \"a\" model( ) )");
  Step(*world, 2);
  world->UnLoad();
  EXPECT_EQ(world->TokenStr(), "[unloaded]");
  EXPECT_EQ(world->GetAllModels().size(), 1u);
  EXPECT_EQ(world->GetGround()->TokenStr(), "_ground_model");
  EXPECT_EQ(world->SimTimeNow(), 0u);
  world->UnLoad();
  Step(*world);
  EXPECT_TRUE(TryToLoad(world.get(), "model( )").loaded);
}

// Sanitizers keep what is freed for a while.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kMemoryIsWatched = true;
#else
constexpr bool kMemoryIsWatched = false;
#endif

TEST(Loading, ManyTimesDoesNotGrow) {
  std::string text = "resolution 0.02\n";
  for (int i = 0; i < 20; i++)
    text += "position( pose [" + std::to_string(7 * i % 30) + " " + std::to_string(11 * i % 30) +
            " 0 30] alwayson 1 velocity [0.5 0 0 0] update_interval 300 ranger( alwayson 1"
            " sensor( samples 30 fov 180 ) ) model( boundary 1 ) )\n";
  const auto world = EmptyWorld();
  const auto cycle = [&] {
    std::istringstream content(text);
    ASSERT_TRUE(world->Load(content, "t.world"));
    Step(*world, 3);
    world->UnLoad();
  };
  const auto peak_memory = [] {
    struct rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss;  // KiB
  };
  testing::internal::CaptureStdout();
  for (int i = 0; i < 50; i++) cycle();
  const long memory_before = peak_memory();
  const grid::Grid::Statistics grid_before = world->scene().grid.statistics();
  for (int i = 0; i < 250; i++) cycle();
  const long memory_after = peak_memory();
  const grid::Grid::Statistics grid_after = world->scene().grid.statistics();
  testing::internal::GetCapturedStdout();
  EXPECT_EQ(grid_after.tiles, 0u);
  EXPECT_EQ(grid_after.superregions, grid_before.superregions);
  EXPECT_LE(grid_after.bytes, grid_before.bytes);
  if (!kMemoryIsWatched) {
    EXPECT_LE(memory_after - memory_before, 2048) << "KiB more after 250 further cycles";
  }
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

// In Stage the next one misses its turn, or all are called again.
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
  EXPECT_EQ(journal.Text(), "");  // it went with the world
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

// ---- making and deleting in the middle of things ------------------------------------------------

const char kTrio[] =
    "model( name \"a\" alwayson 1 ) model( name \"b\" alwayson 1 model( name \"c\" alwayson 1 ) )"
    " position( name \"d\" alwayson 1 ranger( name \"e\" alwayson 1 sensor( ) ) )";

int DeleteNamed(Model* mod, void* name) {
  delete Find(*mod->GetWorld(), static_cast<const char*>(name));
  return 0;
}

TEST(Deletion, OfOthersInAModelsCallback) {
  for (const char* name : {"b", "d", "b.c", "d.e"}) {
    for (const char* when : {"a", "d.e"}) {
      if (name[0] == 'd' && when[0] == 'd') continue;  // that would be itself
      const auto world = LoadText(kTrio);
      std::string victim = name;
      // Behind the callback that deletes there are those of the other models.
      for (const char* model : {"b", "b.c", "d"})
        Find(*world, model)
            ->AddCallback(
                Model::CB_UPDATE, [](Model*, void*) { return 0; }, nullptr);
      static bool done;
      done = false;
      Find(*world, when)
          ->AddCallback(
              Model::CB_UPDATE,
              [](Model* mod, void* arg) {
                if (!done) DeleteNamed(mod, arg);
                done = true;
                return 0;
              },
              &victim[0]);
      Step(*world, 3);
      EXPECT_EQ(world->GetModel(name), nullptr);
    }
  }
}

TEST(Deletion, DuringUpdates) {
  // A velocity callback runs while sensors put their rays together.
  for (const char* name : {"a", "b", "later", "later.l", "first"}) {
    const auto world =
        LoadText("position( name \"first\" alwayson 1 ranger( alwayson 1 sensor( ) ) ) " +
                 std::string(kTrio) +
                 " position( name \"later\" alwayson 1 ranger( name \"l\" alwayson 1"
                 " sensor( samples 5 ) ) )");
    std::string victim = name;
    static bool done;
    done = false;
    Find(*world, "d")
        ->AddCallback(
            Model::CB_VELOCITY,
            [](Model* mod, void* arg) {
              if (!done) DeleteNamed(mod, arg);
              done = true;
              return 0;
            },
            &victim[0]);
    Step(*world, 3);
    EXPECT_EQ(world->GetModel(name), nullptr);
  }
}

TEST(Deletion, InWorldCallbacksAndEvents) {
  const auto world = LoadText(kTrio);
  world->AddUpdateCallback(
      [](World* w, void*) {
        delete Find(*w, "d");
        return 1;
      },
      nullptr);
  static char b[] = "b";
  world->Enqueue(0, 0, Find(*world, "a"), DeleteNamed, b);
  Step(*world, 3);
  EXPECT_EQ(world->GetAllModels().size(), 2u);
}

TEST(Deletion, OfWhatRangersSeeIsSafe) {
  const auto world = LoadText(
      "ranger( name \"l\" alwayson 1 sensor( range [0 9] ) ) model( name \"a\" pose [3 0 0 0]"
      " size [1 1 1] ) model( pose [5 0 0 0] size [1 1 1] )");
  const std::vector<double>& ranges = Find<ModelRanger>(*world, "l")->GetSensors()[0].ranges;
  Step(*world);
  EXPECT_NEAR(ranges.at(0), 2.5, kCell);
  delete Find(*world, "a");
  Step(*world);
  EXPECT_NEAR(ranges.at(0), 4.5, kCell);
}

TEST(Creation, InCallbacks) {
  const auto world = LoadText(kTrio);
  const auto create = [](Model* mod, void*) {
    Model* made = mod->GetWorld()->CreateModel(nullptr, "position");
    made->SetPose(Pose(static_cast<double>(mod->GetWorld()->SimTimeNow()) / 1e5, 5, 0, 0));
    made->Subscribe();
    return 0;
  };
  Find(*world, "a")->AddCallback(Model::CB_UPDATE, create, nullptr);
  Find(*world, "d")->AddCallback(Model::CB_VELOCITY, create, nullptr);
  Step(*world, 5);
  EXPECT_EQ(world->GetAllModels().size(), 16u);
}

TEST(Creation, WhileModelsAreInitialised) {
  const auto world = LoadText(kTrio);
  static int made;
  made = 0;
  Find(*world, "a")
      ->AddCallback(
          Model::CB_INIT,
          [](Model* mod, void*) {
            Model* child = mod->GetWorld()->CreateModel(mod, "model");
            child->SetPose(Pose(0, 0.5 * ++made, 0, 0));
            return 0;
          },
          nullptr);
  Find(*world, "a")->InitControllers();
  Find(*world, "a")->InitControllers();
  EXPECT_EQ(Find(*world, "a")->GetChildren().size(), 2u);
  Step(*world);
}

TEST(Creation, OfAModelThatIsSubscribedAndDeletedAtOnce) {
  const auto world = LoadText(kTrio);
  for (int i = 0; i < 100; i++) {
    Model* position = world->CreateModel(nullptr, "position");
    Model* ranger = world->CreateModel(position, "ranger");
    static_cast<ModelRanger*>(ranger)->GetSensorsMutable().resize(2);
    position->Subscribe();
    ranger->Subscribe();
    if (i % 2) Step(*world);
    delete position;
  }
  EXPECT_EQ(world->GetAllModels().size(), 6u);
}

// ---- saving -------------------------------------------------------------------------------------

TEST(Saving, WritesPosesAndCanBeLoadedAgain) {
  const std::string path = testing::TempDir() + "stage_world_test.world";
  std::ofstream(path) << "position( name \"r\" pose [1 2 0 30] alwayson 1 )\n";
  const auto world = EmptyWorld();
  ASSERT_TRUE(world->Load(path));
  Journal journal;
  ModelPosition* robot = Find<ModelPosition>(*world, "r");
  robot->SetSpeed(0.5, 0, 0.3);
  Step(*world, 10);
  int saves = 0;
  robot->AddCallback(
      Model::CB_SAVE, [](Model*, void* count) { return ++*static_cast<int*>(count), 0; }, &saves);
  EXPECT_TRUE(world->Save(nullptr));
  EXPECT_EQ(saves, 1);
  const Pose pose = robot->GetPose();
  ASSERT_TRUE(world->Load(path));
  const Pose again = Find(*world, "r")->GetPose();
  ExpectPose(again, pose.x, pose.y, 0, pose.a, 1e-6);
  std::filesystem::remove(path);
  EXPECT_FALSE(EmptyWorld()->Save("nowhere.world"));  // nothing was loaded
}

// ---- deleting what is in use --------------------------------------------------------------------

TEST(SelfDeletion, OfAWorldInTheCallbackOfAnother) {
  const auto first = LoadText("");
  auto* second = LoadText("model( alwayson 1 )").release();
  first->AddUpdateCallback(
      [](World*, void* other) {
        delete static_cast<World*>(other);
        return 1;
      },
      second);
  EXPECT_FALSE(World::UpdateAll());
  EXPECT_FALSE(World::UpdateAll());
}

TEST(SelfDeletion, InAModelsOwnUpdateCallback) {
  const auto world = LoadText(kTrio);
  Model* b = Find(*world, "b");
  b->AddCallback(
      Model::CB_UPDATE,
      [](Model* mod, void*) {
        delete mod;
        return 0;
      },
      nullptr);
  b->AddCallback(
      Model::CB_UPDATE, [](Model*, void*) { return 1; }, nullptr);
  Step(*world, 3);
  EXPECT_EQ(world->GetModel("b"), nullptr);
  EXPECT_EQ(world->GetModel("b.c"), nullptr);
}

int DeleteIt(Model* mod, void*) { return delete mod, 0; }

// What is drawn of a model that is gone could still be seen.
TEST(SelfDeletion, InItsParentCallback) {
  for (const auto type : {Model::CB_PARENT, Model::CB_POSE}) {
    const auto world =
        LoadText("model( name \"a\" pose [3 0 0 0] ) model( name \"b\" noblocks 1 )");
    Find(*world, "a")->AddCallback(type, DeleteIt, nullptr);
    Find(*world, "a")->SetParent(Find(*world, "b"));
    EXPECT_EQ(world->GetModel("a"), nullptr);
    EXPECT_TRUE(Find(*world, "b")->GetChildren().empty());
    const auto any = [](Model*, const Model*, const void*) { return true; };
    EXPECT_EQ(world->Raytrace(Pose(), 9, any, nullptr, nullptr, false).mod, nullptr);
    Step(*world, 2);
  }
}

TEST(SelfDeletion, WhenItStartsOrStops) {
  for (const auto type : {Model::CB_STARTUP, Model::CB_SHUTDOWN})
    for (const char* kind : {"position", "ranger", "bumper", "blobfinder", "fiducial", "wifi",
                             "actuator", "gripper", "camera", "model"}) {
      const auto world = LoadText(std::string(kind) + "( name \"m\" joules 5 )");
      Model* m = Find(*world, "m");
      m->AddCallback(type, DeleteIt, nullptr);
      m->Subscribe();
      if (type == Model::CB_SHUTDOWN) m->Unsubscribe();
      EXPECT_EQ(world->GetModel("m"), nullptr) << kind;
      Step(*world, 3);
    }
}

// Init functions of controllers delete whom they like: of the others, each is called once.
TEST(SelfDeletion, WhileModelsAreInitialised) {
  Model::name_map["eraser"] = [](World* world, Model* parent, const std::string& type) {
    Model* model = new Model(world, parent, type);
    model->AddCallback(
        Model::CB_INIT,
        [](Model* mod, void*) {
          const World& all = *mod->GetWorld();  // the model itself is among those that go
          for (const char* name : {"first", "self", "next", "last"})
            if (all.GetChildren().size() > 2) delete Find(all, name);
          return 0;
        },
        nullptr);
    return model;
  };
  const auto world = LoadText(
      "model( name \"first\" ) eraser( name \"self\" ) eraser( name \"next\" ) model( ) model( "
      "name \"last\" )");
  Model::name_map.erase("eraser");
  EXPECT_EQ(world->GetAllModels().size(), 2u);
  Step(*world);
}

TEST(SelfDeletion, InAModelsOwnPoseCallback) {
  const auto world = LoadText(kTrio);
  Model* b = Find(*world, "b");
  b->AddCallback(
      Model::CB_POSE,
      [](Model* mod, void*) {
        delete mod;
        return 1;
      },
      nullptr);
  b->SetPose(Pose(1, 0, 0, 0));
  EXPECT_EQ(world->GetModel("b"), nullptr);
  Step(*world, 2);
}

}  // namespace
}  // namespace Stg
