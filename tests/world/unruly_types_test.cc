// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model types of plug-ins that violate the rules: the world reports the error in one line and goes
// on, or is not loaded. Errors about their exceptions name the model.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>

#include "models/exception_origin.hh"
#include "models/host.hh"
#include "models/model_type.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// The place where a model of the type "unruly" executes `deed`.
enum class Place { kNowhere, kConstructor, kLoad, kStartup, kUpdate, kSensed, kGather };
Place place = Place::kNowhere;
void (*deed)(Model*) = nullptr;

class Unruly : public Model {
 public:
  Unruly(World* world_, Model* parent_, const std::string& type_) : Model(world_, parent_, type_) {
    DoAt(Place::kConstructor, this);
  }
  void Load() override {
    Model::Load();
    DoAt(Place::kLoad, this);
  }
  void Startup() override {
    Model::Startup();
    DoAt(Place::kStartup, this);
  }
  void Update() override {
    GetWorld()->host().sensed.push_back(this);
    Model::Update();
    DoAt(Place::kUpdate, this);
  }
  void Sensed() override { DoAt(Place::kSensed, this); }

 private:
  /// Static, because the model may have been deleted before. The deed may delete it, too.
  static void DoAt(Place here, Unruly* model) {
    if (here == place) deed(model);
  }
};

/// A type whose models update in parallel.
class UnrulyGatherer : public Model {
 public:
  UnrulyGatherer(World* world_, Model* parent_, const std::string& type_)
      : Model(world_, parent_, type_) {}
  void Update() override {
    GatherSerially();
    Model::Update();
  }
  void Gather(internal::sensing::FanList*) override {
    if (place == Place::kGather && Token() == std::string("g7")) deed(this);
  }
};

[[maybe_unused]] const bool kRegistered =
    RegisterModelType(ModelTypeOf<Unruly>("unruly")) &&
    RegisterModelType(ModelTypeOf<UnrulyGatherer>("gatherer").Updates(ModelType::kParallel));

const char kText[] =
    "model( name \"before\" )\n"
    "model( name \"parent\" unruly( name \"u\" alwayson 1 block( points 3 point[0] [0 0]\n"
    "  point[1] [1 0] point[2] [0 1] z [0 1] ) ) model( name \"sister\" ) )\n"
    "model( name \"after\" )\n";

class UnrulyTypes : public testing::Test {
 protected:
  void SetUp() override { InitLibrary(); }
  void TearDown() override { place = Place::kNowhere; }
  static void Do(Place where, void (*what)(Model*)) {
    place = where;
    deed = what;
  }
};

void DeleteParent(Model* model) { delete model->Parent(); }
void DeleteGround(Model* model) { delete model->GetWorld()->GetGround(); }
void Throw(Model*) { throw std::runtime_error("it is Friday"); }

TEST_F(UnrulyTypes, DeletingTheParentInTheConstructorIsRefusedOnLoad) {
  Do(Place::kConstructor, DeleteParent);
  const LoadOutcome outcome = TryToLoad(kText);
  EXPECT_FALSE(outcome.loaded);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(
      outcome.errors,
      "t.world:2:22: found a model of type \"unruly\" that was deleted while it was being made, "
      "expected a type that deletes neither itself nor its parent there\n");
}

TEST_F(UnrulyTypes, DeletingTheParentInTheConstructorIsRefusedAtRunTime) {
  const auto world = LoadText("model( name \"parent\" )");
  Do(Place::kConstructor, DeleteParent);
  const std::string errors =
      ErrorsOf([&] { EXPECT_EQ(world->CreateModel(Find(*world, "parent"), "unruly"), nullptr); });
  EXPECT_NE(errors.find("was deleted while it was being made"), std::string::npos) << errors;
  Step(*world, 3);
  EXPECT_EQ(world->GetAllModels().size(), 1u);
}

TEST_F(UnrulyTypes, MayDeleteTheirParentLater) {
  for (const Place where : {Place::kLoad, Place::kStartup, Place::kUpdate, Place::kSensed}) {
    Do(where, DeleteParent);
    const auto world = LoadText(kText);
    Step(*world, 5);
    EXPECT_EQ(world->GetAllModels().size(), 3u) << static_cast<int>(where);
    EXPECT_NE(world->GetModel("after"), nullptr);
  }
}

TEST_F(UnrulyTypes, DeletingTheGroundIsReportedAndGroundRecreated) {
  for (const Place where :
       {Place::kConstructor, Place::kLoad, Place::kStartup, Place::kUpdate, Place::kSensed}) {
    Do(where, DeleteGround);
    std::unique_ptr<World> world;
    const std::string errors = ErrorsOf([&] {
      world = LoadText(kText);
      Step(*world, 3);
    });
    EXPECT_EQ(errors.find("stage: found the ground deleted, expected it to stay as long as its "
                          "world; it has been recreated\n"),
              0u)
        << errors;
    const auto is_ground = [&](const Model* model) { return model == world->GetGround(); };
    const std::set<Model*> models = world->GetAllModels();
    EXPECT_EQ(std::count_if(models.begin(), models.end(), is_ground), 1);
    EXPECT_EQ(world->GetGround()->GetId(), 0u);
    place = Place::kNowhere;
    Snapshot snapshot;
    EXPECT_TRUE(world->Take(&snapshot));
    EXPECT_TRUE(world->Restore(snapshot));
    EXPECT_TRUE(world->Reset(1));
  }
}

TEST_F(UnrulyTypes, DeletingTheGroundChangesNoResult) {
  const std::string text =
      "position( name \"r\" pose [0 0 0.1 0] alwayson 1 ranger( alwayson 1 sensor( ) ) )";
  const auto world = LoadText(text), other = LoadText(text);
  ErrorsOf([&] { delete world->GetGround(); });
  EXPECT_EQ(world->StateHash(), other->StateHash());
  Step(*world, 5);
  Step(*other, 5);
  EXPECT_EQ(world->StateHash(), other->StateHash());
}

TEST_F(UnrulyTypes, ExceptionsNameTheModel) {
  for (const Place where : {Place::kUpdate, Place::kSensed}) {
    const auto world = LoadText(kText);
    Do(where, Throw);
    EXPECT_THROW(world->Update(), std::runtime_error);
    EXPECT_EQ(std::string(ExceptionOrigin()), "the update of model \"parent.u\"");
    place = Place::kNowhere;
  }
}

TEST_F(UnrulyTypes, ExceptionsNameTheModelInOtherThreads) {
  std::string text;
  for (int i = 0; i < 20; i++)
    text += "gatherer( name \"g" + std::to_string(i) + "\" alwayson 1 )\n";
  InitLibrary();
  for (const int threads : {1, 3}) {
    RunOptions options;
    options.threads = threads;
    options.share_from = 1;
    World world(options);
    std::istringstream content(text);
    ASSERT_TRUE(world.Load(content, "t.world"));
    Do(Place::kGather, Throw);
    EXPECT_THROW(world.Update(), std::runtime_error);
    EXPECT_EQ(std::string(ExceptionOrigin()), "the update of model \"g7\"")
        << threads << " threads";
    place = Place::kNowhere;
  }
}

}  // namespace
}  // namespace Stg
