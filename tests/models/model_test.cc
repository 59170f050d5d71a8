// SPDX-License-Identifier: GPL-2.0-or-later
//
// Models: names, the tree, frames, callbacks, subscriptions, deletion.

#include <algorithm>
#include <cmath>
#include <limits>

#include "looking.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

// ---- names --------------------------------------------------------------------------------------

TEST(Names, AreMadeUpOfTypeAndCount) {
  const auto world = LoadText(
      "define box model( size [1 1 1] )\n"
      "model( model( ) position( ) model( name \"named\" ) box( ) )\n"
      "position( ) box( ) position( name \"given\" ) position( )");
  for (const char* name :
       {"_ground_model", "model:1", "model:1.model:0", "model:1.position:0", "model:1.named",
        "model:1.model:2", "position:0", "model:2", "given", "position:2"})
    EXPECT_EQ(Find(*world, name)->TokenStr(), name);
  EXPECT_EQ(world->GetAllModels().size(), 10u);
}

TEST(Names, OldOnesStayValid) {
  const auto world = LoadText("position( name \"r0\" ranger( name \"laser\" ) ranger( ) )");
  Model *robot = Find(*world, "r0"), *laser = Find(*world, "r0.laser");
  EXPECT_EQ(world->GetModel("position:0"), robot);
  EXPECT_EQ(robot->GetChild("laser"), laser);
  EXPECT_EQ(robot->GetChild("ranger:0"), laser);
  EXPECT_NE(robot->GetChild("ranger:1"), nullptr);
  robot->SetToken("new");
  EXPECT_EQ(world->GetModel("r0"), robot);
  EXPECT_EQ(world->GetModel("new"), robot);
  EXPECT_EQ(robot->TokenStr(), "new");
  EXPECT_EQ(laser->TokenStr(), "r0.laser");
}

TEST(Names, UnknownNamesWarnAndReturnNull) {
  const auto world = EmptyWorld();
  const std::string output = ErrorsOf([&] {
    EXPECT_EQ(world->GetModel("nobody"), nullptr);
    EXPECT_EQ(world->GetGround()->GetChild("nobody"), nullptr);
  });
  EXPECT_NE(output.find("nobody"), std::string::npos);
}

TEST(Names, ChildrenHaveTheParentsPrefixUnlessASlashPrecedes) {
  const auto world =
      LoadText("model( model( name \"b\" model( name \"/c\" model( ) ) ) name \"a\" model( ) )");
  EXPECT_EQ(Find(*world, "a")->GetChildren().size(), 2u);
  EXPECT_EQ(Find(*world, "a.b")->Parent(), Find(*world, "a"));
  EXPECT_EQ(Find(*world, "c")->Parent(), Find(*world, "a.b"));
  EXPECT_EQ(Find(*world, "c.model:0")->Root(), Find(*world, "a"));
  EXPECT_EQ(Find(*world, "a.model:1")->Parent(), Find(*world, "a"));
}

TEST(Names, DuplicateNamesFindTheLaterModel) {
  const auto world = LoadText("model( name \"a b.c\" ) model( name \"a b.c\" pose [1 0 0 0] )");
  EXPECT_EQ(Find(*world, "a b.c")->GetPose().x, 1);
}

TEST(Names, EmptyOnesAreRefused) {
  const auto world = EmptyWorld();
  EXPECT_NE(TryToLoad(world.get(), "model( model( name \"\" ) )").errors.find("empty"),
            std::string::npos);
  Model* child = Find(*world, "model:1.model:0");
  EXPECT_FALSE(ErrorsOf([&] { child->SetToken(""); }).empty());
  EXPECT_EQ(child->TokenStr(), "model:1.model:0");
}

// ---- the tree -----------------------------------------------------------------------------------

