// SPDX-License-Identifier: GPL-2.0-or-later
//
// The fiducial finder: which models it finds, and what it tells of them.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "model_testing.hh"
#include "support/crowd.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using Fiducial = ModelFiducial::Fiducial;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

std::string Number(double value) {
  char text[400];
  std::snprintf(text, sizeof text, "%.17f", value);
  return text;
}

/// A post of half a metre's height.
std::string Target(const std::string& name, double x, double y, const std::string& more) {
  return "model( name \"" + name + "\" pose [" + Number(x) + " " + Number(y) +
         " 0 0] size [0.2 0.2 0.5] " + more + " )\n";
}

/// A world with a finder "f" at the origin, subscribed.
struct Scene {
  explicit Scene(const std::string& rest, const std::string& properties = "")
      : world(LoadText("fiducial( name \"f\" " + properties + " )\n" + rest)),
        finder(FindRunning<ModelFiducial>(*world, "f")) {}
  const std::vector<Fiducial>& Found() {
    Step(*world);
    return finder->GetFiducials();
  }
  std::vector<int> Ids() {
    std::vector<int> ids;
    for (const Fiducial& f : Found()) ids.push_back(f.id);
    return ids;
  }
  std::unique_ptr<World> world;
  ModelFiducial* finder;
};

using Ids = std::vector<int>;

// ---- what Stage reports -------------------------------------------------------------------------

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

// Stage reports the first at 1.0.
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

TEST(Finder, TheOtherWayToGetFiducials) {
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

TEST(Finder, ForgetsAtShutdownForGood) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->Unsubscribe();
  EXPECT_TRUE(scene.finder->GetFiducials().empty());
  EXPECT_EQ(scene.Ids(), Ids{});
  scene.finder->Subscribe();
  EXPECT_EQ(scene.Ids(), Ids{1});
}

TEST(Finder, RaysOnTheirWayAreForgottenAtShutdown) {
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

// ---- who is found -------------------------------------------------------------------------------

TEST(Found, OnlyThoseWithAReturn) {
  Scene scene(Target("a", 1, 0, "") + Target("b", 0, 1, "fiducial_return 0") +
              Target("c", 0, -1, "fiducial_return 5"));
  EXPECT_EQ(scene.Ids(), Ids{5});
}

TEST(Found, TheReturnCanBeChangedAtRunTime) {
  Scene scene(Target("a", 1, 0, ""));
  Model* a = Find(*scene.world, "a");
  EXPECT_EQ(scene.Ids(), Ids{});
  a->SetFiducialReturn(12);
  EXPECT_EQ(a->GetFiducialReturn(), 12);
  EXPECT_EQ(scene.Ids(), Ids{12});
  a->vis.fiducial_return = -3;
  EXPECT_EQ(scene.Ids(), Ids{-3});
  a->vis.fiducial_return = 0;
  EXPECT_EQ(scene.Ids(), Ids{});
  a->vis.fiducial_return = 4;
  EXPECT_EQ(scene.Ids(), Ids{4});
  a->SetFiducialReturn(0);
  EXPECT_EQ(scene.Ids(), Ids{});
}

TEST(Found, KeysHaveToMatch) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1") +
              Target("b", 0, 1, "fiducial_return 2 fiducial_key 3"));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->key = 3;  // no effect
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->SetFiducialKey(3);
  EXPECT_EQ(scene.Ids(), Ids{2});
  Find(*scene.world, "a")->SetFiducialKey(3);
  EXPECT_EQ(scene.Ids(), (Ids{1, 2}));
}

TEST(Found, NotTheOwnTree) {
  const auto world = LoadText(
      "position( name \"r\" size [0.2 0.2 0.2] fiducial_return 1 model( pose [0.5 0 -0.2 0]"
      " size [0.1 0.5 1] fiducial_return 2 ) fiducial( name \"f\" alwayson 1 ) )\n" +
      Target("a", 2, 0, "fiducial_return 3"));
  Step(*world);
  const std::vector<Fiducial>& found = Find<ModelFiducial>(*world, "r.f")->GetFiducials();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 3);
}

TEST(Found, NotTheOwnTreeEvenWhereNothingIsHit) {
  const auto world = LoadText(
      "model( name \"r\" noblocks 1 fiducial_return 1 model( pose [1 0 0 0] noblocks 1"
      " fiducial_return 2 ) fiducial( name \"f\" ignore_zloc 1 alwayson 1 ) )\n"
      "model( pose [0 1 0 0] noblocks 1 fiducial_return 3 )");
  Step(*world);
  const std::vector<Fiducial>& found = Find<ModelFiducial>(*world, "r.f")->GetFiducials();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 3);
}

