// SPDX-License-Identifier: GPL-2.0-or-later
//
// The fiducial finder: the models that it finds and the reported values.

#include <algorithm>
#include <cmath>

#include "fiducial_testing.hh"
#include "support/crowd.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

// ---- targets as in Stage 4.3 --------------------------------------------------------------------

std::string ReferenceWorld(const std::string& properties) {
  return "define target model( size [0.2 0.2 0.5] )\n"
         "position( name \"r\" size [0.3 0.3 0.22] fiducial_return 77 fiducial( name \"f\" " +
         properties +
         " ) )\n"
         "target( pose [1 0 0 90] fiducial_return 3 )\n"
         "target( pose [2 0 0 0] fiducial_return 4 )\n"
         "target( pose [6 2 0 10] fiducial_return 5 )\n"
         "target( pose [2 1.5 0 10] fiducial_return -6 )\n"
         "target( pose [2 -1.5 0 10] size [0.2 0.2 0.1] fiducial_return 7 )\n"
         "target( pose [2 -1 0 10] fiducial_return 8"
         " model( pose [0 0 -0.5 0] size [0.4 0.4 0.5] ) )\n"
         "model( pose [1 1.8 0 0] size [0.1 0.1 0.5] ranger_return -1 obstacle_return 0"
         " blob_return 0 )\n"
         "target( pose [2 3.6 0 0] fiducial_return 9 )\n"
         "target( pose [2 -0.5 0 0] fiducial_return 10 fiducial_key 2 )\n"
         "target( pose [-2 0 0 0] fiducial_return 11 )\n";
}

struct Expected {
  int id;
  double range, bearing, heading;
};
void ExpectReference(const std::string& properties, const std::vector<Expected>& expected) {
  const auto world = LoadText(ReferenceWorld(properties));
  ModelFiducial* finder = FindRunning<ModelFiducial>(*world, "r.f");
  Step(*world);
  const std::vector<Fiducial>& found = finder->GetFiducials();
  ASSERT_EQ(found.size(), expected.size()) << properties;
  for (size_t i = 0; i < found.size(); i++) {
    const Expected& e = expected[i];
    EXPECT_EQ(found[i].id, e.id) << i;
    EXPECT_NEAR(found[i].range, e.range, 1e-4) << i;
    EXPECT_NEAR(found[i].bearing, e.bearing, 1e-4) << i;
    EXPECT_NEAR(found[i].geom.a, e.heading, 1e-3) << i;
    EXPECT_EQ(found[i].geom.x, 0.2) << i;
    EXPECT_EQ(found[i].geom.y, 0.2) << i;
  }
}

const double kTen = dtor(10);

TEST(Reference, Defaults) {
  ExpectReference("", {{3, 1.0, 0, 1.571}, {0, 6.3246, 0.3218, kTen}, {-6, 2.5, 0.6435, kTen}});
}

// Stage 4.3 reports the first fiducial at a range of 1.0.
TEST(Reference, MinimumRange) {
  ExpectReference("range_min 1.5",
                  {{3, 1.5, 0, 1.571}, {0, 6.3246, 0.3218, kTen}, {-6, 2.5, 0.6435, kTen}});
}

TEST(Reference, WithoutHeights) {
  ExpectReference("ignore_zloc 1 range_max 3",
                  {{3, 1.0, 0, 1.571}, {-6, 2.5, 0.6435, kTen}, {7, 2.5, -0.6435, kTen}});
}

TEST(Reference, AnotherKey) {
  ExpectReference("fiducial_key 2 fov 360", {{10, 2.0616, -0.2450, 0}});
}

// ---- the model ----------------------------------------------------------------------------------