TEST(Tree, Relations) {
  const auto world = LoadText(
      "model( name \"a\" model( name \"b\" model( name \"c\" ) )"
      " model( name \"d\" ) ) model( name \"e\" )");
  Model *a = Find(*world, "a"), *b = Find(*world, "a.b"), *c = Find(*world, "a.b.c"),
        *d = Find(*world, "a.d"), *e = Find(*world, "e");
  EXPECT_EQ(a->Parent(), nullptr);
  EXPECT_EQ(c->Parent(), b);
  EXPECT_EQ(c->Root(), a);
  EXPECT_EQ(e->Root(), e);
  EXPECT_EQ(c->GetWorld(), world.get());
  EXPECT_TRUE(c->IsAntecedent(a) && c->IsAntecedent(b));
  EXPECT_FALSE(c->IsAntecedent(c) || c->IsAntecedent(d) || a->IsAntecedent(c));
  EXPECT_TRUE(a->IsDescendent(c) && a->IsDescendent(a));
  EXPECT_FALSE(c->IsDescendent(a) || e->IsDescendent(a));
  EXPECT_TRUE(c->IsRelated(d) && a->IsRelated(c) && c->IsRelated(c));
  EXPECT_FALSE(a->IsRelated(e));
}

TEST(Tree, VisitsParentsBeforeChildrenTheGroundFirst) {
  const auto world = LoadText(
      "model( name \"a\" model( name \"b\" model( name \"c\" ) )"
      " model( name \"d\" ) ) model( name \"e\" )");
  Journal journal;
  world->ForEachDescendant(
      [](Model* mod, void* to) {
        static_cast<Journal*>(to)->entries.push_back(mod->TokenStr());
        return 1;
      },
      &journal);
  EXPECT_EQ(journal.Text(), "_ground_model a a.b a.b.c a.d e");
}

TEST(Tree, GetUnusedModelOfTypeReturnsEachOnce) {
  const auto world = LoadText(
      "position( name \"r\" ranger( name \"a\" ranger( name \"b\" ) )"
      " ranger( name \"c\" ) )");
  Model* robot = Find(*world, "r");
  EXPECT_EQ(robot->GetUnusedModelOfType("position"), robot);
  EXPECT_EQ(robot->GetUnusedModelOfType("ranger"), Find(*world, "r.a"));
  EXPECT_EQ(robot->GetUnusedModelOfType("ranger"), Find(*world, "r.a.b"));
  EXPECT_EQ(robot->GetUnusedModelOfType("ranger"), Find(*world, "r.c"));
  const std::string output =
      ErrorsOf([&] { EXPECT_EQ(robot->GetUnusedModelOfType("ranger"), nullptr); });
  EXPECT_NE(output.find("ranger"), std::string::npos);
  EXPECT_EQ(ErrorsOf([&] { Find(*world, "r.c")->GetUnusedModelOfType("ranger"); }), "");
}

TEST(Tree, FindsModelsWithoutSubscribers) {
  const auto world = LoadText("position( name \"r\" ranger( name \"a\" ) ranger( name \"b\" ) )");
  Model* robot = Find(*world, "r");
  for (int i = 0; i < 2; i++)
    EXPECT_EQ(robot->GetUnsubscribedModelOfType("ranger"), Find(*world, "r.a"));
  Find(*world, "r.a")->Subscribe();
  EXPECT_EQ(robot->GetUnsubscribedModelOfType("ranger"), Find(*world, "r.b"));
  EXPECT_EQ(robot->GetUnsubscribedModelOfType("blinkenlight"), nullptr);
}

// Stage raises the model by its parent's height and drops it from the children of the world.
TEST(Tree, SetParentKeepsTheGlobalPose) {
  const auto world = LoadText(
      "model( name \"a\" pose [1 2 0.5 30] size [1 1 0.7] ) model( name \"b\" pose [4 -1 0 -90]"
      " stack_children 0 ) model( name \"c\" pose [-3 0.5 0.2 170] model( name \"d\" ) )");
  Model* c = Find(*world, "c");
  const Pose before = c->GetGlobalPose();
  Journal journal;
  const auto note = [](Model* mod, void* to) {
    static_cast<Journal*>(to)->entries.push_back(mod->Parent() ? mod->Parent()->Token() : "-");
    return 0;
  };
  c->AddCallback(Model::CB_PARENT, note, &journal);
  for (int round = 0; round < 2; round++) {
    for (Model* parent : {Find(*world, "a"), Find(*world, "b"), static_cast<Model*>(nullptr)}) {
      EXPECT_EQ(c->SetParent(parent), 0);
      EXPECT_EQ(c->Parent(), parent);
      ExpectPose(c->GetGlobalPose(), before.x, before.y, before.z, before.a, 1e-12);
      const std::vector<Model*>& children = parent ? parent->GetChildren() : world->GetChildren();
      EXPECT_EQ(std::count(children.begin(), children.end(), c), 1);
      EXPECT_EQ(Find(*world, "c.d")->Root(), parent ? parent : c);
    }
  }
  EXPECT_EQ(journal.Text(), "a b - a b -");
  EXPECT_EQ(world->GetChildren().size(), 4u);
}