TEST(Found, ChildrenOfOthersToo) {
  Scene scene(
      "model( name \"a\" pose [3 0 0 180] size [1 1 1] noblocks 1 stack_children 0"
      " model( pose [1 0.5 0 90] size [0.2 0.2 1] fiducial_return 3 ) )");
  ASSERT_EQ(scene.Found().size(), 1u);
  const Fiducial& f = scene.finder->GetFiducials()[0];
  ExpectPose(f.pose, 2, -0.5, 0, -M_PI / 2);
  EXPECT_NEAR(f.range, std::hypot(2, 0.5), 1e-12);
}

TEST(Found, InTheOrderOfCreation) {
  std::string text;
  const int n = 40;
  for (int i = 1; i <= n; i++) {
    const double angle = 2 * M_PI * (i * 17 % n) / n;
    text += Target("t" + std::to_string(i), 3 * std::cos(angle), 3 * std::sin(angle),
                   "fiducial_return " + std::to_string(i));
  }
  Scene scene(text, "fov 360");
  Ids expected;
  for (int i = 1; i <= n; i++) expected.push_back(i);
  EXPECT_EQ(scene.Ids(), expected);
  // Also after a new start, with addresses used again.
  delete Find(*scene.world, "t20");
  delete Find(*scene.world, "t3");
  Model* late = scene.world->CreateModel(nullptr, "model");
  late->SetGeom(Geom(Pose(), Size(0.1, 0.1, 0.5)));
  late->SetPose(Pose(0.5, 0.02, 0, 0));
  late->SetFiducialReturn(99);
  std::erase(expected, 20);
  std::erase(expected, 3);
  Ids ids = scene.Ids();
  ASSERT_FALSE(ids.empty());
  EXPECT_EQ(ids.back(), 99);
  EXPECT_TRUE(std::is_sorted(ids.begin(), ids.end()));
}

TEST(Found, WithinTheRange) {
  Scene scene(Target("a", 3, 4, "fiducial_return 1"));
  scene.finder->max_range_anon = 5;  // exclusive
  EXPECT_EQ(scene.Ids(), Ids{});
  scene.finder->max_range_anon = std::nextafter(5.0, 6.0);
  EXPECT_EQ(scene.Found().size(), 1u);
  for (const double none : {0.0, -1.0, kNaN}) {
    scene.finder->max_range_anon = none;
    EXPECT_EQ(scene.Ids(), Ids{}) << none;
  }
  scene.finder->max_range_anon = kInfinity;
  EXPECT_EQ(scene.Found().size(), 1u);
}

TEST(Found, IdsAreReadNearBy) {
  Scene scene(Target("a", 3, 4, "fiducial_return 7"));
  EXPECT_EQ(scene.Ids(), Ids{0});  // 5 metres, exclusive
  scene.finder->max_range_id = std::nextafter(5.0, 6.0);
  EXPECT_EQ(scene.Ids(), Ids{7});
  scene.finder->max_range_id = -1;
  EXPECT_EQ(scene.Ids(), Ids{0});
  Find(*scene.world, "a")->SetFiducialReturn(-7);
  EXPECT_EQ(scene.Ids(), Ids{0});
  scene.finder->max_range_id = 6;
  EXPECT_EQ(scene.Ids(), Ids{-7});
}

TEST(Found, InTheFieldOfView) {
  Scene scene(Target("a", 2, 2, "fiducial_return 1") + Target("b", 2, -2, "fiducial_return 2") +
              Target("c", -2, 0, "fiducial_return 3") + Target("d", -2, 2, "fiducial_return 4"));
  const auto ids = [&](double fov) {
    scene.finder->fov = fov;
    return scene.Ids();
  };
  EXPECT_EQ(ids(M_PI), (Ids{1, 2}));
  EXPECT_EQ(ids(M_PI / 2), (Ids{1, 2}));  // both ends included
  EXPECT_EQ(ids(std::nextafter(M_PI / 2, 0.0)), Ids{});
  EXPECT_EQ(ids(dtor(271)), (Ids{1, 2, 4}));
  EXPECT_EQ(ids(2 * M_PI), (Ids{1, 2, 3, 4}));
  EXPECT_EQ(ids(100), (Ids{1, 2, 3, 4}));
  EXPECT_EQ(ids(0), Ids{});
  EXPECT_EQ(ids(-1), Ids{});
  EXPECT_EQ(ids(kNaN), Ids{});
  scene.finder->SetPose(Pose(0, 0, 0, 3 * M_PI / 4));
  EXPECT_EQ(ids(1), Ids{4});
  scene.finder->heading = 1;  // no effect
  EXPECT_EQ(ids(1), Ids{4});
}