TEST(Finder, DefaultsAreThoseOfStage) {
  const auto world = LoadText("fiducial( name \"f\" )");
  ModelFiducial* finder = Find<ModelFiducial>(*world, "f");
  EXPECT_EQ(finder->max_range_anon, 8);
  EXPECT_EQ(finder->max_range_id, 5);
  EXPECT_EQ(finder->min_range, 0);
  EXPECT_EQ(finder->fov, M_PI);
  EXPECT_EQ(finder->heading, 0);
  EXPECT_EQ(finder->key, 0);
  EXPECT_FALSE(finder->ignore_zloc);
  EXPECT_TRUE(finder->GetFiducials().empty());
  const Geom geom = finder->GetGeom();
  EXPECT_EQ(geom.size.x, 0);
  EXPECT_EQ(geom.size.y, 0);
  EXPECT_EQ(geom.size.z, 0);
  EXPECT_TRUE(geom.pose.IsZero());
}

TEST(Finder, PropertiesAreRead) {
  const auto world = LoadText(
      "unit_length \"mm\"\nunit_angle \"radians\"\n"
      "fiducial( name \"f\" range_min 250 range_max 3500 range_max_id 1500 fov 1.5"
      " ignore_zloc 1 fiducial_key 4 )");
  const ModelFiducial* finder = Find<ModelFiducial>(*world, "f");
  EXPECT_DOUBLE_EQ(finder->min_range, 0.25);
  EXPECT_DOUBLE_EQ(finder->max_range_anon, 3.5);
  EXPECT_DOUBLE_EQ(finder->max_range_id, 1.5);
  EXPECT_EQ(finder->fov, 1.5);
  EXPECT_TRUE(finder->ignore_zloc);
  EXPECT_EQ(finder->vis.fiducial_key, 4);
  EXPECT_EQ(finder->key, 0);
}

TEST(Finder, WorldFilesAreRefused) {
  for (const char* property :
       {"range_max -1", "range_max \"inf\"", "range_max_id \"nan\"", "fov \"nan\""}) {
    const LoadOutcome outcome = TryToLoad("fiducial( " + std::string(property) + " )");
    EXPECT_FALSE(outcome.loaded) << property;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:", 0), 0u) << outcome.errors;
  }
  EXPECT_NE(TryToLoad("fiducial( range 3 )").errors.find("\"range\" is never read"),
            std::string::npos);
}

TEST(Finder, GetFiducialsWithCountReturnsTheSame) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1") + Target("b", 0, 1, "fiducial_return 2"));
  unsigned int count = 7;
  scene.finder->GetFiducials(&count);
  EXPECT_EQ(count, 0u);
  Step(*scene.world);
  const Fiducial* found = scene.finder->GetFiducials(&count);
  ASSERT_EQ(count, 2u);
  EXPECT_EQ(found[0].id, 1);
  EXPECT_EQ(found[1].id, 2);
  EXPECT_EQ(scene.finder->GetFiducials(nullptr), found);
}

TEST(Finder, FindsNothingWithoutSubscribers) {
  const auto world = LoadText("fiducial( name \"f\" )\n" + Target("a", 1, 0, "fiducial_return 1"));
  Step(*world, 3);
  EXPECT_TRUE(Find<ModelFiducial>(*world, "f")->GetFiducials().empty());
  EXPECT_EQ(world->statistics().trace.rays, 0u);
}

TEST(Finder, DropsItsListAtShutdown) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->Unsubscribe();
  EXPECT_TRUE(scene.finder->GetFiducials().empty());
  EXPECT_EQ(scene.Ids(), Ids{});
  scene.finder->Subscribe();
  EXPECT_EQ(scene.Ids(), Ids{1});
}

TEST(Finder, DropsPendingRaysAtShutdown) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  scene.world->Enqueue(
      0, 100000, scene.finder, [](Model* m, void*) { return m->Unsubscribe(), 0; }, nullptr);
  EXPECT_EQ(scene.Ids(), Ids{});
}

