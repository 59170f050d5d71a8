// SPDX-License-Identifier: GPL-2.0-or-later
//
// Models and worlds may be created and deleted at any time.

#include <string>
#include <vector>

#include "support/model_testing.hh"

namespace Stg {
namespace {

// ---- creating and deleting models in callbacks --------------------------------------------------

const char kTrio[] =
    "model( name \"a\" alwayson 1 ) model( name \"b\" alwayson 1 model( name \"c\" alwayson 1 ) )"
    " position( name \"d\" alwayson 1 ranger( name \"e\" alwayson 1 sensor( ) ) )";

int DeleteNamed(Model* mod, void* name) {
  delete Find(*mod->GetWorld(), static_cast<const char*>(name));
  return 0;
}

/// Makes the first callback of `when` of that type delete the model called `victim`. The string
/// must outlive the callback.
void DeleteOnce(Model* when, Model::callback_type_t type, std::string* victim) {
  static bool done;
  done = false;
  when->AddCallback(
      type,
      [](Model* mod, void* arg) {
        if (!done) DeleteNamed(mod, arg);
        done = true;
        return 0;
      },
      victim->data());
}

TEST(Deletion, OfOthersInAModelsCallback) {
  for (const char* name : {"b", "d", "b.c", "d.e"}) {
    for (const char* when : {"a", "d.e"}) {
      if (name[0] == 'd' && when[0] == 'd') continue;  // it would delete itself
      const auto world = LoadText(kTrio);
      std::string victim = name;
      // The callbacks of other models come after the deleting one.
      for (const char* model : {"b", "b.c", "d"})
        Find(*world, model)
            ->AddCallback(
                Model::CB_UPDATE, [](Model*, void*) { return 0; }, nullptr);
      DeleteOnce(Find(*world, when), Model::CB_UPDATE, &victim);
      Step(*world, 3);
      EXPECT_EQ(world->GetModel(name), nullptr);
    }
  }
}

TEST(Deletion, DuringUpdates) {
  // A velocity callback runs while sensors add their rays to the batch.
  for (const char* name : {"a", "b", "later", "later.l", "first"}) {
    const auto world =
        LoadText("position( name \"first\" alwayson 1 ranger( alwayson 1 sensor( ) ) ) " +
                 std::string(kTrio) +
                 " position( name \"later\" alwayson 1 ranger( name \"l\" alwayson 1"
                 " sensor( samples 5 ) ) )");
    std::string victim = name;
    DeleteOnce(Find(*world, "d"), Model::CB_VELOCITY, &victim);
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

// ---- deleting models in use ---------------------------------------------------------------------

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

// A deleted model must not leave cells in the grid that sensors could still see.
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
                             "radio", "actuator", "gripper", "camera", "model"}) {
      const auto world = LoadText(std::string(kind) + "( name \"m\" joules 5 )");
      Model* m = Find(*world, "m");
      m->AddCallback(type, DeleteIt, nullptr);
      m->Subscribe();
      if (type == Model::CB_SHUTDOWN) m->Unsubscribe();
      EXPECT_EQ(world->GetModel("m"), nullptr) << kind;
      Step(*world, 3);
    }
}

// Init functions of controllers delete models; those of all remaining models are called once.
TEST(SelfDeletion, WhileModelsAreInitialised) {
  Model::name_map["eraser"] = [](World* world, Model* parent, const std::string& type) {
    Model* model = new Model(world, parent, type);
    model->AddCallback(
        Model::CB_INIT,
        [](Model* mod, void*) {
          const World& all = *mod->GetWorld();  // the model itself is deleted, too
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
