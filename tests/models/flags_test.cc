// SPDX-License-Identifier: GPL-2.0-or-later
//
// Attachments of all models besides bodies and energy: flags, trails, visualizers, options, log
// entries, speech and properties.

#include "support/model_testing.hh"

namespace Stg {
namespace {

class Flags : public testing::Test {
 protected:
  std::unique_ptr<World> world = LoadText("model( name \"m\" ) model( name \"n\" )");
  Model* m = Find(*world, "m");
  Model::Flag a{Color::red, 0.5}, b{Color::green, 0.3}, c{Color::blue, 0.2};
  int more = 0, fewer = 0;

  void SetUp() override {
    m->AddCallback(Model::CB_FLAGINCR, CountUp, &more);
    m->AddCallback(Model::CB_FLAGDECR, CountUp, &fewer);
  }
  static int CountUp(Model*, void* count) {
    ++*static_cast<int*>(count);
    return 0;
  }
  void ExpectCalls(int expected_more, int expected_fewer) {
    EXPECT_EQ(more, expected_more);
    EXPECT_EQ(fewer, expected_fewer);
  }
};

TEST_F(Flags, ArePushedToTheFrontAddedToTheBackAndPoppedFromTheFront) {
  EXPECT_EQ(m->GetFlagCount(), 0u);
  m->PushFlag(&a);
  m->PushFlag(&b);
  m->AddFlag(&c);
  EXPECT_EQ(m->GetFlagCount(), 3u);
  ExpectCalls(3, 0);
  EXPECT_EQ(m->PopFlag(), &b);
  EXPECT_EQ(m->PopFlag(), &a);
  EXPECT_EQ(m->PopFlag(), &c);
  ExpectCalls(3, 3);
  EXPECT_EQ(m->PopFlag(), nullptr);
  ExpectCalls(3, 3);
}

TEST_F(Flags, AreRemovedWhereverTheyAre) {
  m->AddFlag(&a);
  m->AddFlag(&b);
  m->AddFlag(&a);
  m->RemoveFlag(&a);
  EXPECT_EQ(m->GetFlagCount(), 1u);
  ExpectCalls(3, 1);
  m->RemoveFlag(&c);
  EXPECT_EQ(m->GetFlagCount(), 1u);
  ExpectCalls(3, 2);  // even though there was no such flag
}

TEST_F(Flags, NullFlagsAreIgnored) {
  m->AddFlag(nullptr);
  m->PushFlag(nullptr);
  m->RemoveFlag(nullptr);
  EXPECT_EQ(m->GetFlagCount(), 0u);
  ExpectCalls(0, 0);
}

TEST_F(Flags, GoFromModelToModelAndOutliveThem) {
  m->PushFlag(&a);
  Model* n = Find(*world, "n");
  n->PushFlag(m->PopFlag());
  EXPECT_EQ(m->GetFlagCount(), 0u);
  EXPECT_EQ(n->GetFlagCount(), 1u);
  world.reset();
  EXPECT_EQ(a.GetSize(), 0.5);
}

TEST_F(Flags, AreSplitByNibbling) {
  const std::unique_ptr<Model::Flag> piece(a.Nibble(0.25)), rest(a.Nibble(3));
  ASSERT_TRUE(piece && rest);
  EXPECT_EQ(piece->GetSize(), 0.25);
  EXPECT_EQ(piece->GetColor(), Color::red);
  EXPECT_EQ(rest->GetSize(), 0.25);
  EXPECT_EQ(a.GetSize(), 0);
  EXPECT_EQ(a.Nibble(0.1), nullptr);

  const std::unique_ptr<Model::Flag> nothing(b.Nibble(-1));
  EXPECT_EQ(nothing->GetSize(), 0);
  EXPECT_EQ(b.GetSize(), 0.3);
}

TEST_F(Flags, ChangeColourAndSize) {
  a.SetColor(Color::cyan);
  a.SetSize(2);
  EXPECT_EQ(a.GetColor(), Color::cyan);
  EXPECT_EQ(a.GetSize(), 2);
  a.Draw(nullptr);
}

TEST_F(Flags, AreInTheStateHash) {
  const uint64_t before = world->StateHash();
  m->PushFlag(&a);
  EXPECT_NE(world->StateHash(), before);
  m->PopFlag();
  EXPECT_EQ(world->StateHash(), before);
}

// ---- trails -------------------------------------------------------------------------------------

/// A position model that exposes its trail.
class Walker : public ModelPosition {
 public:
  using Model::Trail;
  using Model::TrailItem;
  using Model::UpdateTrail;
  using ModelPosition::ModelPosition;
  static Model* Make(World* world, Model* parent, const std::string& type) {
    return new Walker(world, parent, type);
  }
  std::vector<double> XAlongTrail() const {
    std::vector<double> xs;
    for (const TrailItem& item : Trail()) xs.push_back(std::round(item.pose.x * 1e6) / 1e6);
    return xs;
  }
};

class Trails : public testing::Test {
 protected:
  void SetUp() override {
    InitLibrary();
    Model::name_map["walker"] = Walker::Make;
  }
  void TearDown() override { Model::name_map.erase("walker"); }