TEST(Tree, ACycleIsRefused) {
  const auto world = LoadText("model( name \"a\" model( name \"b\" ) )");
  Model *a = Find(*world, "a"), *b = Find(*world, "a.b");
  EXPECT_FALSE(ErrorsOf([&] {
                 EXPECT_NE(a->SetParent(b), 0);
                 EXPECT_NE(a->SetParent(a), 0);
               }).empty());
  EXPECT_EQ(b->Parent(), a);
  EXPECT_EQ(a->Parent(), nullptr);
}

TEST(Tree, BecomeParentOfLeavesThePoseAlone) {
  const auto world =
      LoadText("model( name \"a\" pose [1 2 0 90] ) model( name \"b\" pose [3 0 0 0] )");
  Model *a = Find(*world, "a"), *b = Find(*world, "b");
  a->BecomeParentOf(b);
  ExpectPose(b->GetPose(), 3, 0, 0, 0);
  ExpectPose(b->GetGlobalPose(), 1, 5, 1, M_PI / 2);
  EXPECT_EQ(b->Root(), a);
  EXPECT_EQ(Look(*world, 1, 9, 1.5, -M_PI / 2).mod, b);
}

TEST(Tree, Properties) {
  const auto world = LoadText("model( name \"a\" )");
  int value = 0;
  std::string key = "key";
  Find(*world, "a")->SetProperty(key, &value);
  EXPECT_EQ(Find(*world, "a")->GetProperty(key), &value);
  EXPECT_EQ(world->GetProperty("key"), nullptr);
}

TEST(Tree, Masses) {
  const auto world = LoadText("model( mass 1 name \"a\" model( mass 2 model( mass 4 ) ) )");
  EXPECT_EQ(Find(*world, "a")->GetTotalMass(), 7);
  EXPECT_EQ(Find(*world, "a")->GetMassOfChildren(), 6);
  Find(*world, "a")->SetMass(10);
  EXPECT_EQ(Find(*world, "a")->GetTotalMass(), 16);
}

// ---- frames -------------------------------------------------------------------------------------

TEST(Frames, ChildrenStandOnTheirParents) {
  const auto world = LoadText(
      "model( name \"a\" pose [1 2 0.1 90] size [1 1 0.7] origin [5 5 0.5 45]\n"
      "  model( name \"b\" pose [0.5 0 0.2 0] stack_children 0 size [0.1 0.1 0.3]\n"
      "    model( name \"c\" pose [0 0 0 0] ) ) )");
  ExpectPose(Find(*world, "a.b")->GetGlobalPose(), 1, 2.5, 1.0, M_PI / 2);  // ignores the origin
  ExpectPose(Find(*world, "a.b.c")->GetGlobalPose(), 1, 2.5, 1.0, M_PI / 2);
}

TEST(Frames, LocalToGlobalHasTheBodysOffsetAndGlobalToLocalHasNot) {
  const auto world = LoadText("model( name \"a\" pose [1 2 0.5 90] origin [0.3 0.1 0.2 90] )");
  const Model* a = Find(*world, "a");
  ExpectPose(a->LocalToGlobal(Pose(1, 0, 0, 0.5)), 1 - 0.1 - 1, 2 + 0.3, 0.7,
             M_PI + 0.5 - 2 * M_PI);
  const point_t p = a->LocalToGlobal(point_t(0, 1));
  EXPECT_NEAR(p.x, 0.9, 1e-12);
  EXPECT_NEAR(p.y, 1.3, 1e-12);
  ExpectPose(a->GlobalToLocal(Pose(1, 3, 0.5, -M_PI)), 1, 0, 0, -1.5 * M_PI);  // not normalised
}

