// SPDX-License-Identifier: GPL-2.0-or-later
//
// Callbacks may change their world: create and delete models while it is reloaded or saved, and
// load, unload or delete it.

#include <string>
#include <utility>
#include <vector>

#include "support/model_testing.hh"

namespace Stg {
namespace {

const char kWorld[] =
    "position( name \"m\" pose [1 1 0 0] joules 5 ranger( name \"r\" alwayson 1 sensor( ) ) )"
    " model( name \"other\" pose [3 0 0 0] )";

constexpr const char* kTypes[] = {"model",    "position", "ranger",       "gripper",
                                  "bumper",   "fiducial", "blobfinder",   "camera",
                                  "actuator", "wifi",     "blinkenlight", "lightindicator",
                                  "radio",    "light",    "lightsensor"};

World* NewWorld(const std::string& text) { return LoadText(text).release(); }

int MakeModel(Model* mod, void*) {
  Model* made = mod->GetWorld()->CreateModel(nullptr, "position");
  made->Subscribe();
  return 0;
}

int DeleteIt(Model* mod, void*) {
  delete mod;
  return 0;
}

int DeleteOther(Model* mod, void* other) {
  if (Model* victim = Model::LookupId(*static_cast<uint32_t*>(other))) delete victim;
  (void)mod;
  return 0;
}

bool SaveNowhere(World* world) { return world->Save("/nonexistent/folder/t.world"); }

// ---- creating and deleting models while the world is reloaded or saved --------------------------

TEST(Reentry, ModelsMadeWhileTheWorldIsReloadedOrSaved) {
  const auto world = LoadText(kWorld);
  Find(*world, "m")->AddCallback(Model::CB_LOAD, MakeModel, nullptr);
  Find(*world, "m")->AddCallback(Model::CB_SAVE, MakeModel, nullptr);
  const size_t before = world->GetAllModels().size();
  for (int i = 0; i < 20; i++) {  // enough models to reallocate the list of models
    world->Reload();
    ErrorsOf([&] { SaveNowhere(world.get()); });
  }
  EXPECT_EQ(world->GetAllModels().size(), before + 40);
  Step(*world, 2);
}

TEST(Reentry, ModelsDeletedWhileTheWorldIsReloadedOrSaved) {
  for (const auto when :
       {Model::CB_LOAD, Model::CB_SAVE, Model::CB_POSE, Model::CB_GEOM, Model::CB_STARTUP})
    for (const char* type : kTypes)
      for (const bool itself : {true, false}) {
        SCOPED_TRACE(std::string(type) + " " + std::to_string(when));
        const auto world = LoadText("model( name \"first\" ) " + std::string(type) +
                                    "( name \"m\" ) model( name \"last\" ) " + std::string(type) +
                                    "( name \"next\" )");
        // The model restarts when it is reloaded.
        Find(*world, "m")->SetWorldfile(world->GetWorldFile(), 2);
        uint32_t last = Find(*world, "last")->GetId();
        Find(*world, "m")->AddCallback(when, itself ? DeleteIt : DeleteOther, &last);
        world->Reload();
        ErrorsOf([&] { SaveNowhere(world.get()); });
        if (when != Model::CB_STARTUP) {
          EXPECT_EQ(world->GetAllModels().size(), 4u);
        }
        Step(*world, 2);
      }
}

// A model that a program has created has no section in the world file.
TEST(Reentry, ModelsWithoutAWorldFileReloadToo) {
  const auto world = LoadText(kWorld);
  for (const char* type : kTypes) world->CreateModel(nullptr, type);
  world->Reload();
  ErrorsOf([&] { SaveNowhere(world.get()); });
  Step(*world, 2);
}

TEST(Reentry, NeitherReloadsNorSavesWithinOneAnother) {
  const auto world = LoadText(kWorld);
  for (const auto when : {Model::CB_LOAD, Model::CB_SAVE})
    Find(*world, "m")
        ->AddCallback(
            when,
            [](Model* mod, void*) {
              mod->GetWorld()->Reload();
              EXPECT_FALSE(SaveNowhere(mod->GetWorld()));
              return 0;
            },
            nullptr);
  EXPECT_EQ(ErrorsOf([&] { world->Reload(); }),
            "stage: a world can't be reloaded while it is being reloaded or saved\n"
            "stage: a world can't be saved while it is being reloaded or saved\n");
  Step(*world, 2);
}

TEST(Reentry, NoStepWithinAStep) {
  const auto world = LoadText(kWorld);
  world->AddUpdateCallback(
      [](World* w, void*) {
        EXPECT_FALSE(w->Update());
        World::UpdateAll();
        return 0;
      },
      nullptr);
  Step(*world, 3);
  EXPECT_EQ(world->UpdateCount(), 3u);
}

// ---- the end of a world in a callback -----------------------------------------------------------

enum class End { kDelete, kUnLoad, kLoad };
constexpr End kEnds[] = {End::kDelete, End::kUnLoad, End::kLoad};

void Put(End end, World* world) {
  std::istringstream text("model( name \"new\" alwayson 1 )");
  if (end == End::kDelete) delete world;
  if (end == End::kUnLoad) world->UnLoad();
  if (end == End::kLoad) {
    EXPECT_TRUE(world->Load(text, "new.world"));
  }
}

int EndIt(Model* mod, void* end) { return Put(*static_cast<const End*>(end), mod->GetWorld()), 0; }
int EndWorld(World* world, void* end) { return Put(*static_cast<const End*>(end), world), 0; }

/// Executes the actions until the world or the model is gone.
template <typename... Actions>
void DoWhileThere(World* world, uint32_t model, Actions... actions) {
  const auto there = [&] { return World::Exists(world) && Model::LookupId(model); };
  (..., (there() ? (void)actions(Model::LookupId(model)) : void()));
}

/// Triggers callbacks of all types of model "m".
void DoAll(World* world, Model* m) {
  static Model::Flag flag(Color::red, 1);
  const auto update = [=](Model*) { world->Update(); };
  DoWhileThere(
      world, m->GetId(), [](Model* mod) { mod->Subscribe(); }, update, update,
      [](Model* mod) { mod->AddFlag(&flag); }, [](Model* mod) { mod->PopFlag(); },
      [](Model* mod) { mod->SetPose(Pose(2, 2, 0, 0)); },
      [](Model* mod) { mod->RandomPoseInFreeSpace(-9, 9, -9, 9, 3); },
      [](Model* mod) { mod->SetGeom(Geom()); },
      [](Model* mod) { mod->SetParent(Find(*mod->GetWorld(), "other")); },
      [](Model* mod) { mod->InitControllers(); }, [=](Model*) { world->Reload(); },
      [=](Model*) { SaveNowhere(world); }, [](Model* mod) { mod->Unsubscribe(); });
}

/// Checks the world after a callback has deleted, unloaded or reloaded it.
void ExpectEnded(World* world, End end) {
  ASSERT_EQ(World::Exists(world), end != End::kDelete);
  if (end == End::kDelete) return;
  EXPECT_EQ(world->GetAllModels().size(), end == End::kLoad ? 2u : 1u);
  EXPECT_EQ(world->GetWorldFile() != nullptr, end == End::kLoad);
  EXPECT_EQ(world->SimTimeNow(), 0u);
  EXPECT_EQ(world->UpdateCount(), 0u);
  Step(*world, 3);
  delete world;
}

TEST(Reentry, AWorldEndsInAnyCallbackOfAModel) {
  for (int type = 0; type < Model::__CB_TYPE_COUNT; type++)
    for (End end : kEnds)
      for (const int threads : {1, 2}) {
        SCOPED_TRACE(std::to_string(type) + ", end " + std::to_string(static_cast<int>(end)));
        World::run_options.threads = threads;
        World::run_options.share_from = 2;
        World* world = NewWorld(kWorld);
        World::run_options = RunOptions();
        Model* m = Find(*world, "m");
        m->AddCallback(static_cast<Model::callback_type_t>(type), EndIt, &end);
        ErrorsOf([&] { DoAll(world, m); });
        ExpectEnded(world, end);
      }
}

TEST(Reentry, AWorldEndsInItsOwnCallbackAndInAnEvent) {
  for (End end : kEnds)
    for (const bool event : {true, false}) {
      World* world = NewWorld(kWorld);
      if (event)
        world->Enqueue(0, 0, Find(*world, "m"), EndIt, &end);
      else
        world->AddUpdateCallback(EndWorld, &end);
      // Later callbacks must not be called.
      world->AddUpdateCallback([](World*, void*) -> int { abort(); }, nullptr);
      EXPECT_EQ(world->Update(), end == End::kDelete);
      ExpectEnded(world, end);
    }
}

TEST(Reentry, AWorldEndsInACallbackOfWhatAGripperTakesAndDrops) {
  for (const auto type : {Model::CB_PARENT, Model::CB_POSE})
    for (End end : kEnds) {
      World* world = NewWorld(
          "gripper( name \"g\" alwayson 1 size [0.4 0.4 0.4] autosnatch 1 )"
          " model( name \"thing\" pose [0.15 0 0 0] size [0.05 0.05 0.4] gripper_return 1 )");
      Find(*world, "thing")->AddCallback(type, EndIt, &end);
      bool changed = false;
      for (int i = 0; i < 60 && !changed; i++) {
        world->Update();
        changed = !World::Exists(world) || world->UpdateCount() == 0;
      }
      ASSERT_TRUE(changed) << "it was never gripped";
      ExpectEnded(world, end);
    }
}

/// While it lives, models of type "model" are created with a callback.
class Callback {
 public:
  Callback(Model::callback_type_t type, End end) {
    type_ = type;
    end_ = end;
    Model::name_map["model"] = [](World* world, Model* parent, const std::string& name) {
      Model* model = new Model(world, parent, name);
      if (done_) return model;
      model->AddCallback(
          type_,
          [](Model* mod, void*) {
            if (!std::exchange(done_, true)) Put(end_, mod->GetWorld());
            return 0;
          },
          nullptr);
      return model;
    };
    done_ = false;
  }
  ~Callback() { RegisterModels(); }
  bool done() const { return done_; }