  /// Loads a walker that moves at 1 m/s along x and records its trail.
  void Load(const std::string& properties) {
    world = LoadText("walker( name \"w\" size [0.2 0.2 0.2] " + properties + " )");
    walker = FindRunning<Walker>(*world, "w");
    walker->SetSpeed(1, 0, 0);
    world->RecordTrails(true);
  }
  std::unique_ptr<World> world;
  Walker* walker = nullptr;
};

using Xs = std::vector<double>;

TEST_F(Trails, RememberTheLatestPoses) {
  Load("trail_length 3 trail_interval 2");
  EXPECT_EQ(walker->XAlongTrail(), Xs{});
  Step(*world);
  EXPECT_EQ(walker->XAlongTrail(), Xs{});
  Step(*world);
  EXPECT_EQ(walker->XAlongTrail(), Xs({0.2}));
  Step(*world, 4);
  EXPECT_EQ(walker->XAlongTrail(), Xs({0.2, 0.4, 0.6}));
  walker->SetColor(Color::blue);
  Step(*world, 4);
  EXPECT_EQ(walker->XAlongTrail(), Xs({0.6, 0.8, 1.0}));
  EXPECT_EQ(walker->Trail()[0].color, Color::red);
  EXPECT_EQ(walker->Trail()[1].color, Color::blue);
  EXPECT_EQ(walker->Trail()[0].time, 600000u);
}

TEST_F(Trails, AreTwentyItemsOfTenStepsEachByDefault) {
  Load("");
  Step(*world, 300);
  ASSERT_EQ(walker->Trail().size(), 20u);
  EXPECT_EQ(walker->Trail().front().time, 11000000u);
  EXPECT_EQ(walker->Trail().back().time, 30000000u);
}

TEST_F(Trails, ZeroLengthDisablesAndZeroIntervalIsEveryStep) {
  Load("trail_length 0");
  Step(*world, 20);
  EXPECT_TRUE(walker->Trail().empty());
  Load("trail_length -5 trail_interval 1");
  Step(*world, 20);
  EXPECT_TRUE(walker->Trail().empty());
  Load("trail_length 2 trail_interval 0");
  Step(*world, 3);
  EXPECT_EQ(walker->XAlongTrail(), Xs({0.2, 0.3}));
}

TEST_F(Trails, AreRecordedOnlyWhenAskedForAndOfRunningPositions) {
  Load("trail_interval 1");
  world->RecordTrails(false);
  Step(*world, 5);
  EXPECT_TRUE(walker->Trail().empty());
  world->RecordTrails(true);
  walker->Unsubscribe();
  Step(*world, 5);
  EXPECT_TRUE(walker->Trail().empty());
  walker->UpdateTrail();
  EXPECT_EQ(walker->Trail().size(), 1u);
}

// ---- windows ------------------------------------------------------------------------------------

class Picture : public Visualizer {
 public:
  Picture() : Visualizer("My data", "show_my_data") {}
  void Visualize(Model*, Camera*) override {}
};

/// A world that claims to have a window and exposes its options.
class WorldWithWindow : public World {
 public:
  using World::option_table;
  using World::ray_list;
  bool IsGUI() const override { return true; }
  void OfferVisualizer(Visualizer* visualizer, bool on) override {
    offered = visualizer;
    offered_on = on;
  }
  void PushColor(Color color) override { colors.push_back(color); }
  void PushColor(double r, double g, double b, double a) override {
    colors.push_back(Color(r, g, b, a));
  }
  void PopColor() override { colors.pop_back(); }
  void Redraw(void) override { redrawn++; }