TEST(Finder, KeepsTheListBetweenUpdates) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"), "update_interval 300");
  EXPECT_EQ(scene.Ids(), Ids{});
  EXPECT_EQ(scene.Ids(), Ids{});
  EXPECT_EQ(scene.Ids(), Ids{1});
  Find(*scene.world, "a")->SetFiducialReturn(2);
  EXPECT_EQ(scene.Ids(), Ids{1});
  EXPECT_EQ(scene.Ids(), Ids{1});
  EXPECT_EQ(scene.Ids(), Ids{2});
}

TEST(Finder, CallbacksSeeTheNewList) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  size_t seen = 0;
  scene.finder->AddCallback(
      Model::CB_UPDATE,
      [](Model* m, void* user) {
        *static_cast<size_t*>(user) = static_cast<ModelFiducial*>(m)->GetFiducials().size();
        return 0;
      },
      &seen);
  Step(*scene.world);
  EXPECT_EQ(seen, 1u);
}

// ---- reported data ------------------------------------------------------------------------------

TEST(Report, IsExact) {
  test::RandomSource random(3);
  for (int i = 0; i < 200; i++) {
    Scene scene(Target("a", random.Real(-3, 3), random.Real(-3, 3), "fiducial_return 1"),
                "fov 360 range_max 20 range_max_id 20");
    Model* a = Find(*scene.world, "a");
    a->SetPose(Pose(a->GetPose().x, a->GetPose().y, 0, random.Real(-4, 4)));
    scene.finder->SetPose(Pose(random.Real(-4, 4), random.Real(-4, 4), 0.1, random.Real(-4, 4)));
    const Pose t = a->GetPose(), f = scene.finder->GetPose();
    ASSERT_EQ(scene.Found().size(), 1u);
    const Fiducial& found = scene.finder->GetFiducials()[0];
    EXPECT_NEAR(found.range, t.Distance(f), 1e-14);
    EXPECT_NEAR(normalize(found.bearing - (std::atan2(t.y - f.y, t.x - f.x) - f.a)), 0, 1e-14);
    EXPECT_GE(found.bearing, -M_PI);
    EXPECT_LE(found.bearing, M_PI);
    EXPECT_EQ(found.geom.a, normalize(t.a - f.a));
    EXPECT_EQ(found.geom.x, 0.2);
    EXPECT_EQ(found.geom.y, 0.2);
    EXPECT_EQ(found.geom.z, 0.5);
    EXPECT_EQ(found.pose, t);
    EXPECT_EQ(found.mod, a);
  }
}

TEST(Report, RangesBelowTheMinimumReadTheMinimum) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1") + Target("b", 0, 2, "fiducial_return 2"),
              "range_min 1.5 range_max_id 1.2");
  ASSERT_EQ(scene.Found().size(), 2u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].range, 1.5);
  EXPECT_EQ(scene.finder->GetFiducials()[0].id, 1);  // the true distance decides on the id
  EXPECT_EQ(scene.finder->GetFiducials()[0].bearing, 0);
  EXPECT_EQ(scene.finder->GetFiducials()[1].range, 2);
  for (const double none : {-1.0, kNaN}) {
    scene.finder->min_range = none;
    EXPECT_EQ(scene.Found().at(0).range, 1);
  }
}

// Origins of bodies are ignored, except that rays start at that of the finder.
TEST(Report, UsesPosesNotBodyOffsets) {
  Scene scene("model( pose [2 0 0 0] origin [0 0.05 0 45] size [0.5 0.5 0.5] fiducial_return 1 )",
              "origin [0.3 0 0 0]");
  ASSERT_EQ(scene.Found().size(), 1u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].range, 2);
  EXPECT_EQ(scene.finder->GetFiducials()[0].bearing, 0);
  EXPECT_EQ(scene.finder->GetFiducials()[0].geom.a, 0);
  // A post is where the ray would hit it if it started at the finder's own pose.
  Scene post(
      Target("a", 2, 0, "fiducial_return 1") + "model( pose [0.15 0 0 0] size [0.05 0.05 1] )",
      "origin [0.3 0 0 0]");
  EXPECT_EQ(post.Ids(), Ids{1});
}