// ---- what is told of them -----------------------------------------------------------------------

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

TEST(Report, NearerThanTheMinimumIsAtTheMinimum) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1") + Target("b", 0, 2, "fiducial_return 2"),
              "range_min 1.5 range_max_id 1.2");
  ASSERT_EQ(scene.Found().size(), 2u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].range, 1.5);
  EXPECT_EQ(scene.finder->GetFiducials()[0].id, 1);  // the id goes by the true distance
  EXPECT_EQ(scene.finder->GetFiducials()[0].bearing, 0);
  EXPECT_EQ(scene.finder->GetFiducials()[1].range, 2);
  for (const double none : {-1.0, kNaN}) {
    scene.finder->min_range = none;
    EXPECT_EQ(scene.Found().at(0).range, 1);
  }
}

// Body offsets play no part, except that rays leave the finder's.
TEST(Report, GoesByOrigins) {
  Scene scene("model( pose [2 0 0 0] origin [0 0.05 0 45] size [0.5 0.5 0.5] fiducial_return 1 )",
              "origin [0.3 0 0 0]");
  ASSERT_EQ(scene.Found().size(), 1u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].range, 2);
  EXPECT_EQ(scene.finder->GetFiducials()[0].bearing, 0);
  EXPECT_EQ(scene.finder->GetFiducials()[0].geom.a, 0);
  // A post at the origin's offset that the ray would meet if it began at the finder itself.
  Scene post(
      Target("a", 2, 0, "fiducial_return 1") + "model( pose [0.15 0 0 0] size [0.05 0.05 1] )",
      "origin [0.3 0 0 0]");
  EXPECT_EQ(post.Ids(), Ids{1});
}