// Stage raises a child of a stacking parent by the parent's height at each call.
TEST(Frames, SetGlobalPoseKeepsTheHeight) {
  const auto world = LoadText(
      "model( name \"a\" pose [1 2 0 30] size [1 1 0.7] model( name \"b\" pose [0.1 0.2 0.25 10] ) "
      ")");
  Model* b = Find(*world, "a.b");
  const Pose global = b->GetGlobalPose();
  EXPECT_NEAR(global.z, 0.95, 1e-12);
  for (int i = 0; i < 3; i++) {
    b->SetGlobalPose(b->GetGlobalPose());
    ExpectPose(b->GetGlobalPose(), global.x, global.y, global.z, global.a, 1e-12);
  }
  ExpectPose(b->GetPose(), 0.1, 0.2, 0.25, dtor(10), 1e-12);
}

TEST(Frames, SetPoseNormalisesAndAddToPoseAdds) {
  const auto world = LoadText("model( name \"a\" pose [0 0 0 270] )");
  Model* a = Find(*world, "a");
  EXPECT_NEAR(a->GetPose().a, -M_PI / 2, 1e-12);
  a->SetPose(Pose(1, 2, 3, 7 * M_PI / 2));
  ExpectPose(a->GetPose(), 1, 2, 3, -M_PI / 2);
  a->AddToPose(1, 1, 1, M_PI / 2);
  ExpectPose(a->GetPose(), 2, 3, 4, 0);
  a->AddToPose(Pose(-2, 0, 0, -1));
  ExpectPose(a->GetPose(), 0, 3, 4, -1);
}

TEST(Frames, RefusesNonFinitePosesAndNormalizesHugeHeadings) {
  const auto world = LoadText("model( name \"a\" pose [1 2 0 0] )");
  Model* a = Find(*world, "a");
  const double nan = std::numeric_limits<double>::quiet_NaN(),
               infinity = std::numeric_limits<double>::infinity();
  for (const Pose& pose :
       {Pose(nan, 0, 0, 0), Pose(0, infinity, 0, 0), Pose(0, 0, nan, 0), Pose(0, 0, 0, infinity)}) {
    EXPECT_FALSE(ErrorsOf([&] { a->SetPose(pose); }).empty());
    ExpectPose(a->GetPose(), 1, 2, 0, 0);
  }
  a->SetPose(Pose(0, 0, 0, 1e17));
  EXPECT_LE(std::fabs(a->GetPose().a), M_PI);
}

TEST(Frames, BodiesFarOutsideTheGridComeBack) {
  const auto world = LoadText("model( name \"a\" size [1 1 1] )");
  Model* a = Find(*world, "a");
  a->SetPose(Pose(1e15, 0, 0, 0));
  EXPECT_EQ(Look(*world, -5, 0, 0.5, 0).mod, nullptr);
  a->SetPose(Pose(1, 0, 0, 0));
  EXPECT_EQ(Look(*world, -5, 0, 0.5, 0).mod, a);
}

// ---- callbacks ----------------------------------------------------------------------------------

struct Entry {
  Journal* journal;
  std::string text;
};
int Note(Model*, void* entry) {
  static_cast<Entry*>(entry)->journal->entries.push_back(static_cast<Entry*>(entry)->text);
  return 0;
}
int NoteOnce(Model* mod, void* entry) { return Note(mod, entry), 1; }

class Callbacks : public testing::Test {
 protected:
  std::unique_ptr<World> world = LoadText("model( name \"a\" )");
  Model* a = Find(*world, "a");
  Journal journal;
  Entry x{&journal, "x"}, y{&journal, "y"}, z{&journal, "z"};
};