// Position models move after sensing, so reports have their poses at the start of the step.
TEST(Report, HasThePosesAtTheStartOfTheStep) {
  Scene scene("position( name \"p\" pose [2 0 0 0] size [0.2 0.2 0.5] fiducial_return 1 )",
              "fov 360");
  ModelPosition* target = FindRunning<ModelPosition>(*scene.world, "p");
  target->SetSpeed(0.5, 0, 0.5);
  for (int i = 0; i < 20; i++) {
    const Pose before = target->GetPose();
    ASSERT_EQ(scene.Found().size(), 1u);
    EXPECT_EQ(scene.finder->GetFiducials()[0].pose, before);
    EXPECT_DOUBLE_EQ(scene.finder->GetFiducials()[0].range, before.Distance(Pose()));
    if (i > 0) {
      EXPECT_NE(target->GetPose(), before);
    }
  }
}

// ---- deletion -----------------------------------------------------------------------------------

int DeleteIt(Model*, void* model) {
  delete static_cast<Model*>(model);
  return 0;
}

const std::string kPair =
    Target("a", 1, 0, "fiducial_return 1") + Target("b", 0, 1, "fiducial_return 2");

TEST(Deletion, RemovesTheEntry) {
  Scene scene(kPair);
  EXPECT_EQ(scene.Found().size(), 2u);
  delete Find(*scene.world, "a");
  ASSERT_EQ(scene.finder->GetFiducials().size(), 1u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].mod, Find(*scene.world, "b"));
  EXPECT_EQ(scene.Ids(), Ids{2});
}

TEST(Deletion, RemovesTheEntryOfAFormerTarget) {
  Scene scene(kPair, "update_interval 1000");
  Step(*scene.world, 10);
  EXPECT_EQ(scene.finder->GetFiducials().size(), 2u);
  Find(*scene.world, "a")->SetFiducialReturn(0);
  Step(*scene.world);
  EXPECT_EQ(scene.finder->GetFiducials().size(), 2u);
  delete Find(*scene.world, "a");
  EXPECT_EQ(scene.finder->GetFiducials().size(), 1u);
}

TEST(Deletion, WithPendingRays) {
  for (const bool batch : {true, false})
    for (const char* properties : {"", "ignore_zloc 1"}) {
      World::run_options.batch = batch;
      // Delete it before or after the finder's update; events are handled in the order of creation.
      Scene after(kPair, properties);
      after.world->Enqueue(0, 100000, after.finder, DeleteIt, Find(*after.world, "a"));
      EXPECT_EQ(after.Ids(), Ids{2});
      EXPECT_EQ(after.Ids(), Ids{2});

      const auto world =
          LoadText("fiducial( name \"f\" " + std::string(properties) + " )\n" + kPair);
      ModelFiducial* finder = Find<ModelFiducial>(*world, "f");
      world->Enqueue(0, 100000, finder, DeleteIt, Find(*world, "a"));
      finder->Subscribe();
      Step(*world);
      ASSERT_EQ(finder->GetFiducials().size(), 1u);
      EXPECT_EQ(finder->GetFiducials()[0].id, 2);
    }
  World::run_options = RunOptions();
}

// The second finder must not find a model that was deleted between the updates of both.
TEST(Deletion, BetweenTwoFinders) {
  const auto world =
      LoadText("fiducial( name \"f\" )\nfiducial( name \"g\" ignore_zloc 1 )\n" + kPair);
  ModelFiducial* f = FindRunning<ModelFiducial>(*world, "f");
  world->Enqueue(0, 100000, f, DeleteIt, Find(*world, "b"));
  ModelFiducial* g = FindRunning<ModelFiducial>(*world, "g");
  Step(*world);
  EXPECT_EQ(f->GetFiducials().size(), 1u);
  EXPECT_EQ(g->GetFiducials().size(), 1u);
}

