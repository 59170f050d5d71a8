// SPDX-License-Identifier: GPL-2.0-or-later
//
// Common idioms of Stage's clients compile and work.

#include "api_testing.hh"

// Clients cast various function types to callback types, and nest FOR_EACH.
#pragma GCC diagnostic ignored "-Wcast-function-type"
#pragma GCC diagnostic ignored "-Wshadow"

namespace {

// ---- idioms -------------------------------------------------------------------------------------

/// A client that works like a ROS node.
struct Node {
  vector<ModelPosition*> positions;
  vector<ModelRanger*> rangers;
  int steps = 0, position_updates = 0, ranger_updates = 0;
};

void SortOut(Model* mod, Node* node) {
  if (mod->GetModelType() == "ranger") node->rangers.push_back(static_cast<ModelRanger*>(mod));
  if (dynamic_cast<ModelPosition*>(mod)) node->positions.push_back((ModelPosition*)mod);
}

bool AfterStep(World* world, Node* node) {
  EXPECT_EQ(world->SimTimeNow(), (usec_t)++node->steps * 100000);
  return false;
}

int PositionUpdated(ModelPosition* position, Node* node) {
  EXPECT_EQ(position, node->positions[0]);
  node->position_updates++;
  return 0;
}

int RangerUpdated(ModelRanger* ranger, Node* node) {
  EXPECT_EQ(ranger, node->rangers[0]) << "a Model* is a ModelRanger*, byte for byte";
  FOR_EACH(sensor, ranger->GetSensors()) EXPECT_EQ(sensor->ranges.size(), sensor->sample_count);
  return ++node->ranger_updates == 3;  // enough
}

const char* const kWorld =
    "position( name \"r0\" ranger( name \"laser\" sensor( samples 5 ) ) )\n"
    "model( name \"wall\" pose [3 0 0 0] )";

TEST(Idioms, InitWithoutArguments) {
  int argc = 0;
  Init(&argc, NULL);
  EXPECT_TRUE(InitDone());
  EXPECT_TRUE(World::args.empty());
}

TEST(Idioms, InitWithAnybodysArguments) {
  char name[] = "node", remap[] = "__name:=stage", option[] = "--no-such-option";
  char* arguments[] = {name, remap, option, nullptr};
  char** argv = arguments;
  int argc = 3;
  Init(&argc, &argv);
  EXPECT_EQ(argc, 3);
  EXPECT_EQ(argv, arguments);
  EXPECT_STREQ(argv[2], "--no-such-option");
  EXPECT_EQ(World::args, (vector<string>{"node", "__name:=stage", "--no-such-option"}));
}

TEST(Idioms, ANodeSortsOutModelsAndListensToThem) {
  int argc = 0;
  Init(&argc, NULL);
  World* world = new World();
  istringstream content(kWorld);
  ASSERT_TRUE(world->Load(content));
  Node node;
  world->AddUpdateCallback((world_callback_t)AfterStep, &node);
  world->ForEachDescendant((model_callback_t)SortOut, &node);
  ASSERT_EQ(node.positions.size(), 1u);
  ASSERT_EQ(node.rangers.size(), 1u);
  EXPECT_EQ(node.rangers[0]->Parent(), node.positions[0]);
  node.positions[0]->AddCallback(Model::CB_UPDATE, (model_callback_t)PositionUpdated, &node);
  node.rangers[0]->AddCallback(Model::CB_UPDATE, (model_callback_t)RangerUpdated, &node);
  node.positions[0]->Subscribe();
  node.rangers[0]->Subscribe();
  world->Start();
  for (int i = 0; i < 5; i++) EXPECT_FALSE(world->UpdateAll());
  EXPECT_EQ(node.steps, 5);
  EXPECT_EQ(node.position_updates, 5);
  EXPECT_EQ(node.ranger_updates, 3);
  delete world;
}

TEST(Idioms, NamesMayBeStringsOrLiterals) {
  World world("my world", 50);
  istringstream content(kWorld);
  ASSERT_TRUE(world.Load(content, "t.world"));
  const string name("r0");
  EXPECT_EQ(world.GetModel("r0"), world.GetModel(name));
  ModelPosition* robot = (ModelPosition*)world.GetModel(name);
  EXPECT_EQ(robot->GetChild("laser"), robot->GetChild("ranger:0"));
  EXPECT_EQ(robot->GetChild("laser"), robot->GetUnusedModelOfType("ranger"));
  robot->Say("a literal");
  robot->SetPose({1, 2, 0, 0.5});
  robot->SetRangerReturn(1.0);
  robot->SetRangerReturn(-1.0);
  EXPECT_EQ(robot->velocity_bounds->max, 1.0);
  Ancestor* ancestor = (Ancestor*)robot;
  EXPECT_STREQ(ancestor->Token(), "r0");
  EXPECT_EQ((void*)ancestor, (void*)robot);
  EXPECT_EQ((void*)static_cast<Model*>((ModelRanger*)robot->GetChild("laser")),
            (void*)(ModelRanger*)robot->GetChild("laser"));
}

class MyType : public Model {
 public:
  MyType(World* world_, Model* parent_, const string& type_) : Model(world_, parent_, type_) {}
  static Model* Make(World* world, Model* parent, const string& type) {
    return new MyType(world, parent, type);
  }
  void Update(void) override {
    updates++;
    Model::Update();
  }
  int updates = 0;
};

TEST(Idioms, TypesOfOnesOwn) {
  Model::name_map["mytype"] = MyType::Make;
  World world;
  istringstream content("mytype( name \"mine\" alwayson 1 )");
  ASSERT_TRUE(world.Load(content));
  for (int i = 0; i < 3; i++) world.Update();
  MyType* mine = dynamic_cast<MyType*>(world.GetModel("mine"));
  ASSERT_NE(mine, nullptr);
  EXPECT_EQ(mine->updates, 3);
  EXPECT_NE(dynamic_cast<MyType*>(world.CreateModel(NULL, "mytype")), nullptr);
  Model::name_map.erase("mytype");
}

TEST(Idioms, FlagsAreHandedFromModelToModel) {
  World world;
  Model *giver = world.CreateModel(NULL, "model"), *taker = world.CreateModel(NULL, "position");
  giver->PushFlag(new Model::Flag(Color(0, 0.8, 0), 0.5));
  taker->PushFlag(giver->PopFlag());
  EXPECT_EQ(taker->GetFlagCount(), 1u);
  delete taker->PopFlag();
}

}  // namespace
