// SPDX-License-Identifier: GPL-2.0-or-later
//
// The fiducial finder: the models that it finds.

#include <algorithm>
#include <cmath>

#include "fiducial_testing.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

// ---- visible targets ----------------------------------------------------------------------------

TEST(Found, OnlyModelsWithAReturn) {
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

TEST(Found, NotTheOwnTreeEvenIfNothingIsHit) {
  const auto world = LoadText(
      "model( name \"r\" noblocks 1 fiducial_return 1 model( pose [1 0 0 0] noblocks 1"
      " fiducial_return 2 ) fiducial( name \"f\" ignore_zloc 1 alwayson 1 ) )\n"
      "model( pose [0 1 0 0] noblocks 1 fiducial_return 3 )");
  Step(*world);
  const std::vector<Fiducial>& found = Find<ModelFiducial>(*world, "r.f")->GetFiducials();
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].id, 3);
}

TEST(Found, ChildrenOfOtherModels) {
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
  // The order must also hold if new models reuse addresses.
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

TEST(Sight, IgnoringHeightsStillTestsOcclusion) {
  Scene scene("model( pose [3 0 0 0] noblocks 1 fiducial_return 1 )\n" +
                  std::string("model( name \"wall\" pose [6 0 0 0] size [0.1 1 1] )"),
              "ignore_zloc 1");
  EXPECT_EQ(scene.Ids(), Ids{});
  Find(*scene.world, "wall")->SetPose(Pose(20, 0, 0, 0));
  EXPECT_EQ(scene.Ids(), Ids{1});
  scene.finder->ignore_zloc = false;
  EXPECT_EQ(scene.Ids(), Ids{});
}

// Finders on robots look exactly along the upper edges of robots of the same type.
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

}  // namespace
}  // namespace Stg