 private:
  static Model::callback_type_t type_;
  static End end_;
  static bool done_;
};
Model::callback_type_t Callback::type_;
End Callback::end_;
bool Callback::done_;

TEST(Reentry, AWorldEndsWhileItIsLoaded) {
  for (const auto type :
       {Model::CB_LOAD, Model::CB_POSE, Model::CB_GEOM, Model::CB_STARTUP, Model::CB_INIT})
    for (const End end : kEnds) {
      SCOPED_TRACE(std::to_string(type) + ", end " + std::to_string(static_cast<int>(end)));
      World* world = EmptyWorld().release();
      const Callback callback(type, end);
      std::istringstream text("model( alwayson 1 position( ranger( sensor( ) ) ) ) model( )");
      bool loaded = false;
      const std::string errors = ErrorsOf([&] { loaded = world->Load(text, "t.world"); });
      EXPECT_TRUE(callback.done());
      EXPECT_EQ(loaded, end == End::kLoad);
      const char* what = end == End::kDelete ? "deleted" : "unloaded";
      EXPECT_EQ(errors, end == End::kLoad ? ""
                                          : std::string("stage: a callback ") + what +
                                                " the world while it was being loaded\n");
      if (end == End::kUnLoad) {
        EXPECT_EQ(world->LoadStatus(), 1);
      }
      ExpectEnded(world, end);
    }
}

int ThrowANumber(Model*, void*) { throw 42; }
int CallInit(Model* mod, void*) { return mod->CallCallbacks(Model::CB_INIT); }

TEST(Reentry, ExceptionsDuringLoadingAreReported) {
  static Model::callback_type_t when;
  static model_callback_t what;
  Model::name_map["thrower"] = [](World* world, Model* parent, const std::string& type) {
    auto* made = new Model(world, parent, type);
    made->AddCallback(when, what, nullptr);
    made->AddCallback(Model::CB_INIT, ThrowANumber, nullptr);
    return made;
  };
  for (when = Model::CB_FLAGDECR; when < Model::__CB_TYPE_COUNT;
       when = static_cast<Model::callback_type_t>(when + 1))
    for (const model_callback_t function : {ThrowANumber, CallInit}) {
      if (when == Model::CB_INIT && function == CallInit) continue;  // endless recursion
      what = function;
      SCOPED_TRACE(when);
      World world;
      const LoadOutcome outcome =
          TryToLoad(&world, "thrower( name \"t\" pose [1 0 0 0] alwayson 1 )");
      EXPECT_FALSE(outcome.loaded);
      EXPECT_EQ(outcome.status, 255);
      EXPECT_EQ(outcome.models, 1u) << "the ground";
      EXPECT_NE(outcome.errors.find("thrown the number 42"), std::string::npos) << outcome.errors;
      EXPECT_TRUE(TryToLoad(&world, "model( )").loaded);
    }
  Model::name_map.erase("thrower");
}

TEST(Reentry, DeletionDuringLoadingRemovesChildren) {
  InitLibrary();
  Model::name_map["doomed"] = [](World* world, Model* parent, const std::string& type) {
    Model* model = new ModelRanger(world, parent, type);
    model->AddCallback(Model::CB_LOAD, DeleteIt, nullptr);
    return model;
  };
  const auto world = LoadText(
      "model( name \"a\" ) doomed( sensor( ) block( points 3 point[0] [0 0] point[1] [1 0]"
      " point[2] [0 1] z [0 1] ) model( model( ) ) ) model( name \"b\" )");
  Model::name_map.erase("doomed");
  EXPECT_EQ(world->GetAllModels().size(), 3u);
  Step(*world, 2);
}

}  // namespace
}  // namespace Stg