  Visualizer* offered = nullptr;
  bool offered_on = false;
  std::vector<Color> colors;
  int redrawn = 0;
};

class OpenModel : public Model {
 public:
  explicit OpenModel(World* world_) : Model(world_) {}
  using Model::cv_list;
  using Model::RegisterOption;
};

TEST(Visualizers, AreIgnoredWithoutAWindow) {
  const auto world = EmptyWorld();
  OpenModel model(world.get());
  Picture picture;
  model.AddVisualizer(&picture, true);
  EXPECT_TRUE(model.cv_list.empty());
  model.RemoveVisualizer(&picture);
  model.PushColor(Color::red);
  model.PushColor(1, 0, 0, 1);
  model.PopColor();
  model.NeedRedraw();
  model.Redraw();
  world->RecordRay(0, 0, 1, 1);
  world->ClearRays();
  EXPECT_EQ(picture.GetMenuName(), "My data");
  EXPECT_EQ(picture.GetWorldfileName(), "show_my_data");
}

TEST(Visualizers, AreListedWithOne) {
  InitLibrary();
  WorldWithWindow world;
  OpenModel model(&world);
  Picture picture;
  model.AddVisualizer(nullptr, true);
  EXPECT_TRUE(model.cv_list.empty());
  model.AddVisualizer(&picture, true);
  EXPECT_EQ(model.cv_list, std::vector<Visualizer*>{&picture});
  EXPECT_EQ(world.offered, &picture);
  EXPECT_TRUE(world.offered_on);
  model.RemoveVisualizer(&picture);
  EXPECT_TRUE(model.cv_list.empty());
}

TEST(Visualizers, ColoursOptionsAndRaysGoToTheWorld) {
  InitLibrary();
  WorldWithWindow world;
  OpenModel model(&world);
  model.PushColor(Color::green);
  model.PushColor(0, 0, 1, 0.5);
  EXPECT_EQ(world.colors, (std::vector<Color>{Color::green, Color(0, 0, 1, 0.5)}));
  model.PopColor();
  EXPECT_EQ(world.colors.size(), 1u);
  model.Redraw();
  EXPECT_EQ(world.redrawn, 1);

  char anything;
  Option* option = reinterpret_cast<Option*>(&anything);
  model.RegisterOption(option);
  model.RegisterOption(option);
  EXPECT_EQ(world.option_table, std::vector<Option*>{option});

  world.RecordRay(1, 2, 3, 4);
  ASSERT_EQ(world.ray_list.size(), 1u);
  EXPECT_EQ(world.ray_list[0].y2, 4);
  world.ClearRays();
  EXPECT_TRUE(world.ray_list.empty());
}

// ---- the log ------------------------------------------------------------------------------------

TEST(Log, RemembersWhereModelsWere) {
  LogEntry::Clear();
  std::string expected;
  {
    const auto world = LoadText("model( name \"m\" pose [1 2 0 90] )");
    Model* m = Find(*world, "m");
    world->Log(m);
    Step(*world, 3);
    m->SetPose(Pose(-1, 0.5, 0, 0));
    world->Log(m);
    world->Log(nullptr);
    expected = "0.000\t" + std::to_string(m->GetId()) + "\t[ 1.000 2.000 0.000 1.571 ]\n0.300\t" +
               std::to_string(m->GetId()) + "\t[ -1.000 0.500 0.000 0.000 ]\n";
  }
  EXPECT_EQ(LogEntry::Count(), 2u);
  EXPECT_EQ(LogEntry::log.size(), 2u);
  EXPECT_EQ(OutputOf(LogEntry::Print), expected);
  LogEntry::Clear();
  EXPECT_EQ(LogEntry::Count(), 0u);
}

// ---- names, numbers, words ----------------------------------------------------------------------

TEST(Log, EachWorldHasItsOwn) {
  LogEntry::Clear();
  RunOptions alone;
  alone.listed = false;
  World a(alone), b(alone), listed;
  for (World* world : {&a, &b, &listed}) TryToLoad(world, "model( name \"m\" )");
  a.Log(Find(a, "m"));
  a.Log(Find(a, "m"));
  listed.Log(Find(listed, "m"));
  EXPECT_EQ(a.log().size(), 2u);
  EXPECT_EQ(b.log().size(), 0u);
  EXPECT_EQ(listed.log().size(), 1u);
  EXPECT_EQ(LogEntry::Count(), 1u);
  a.UnLoad();
  EXPECT_EQ(a.log().size(), 0u);
  LogEntry::Clear();
}

TEST(ModelNumbers, FindModels) {
  const auto a = LoadText("model( name \"m\" )"), b = LoadText("model( name \"m\" )");
  Model *in_a = Find(*a, "m"), *in_b = Find(*b, "m");
  const uint32_t id = in_a->GetId();
  EXPECT_EQ(id, in_b->GetId());
  EXPECT_EQ(a->FindModel(id), in_a);
  EXPECT_EQ(b->FindModel(id), in_b);
  EXPECT_EQ(Model::LookupId(id), in_a) << "the older world's";
  delete in_a;
  EXPECT_EQ(a->FindModel(id), nullptr);
  EXPECT_EQ(Model::LookupId(id), in_b);
  delete in_b;
  EXPECT_EQ(Model::LookupId(id), nullptr);
  EXPECT_EQ(Model::LookupId(0xffffffff), nullptr);
}

TEST(ModelPrint, NamesItsTree) {
  const auto world = LoadText("name \"w\" model( name \"m\" pose [1 2 0 0] model( name \"n\" ) )");
  Model* m = Find(*world, "m");
  char prefix[] = "here:";
  EXPECT_EQ(OutputOf([&] { m->Print(prefix); }), "here: model w:m\nhere: model w:m.n\n");
  EXPECT_EQ(OutputOf([&] { m->Print(nullptr); }), "Model w:m\nModel w:m.n\n");
  EXPECT_STREQ(m->PrintWithPose(), "m @ [1.00,2.00,0.00,0.00]");
  EXPECT_STREQ(Find(*world, "m.n")->PrintWithPose(), "m.n @ [1.00,2.00,1.00,0.00]");
}

TEST(Speech, IsSetByTheFileOrACall) {
  const auto world = LoadText("model( name \"m\" say \"hello\" )");
  Model* m = Find(*world, "m");
  EXPECT_EQ(m->GetSayString(), "hello");
  m->Say("bye");
  EXPECT_EQ(m->GetSayString(), "bye");
  m->Say("");
  EXPECT_EQ(m->GetSayString(), "");
}

TEST(Properties, AreUntypedPointers) {
  const auto world = LoadText("model( name \"m\" )");
  Model* m = Find(*world, "m");
  std::string key = "key";
  int value = 0;
  EXPECT_EQ(m->GetProperty(key), nullptr);
  m->SetProperty(key, &value);
  EXPECT_EQ(m->GetProperty(key), &value);
  EXPECT_EQ(world->GetProperty(key), nullptr);
}

// ---- cameras ------------------------------------------------------------------------------------

TEST(Cameras, AreMadeWithoutAWindow) {
  const PerspectiveCamera perspective;
  EXPECT_EQ(perspective.pitch(), 70);
  EXPECT_EQ(perspective.horizFov(), 70);
  EXPECT_EQ(perspective.vertFov(), 70);
  EXPECT_EQ(perspective.nearClip(), 0.2);
  EXPECT_EQ(perspective.farClip(), 40);
  EXPECT_NEAR(perspective.realDistance(0), 0.2, 1e-12);
  EXPECT_NEAR(perspective.realDistance(1), 40, 1e-9);
  const std::unique_ptr<Camera> flat(new OrthoCamera());
  EXPECT_EQ(flat->pitch() + flat->yaw() + flat->x() + flat->y() + flat->z(), 0);
  EXPECT_EQ(static_cast<OrthoCamera*>(flat.get())->scale(), 15);
}

TEST(Cameras, KeepWithinTheirLimits) {
  PerspectiveCamera perspective;
  perspective.addPitch(500);
  EXPECT_EQ(perspective.pitch(), 180);
  perspective.addPitch(-500);
  EXPECT_EQ(perspective.pitch(), 0);
  perspective.addPose(1, 2, -5);
  EXPECT_EQ(perspective.z(), 0.1);
  perspective.reset();
  EXPECT_EQ(perspective.pitch(), 70);
  OrthoCamera flat;
  flat.addPitch(500);
  EXPECT_EQ(flat.pitch(), 90);
  flat.addPitch(-500);
  EXPECT_EQ(flat.pitch(), 0);
}

}  // namespace
}  // namespace Stg