// Positions move after sensing: what is told is where they were at the start of the step.
TEST(Report, IsOfTheStartOfTheStep) {
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

// ---- the line of sight --------------------------------------------------------------------------

TEST(Sight, AnyBodyAtThatHeightBlocksIt) {
  const std::string target = Target("a", 3, 0, "fiducial_return 1");
  EXPECT_EQ(Scene(target).Ids(), Ids{1});
  EXPECT_EQ(Scene(target + "model( pose [2 0 0 0] size [0.1 0.1 1] obstacle_return 0"
                           " ranger_return -1 blob_return 0 )")
                .Ids(),
            Ids{});
  EXPECT_EQ(Scene(target + "model( pose [2 0 0.5 0] size [0.1 0.1 1] )").Ids(), Ids{1});
  // Another target, with another key.
  EXPECT_EQ(Scene(target + Target("b", 2, 0, "fiducial_return 2 fiducial_key 1")).Ids(), Ids{});
}

TEST(Sight, ATargetsOwnChildHidesIt) {
  Scene scene(
      "model( name \"a\" pose [3 0 0 0] size [0.2 0.2 0.5] fiducial_return 1"
      " model( name \"c\" pose [-0.5 0 -0.5 0] size [0.1 0.4 0.5] ) )");
  EXPECT_EQ(scene.Ids(), Ids{});
  Find(*scene.world, "a.c")->SetPose(Pose(0.5, 0, -0.5, 0));
  EXPECT_EQ(scene.Ids(), Ids{1});
}

TEST(Sight, IsLevel) {
  Scene scene(Target("a", 3, 0, "fiducial_return 1"), "pose [0 0 0.6 0]");
  EXPECT_EQ(scene.Ids(), Ids{});
  scene.finder->SetPose(Pose(0, 0, 0.4, 0));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->SetPose(Pose(0, 0, 0.6, 0));
  scene.finder->ignore_zloc = true;
  EXPECT_EQ(scene.Ids(), Ids{1});
}

TEST(Sight, IgnoringHeightsWhatIsBehindStillMatters) {
  Scene scene("model( pose [3 0 0 0] noblocks 1 fiducial_return 1 )\n" +
                  std::string("model( name \"wall\" pose [6 0 0 0] size [0.1 1 1] )"),
              "ignore_zloc 1");
  EXPECT_EQ(scene.Ids(), Ids{});
  Find(*scene.world, "wall")->SetPose(Pose(20, 0, 0, 0));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->ignore_zloc = false;
  EXPECT_EQ(scene.Ids(), Ids{});
}

// Finders on robots look exactly along the upper edges of robots of the same kind.
TEST(Sight, EdgesOfHeightAreSeen) {
  test::RandomSource random(4);
  for (int i = 0; i < 100; i++) {
    const std::string z = Number(random.Real(-1, 1)), height = Number(random.Real(0.1, 1));
    const auto world = LoadText("define robot position( size [0.3 0.3 " + height +
                                "] fiducial_return 1 fiducial( name \"f\" alwayson 1 ) )\n"
                                "robot( name \"r\" pose [0 0 " +
                                z + " 0] )\nrobot( name \"s\" pose [2 0 " + z + " 180] )");
    Step(*world);
    ASSERT_EQ(Find<ModelFiducial>(*world, "r.f")->GetFiducials().size(), 1u) << z << " " << height;
    ASSERT_EQ(Find<ModelFiducial>(*world, "s.f")->GetFiducials().size(), 1u) << z << " " << height;
    Model* s = Find(*world, "s");
    s->AddToPose(0, 0, -0.001, 0);
    Step(*world);
    EXPECT_TRUE(Find<ModelFiducial>(*world, "r.f")->GetFiducials().empty());
    EXPECT_EQ(Find<ModelFiducial>(*world, "s.f")->GetFiducials().size(), 1u);
  }
}

TEST(Sight, ReachesToTheEndOfTheRange) {
  Scene scene(Target("a", 7.99, 0, "fiducial_return 1") +
              Target("b", 0, 7.95, "fiducial_return 2") +
              Target("c", 5.65, -5.65, "fiducial_return 3"));
  EXPECT_EQ(scene.Found().size(), 3u);
}

// ---- deletion -----------------------------------------------------------------------------------

int DeleteIt(Model*, void* model) {
  delete static_cast<Model*>(model);
  return 0;
}

const std::string kPair =
    Target("a", 1, 0, "fiducial_return 1") + Target("b", 0, 1, "fiducial_return 2");

TEST(Deletion, TakesTheEntryAway) {
  Scene scene(kPair);
  EXPECT_EQ(scene.Found().size(), 2u);
  delete Find(*scene.world, "a");
  ASSERT_EQ(scene.finder->GetFiducials().size(), 1u);
  EXPECT_EQ(scene.finder->GetFiducials()[0].mod, Find(*scene.world, "b"));
  EXPECT_EQ(scene.Ids(), Ids{2});
}

TEST(Deletion, TakesItAwayEvenIfItIsNoLongerATarget) {
  Scene scene(kPair, "update_interval 1000");
  Step(*scene.world, 10);
  EXPECT_EQ(scene.finder->GetFiducials().size(), 2u);
  Find(*scene.world, "a")->SetFiducialReturn(0);
  Step(*scene.world);
  EXPECT_EQ(scene.finder->GetFiducials().size(), 2u);
  delete Find(*scene.world, "a");
  EXPECT_EQ(scene.finder->GetFiducials().size(), 1u);
}

TEST(Deletion, WhileRaysAreOnTheirWay) {
  for (const bool batch : {true, false})
    for (const char* properties : {"", "ignore_zloc 1"}) {
      World::run_options.batch = batch;
      // Before and after the finder's update: events are served in the order of their making.
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

// The second finder must not find what was deleted between the two.
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

TEST(Deletion, OfTheFinderWhileItsRaysAreOnTheirWay) {
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

TEST(Tracing, ResultsDoNotDependOnHow) {
  const auto robot = [](int i) {
    return "position( fiducial_return " + std::to_string(i + 1) + " pose [" +
           std::to_string(i % 8 * 2.3) + " " + std::to_string(i / 8 * 2.1) + " 0 " +
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
  EXPECT_GT(outcome.rays, outcome.sensed.size() / 7);  // rays to those that are hidden
  EXPECT_LT(outcome.rays, 60u * 59 * 10 / 4);          // but only to those that are near and ahead
}

TEST(Tracing, TheStateHashCoversWhatWasFound) {
  Scene scene(Target("a", 1, 0, "fiducial_return 1"));
  Step(*scene.world);
  const uint64_t hash = scene.world->StateHash();
  scene.finder->GetFiducials()[0].id = 2;
  EXPECT_NE(scene.world->StateHash(), hash);
}

}  // namespace
}  // namespace Stg