TEST_F(Callbacks, AreCalledInTheOrderOfRegistrationEachPairOnce) {
  a->AddCallback(Model::CB_POSE, Note, &y);
  a->AddCallback(Model::CB_POSE, NoteOnce, &z);
  a->AddCallback(Model::CB_POSE, Note, &x);
  a->AddCallback(Model::CB_POSE, Note, &y);
  EXPECT_EQ(a->CallCallbacks(Model::CB_POSE), 2);
  EXPECT_EQ(journal.Text(), "y z x");
  a->CallCallbacks(Model::CB_GEOM);
  a->CallCallbacks(Model::CB_POSE);
  EXPECT_EQ(journal.Text(), "y z x y x");
}

TEST_F(Callbacks, RemoveCallbackRemovesAllWithThatFunction) {
  a->AddCallback(Model::CB_POSE, Note, &x);
  a->AddCallback(Model::CB_POSE, NoteOnce, &y);
  a->AddCallback(Model::CB_POSE, Note, nullptr);
  a->AddCallback(Model::CB_GEOM, Note, &z);
  EXPECT_EQ(a->RemoveCallback(Model::CB_POSE, Note), 1);
  EXPECT_EQ(a->RemoveCallback(Model::CB_UPDATE, Note), 0);
  a->CallCallbacks(Model::CB_POSE);
  a->CallCallbacks(Model::CB_GEOM);
  EXPECT_EQ(journal.Text(), "y z");
  a->AddCallback(Model::CB_POSE, Note, &x);  // can be added again
  a->CallCallbacks(Model::CB_POSE);
  EXPECT_EQ(journal.Text(), "y z x");
}

TEST_F(Callbacks, CanAddOthersForTheNextRound) {
  a->AddCallback(
      Model::CB_POSE,
      [](Model* mod, void* entry) {
        static char kNumbers[100];
        for (size_t i = 0; i < 100; i++)  // enough to reallocate any list
          mod->AddCallback(
              Model::CB_POSE, [](Model*, void*) { return 1; }, &kNumbers[i]);
        mod->AddCallback(Model::CB_POSE, Note, entry);
        return 0;
      },
      &x);
  a->AddCallback(Model::CB_POSE, Note, &y);
  a->CallCallbacks(Model::CB_POSE);
  EXPECT_EQ(journal.Text(), "y");
  a->CallCallbacks(Model::CB_POSE);
  EXPECT_EQ(journal.Text(), "y y x");
}

TEST_F(Callbacks, CanRemoveOthersThatHaveNotBeenCalledYet) {
  a->AddCallback(
      Model::CB_POSE,
      [](Model* mod, void*) { return mod->RemoveCallback(Model::CB_POSE, Note), 0; }, nullptr);
  a->AddCallback(Model::CB_POSE, Note, &x);
  a->AddCallback(Model::CB_POSE, NoteOnce, &y);
  EXPECT_EQ(a->CallCallbacks(Model::CB_POSE), 1);
  EXPECT_EQ(journal.Text(), "y");
}

TEST_F(Callbacks, CanCauseTheEventTheyAreCalledFor) {
  static int depth;
  depth = 0;
  a->AddCallback(
      Model::CB_POSE,
      [](Model* mod, void*) {
        if (depth++ < 3) mod->SetPose(Pose(depth, 0, 0, 0));
        return depth == 4 ? 1 : 0;
      },
      nullptr);
  a->AddCallback(Model::CB_POSE, Note, &x);
  a->SetPose(Pose(7, 0, 0, 0));
  EXPECT_EQ(journal.Text(), "x x x x");
  EXPECT_EQ(a->GetPose().x, 3);
}