TEST(Deletion, OfAWholeTree) {
  const auto world = LoadText(
      "position( name \"r\" size [0.2 0.2 0.5] fiducial_return 1 model( size [0.1 0.1 0.2]"
      " pose [0 0 -0.2 0] fiducial_return 3 ) fiducial( name \"f\" pose [0 0 -0.4 0] alwayson 1 ) "
      ")\n"
      "position( name \"s\" size [0.2 0.2 0.5] pose [2 0 0 180] fiducial_return 2"
      " fiducial( name \"f\" pose [0 0 -0.4 0] alwayson 1 ) )");
  Step(*world);
  EXPECT_EQ(Find<ModelFiducial>(*world, "s.f")->GetFiducials().size(), 1u);
  delete Find(*world, "r");
  EXPECT_TRUE(Find<ModelFiducial>(*world, "s.f")->GetFiducials().empty());
  Step(*world, 2);
  EXPECT_TRUE(Find<ModelFiducial>(*world, "s.f")->GetFiducials().empty());
}

TEST(Deletion, OfTheFinderWithPendingRays) {
  Scene scene(kPair + "fiducial( name \"g\" alwayson 1 )");
  scene.world->Enqueue(0, 100000, Find(*scene.world, "a"), DeleteIt, scene.finder);
  Step(*scene.world);
  EXPECT_EQ(Find<ModelFiducial>(*scene.world, "g")->GetFiducials().size(), 2u);
  delete Find(*scene.world, "b");
  Step(*scene.world);
  EXPECT_EQ(Find<ModelFiducial>(*scene.world, "g")->GetFiducials().size(), 1u);
}

TEST(Deletion, OfEverything) {
  Scene scene(kPair);
  Step(*scene.world);
  scene.world->UnLoad();
  std::istringstream content("fiducial( name \"f\" alwayson 1 )\n" + kPair);
  ASSERT_TRUE(scene.world->Load(content, "t.world"));
  Step(*scene.world);
  EXPECT_EQ(Find<ModelFiducial>(*scene.world, "f")->GetFiducials().size(), 2u);
}

// ---- ways of tracing ----------------------------------------------------------------------------

TEST(Tracing, ResultsDoNotDependOnTheMethod) {
  const auto robot = [](int i) {
    const int column = i % 8, row = i / 8;
    return "position( fiducial_return " + std::to_string(i + 1) + " pose [" +
           std::to_string(column * 2.3) + " " + std::to_string(row * 2.1) + " 0 " +
           std::to_string(i * 77 % 360) +
           "] size [0.4 0.4 0.4] alwayson 1 fiducial( range_max 6 alwayson 1 ) )\n";
  };
  const auto look = [](const crowd::Robots& robots, std::vector<double>* all) {
    for (const ModelPosition* r : robots)
      for (const Fiducial& f : dynamic_cast<ModelFiducial*>(r->GetChildren()[0])->GetFiducials())
        for (const double value : {f.range, f.bearing, f.geom.a, f.pose.x, f.pose.y, f.pose.a,
                                   static_cast<double>(f.id)})
          all->push_back(value);
  };
  const crowd::Outcome outcome = crowd::ExpectSameHoweverItIsRun(
      {crowd::Repeat(60, robot), 10, 0.5,
       [](size_t i) { return 0.1 * (static_cast<double>(i % 7) - 3); }, look});
  EXPECT_GT(outcome.sensed.size(), 7u * 1200);
  EXPECT_GT(outcome.rays, outcome.sensed.size() / 7);  // rays also go to hidden models
  EXPECT_LT(outcome.rays, 60u * 59 * 10 / 4);          // but only to models in range and view
}

TEST(Tracing, StateHashCoversTheList) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  Step(*scene.world);
  const uint64_t hash = scene.world->StateHash();
  scene.finder->GetFiducials()[0].id = 2;
  EXPECT_NE(scene.world->StateHash(), hash);
}

}  // namespace
}  // namespace Stg