TEST_F(Callbacks, EventsOfAModel) {
  const std::pair<Model::callback_type_t, const char*> events[] = {
      {Model::CB_GEOM, "geom"},         {Model::CB_POSE, "pose"},
      {Model::CB_PARENT, "parent"},     {Model::CB_STARTUP, "startup"},
      {Model::CB_SHUTDOWN, "shutdown"}, {Model::CB_UPDATE, "update"}};
  std::list<Entry> entries;
  for (const auto& [type, name] : events) {
    entries.push_back({&journal, name});
    a->AddCallback(type, Note, &entries.back());
  }
  a->SetPose(a->GetPose());  // called even if nothing changes
  a->SetGeom(a->GetGeom());
  a->Subscribe();
  a->Subscribe();
  Step(*world, 2);
  a->Unsubscribe();
  a->Unsubscribe();
  a->SetParent(nullptr);
  EXPECT_EQ(journal.Text(), "pose geom startup update update shutdown parent pose");
}

TEST(CallbackTypes, HaveTheNumbersThatClientsKnow) {
  EXPECT_EQ(Model::CB_FLAGDECR, 0);
  EXPECT_EQ(Model::CB_INIT, 3);
  EXPECT_EQ(Model::CB_UPDATE, 10);
  EXPECT_EQ(Model::CB_VELOCITY, 11);
  EXPECT_EQ(Model::__CB_TYPE_COUNT, 12);
}

// ---- creation and deletion ----------------------------------------------------------------------

TEST(Creation, AtRunTimeGivesTheDefaultBody) {
  const auto world = EmptyWorld();
  Model* a = world->CreateModel(nullptr, "model");
  ASSERT_NE(a, nullptr);
  EXPECT_EQ(a->TokenStr(), "model:1");
  EXPECT_EQ(a->GetModelType(), "model");
  EXPECT_EQ(a->GetColor().r, 1);
  ExpectExtent(*world, -0.2, 0.2, -0.2, 0.2, 0.5);
  Model* b = world->CreateModel(a, "position");
  EXPECT_EQ(b->TokenStr(), "model:1.position:0");
  EXPECT_EQ(b->GetGlobalPose().z, 1);
  EXPECT_NE(a->GetId(), b->GetId());
  EXPECT_TRUE(SeenAt(*world, 1.5));
  EXPECT_FALSE(ErrorsOf([&] { EXPECT_EQ(world->CreateModel(a, "unicorn"), nullptr); }).empty());
}

class Custom : public Model {
 public:
  Custom(World* w, Model* p, const std::string& t) : Model(w, p, t) {}
  int updates = 0;

 protected:
  void Update() override {
    updates++;
    Model::Update();
  }
};

TEST(Creation, ClientsCanAddTypes) {
  InitLibrary();
  Model::name_map["custom"] = [](World* w, Model* p, const std::string& t) -> Model* {
    return new Custom(w, p, t);
  };
  const auto world = LoadText("custom( name \"c\" alwayson 1 size [1 1 1] )");
  Model::name_map.erase("custom");
  Step(*world, 3);
  EXPECT_EQ(Find<Custom>(*world, "c")->updates, 3);
  EXPECT_EQ(Find(*world, "c")->GetModelType(), "custom");
}

TEST(Creation, DirectlyWithAName) {
  const auto world = EmptyWorld();
  Model* a = new Model(world.get(), nullptr, "model", "mine");
  EXPECT_EQ(world->GetModel("mine"), a);
  const std::vector<Model*>& children = world->GetChildren();
  EXPECT_EQ(std::count(children.begin(), children.end(), a), 1);
}

TEST(Deletion, TakesDescendantsNamesAndBodiesAlong) {
  const auto world = LoadText(
      "position( name \"r\" alwayson 1 ranger( name \"l\" alwayson 1 sensor( samples 3 ) )"
      " model( model( pose [1 0 0 0] ) ) ) model( name \"b\" )");
  Step(*world, 2);
  delete Find(*world, "r");
  EXPECT_EQ(world->GetAllModels().size(), 2u);
  EXPECT_EQ(world->GetModel("r"), nullptr);
  EXPECT_EQ(world->GetModel("position:0"), nullptr);
  EXPECT_EQ(world->GetModel("r.l"), nullptr);
  EXPECT_EQ(Look(*world, -10, 0, 1.5, 0).mod, nullptr);
  Step(*world, 3);
  delete Find(*world, "b");
  Step(*world, 3);
}

}  // namespace
}  // namespace Stg
