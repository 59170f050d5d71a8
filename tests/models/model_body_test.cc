// SPDX-License-Identifier: GPL-2.0-or-later
//
// The bodies of models and their collisions.

#include <algorithm>
#include <cmath>
#include <limits>

#include "looking.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

// ---- bodies -------------------------------------------------------------------------------------

TEST(Body, TheDefaultOneFillsTheSize) {
  const auto world = LoadText("model( name \"a\" size [2 1 0.5] pose [1 0.5 0 0] )");
  ExpectExtent(*world, 0, 2, 0, 1, 0.25);
  const auto unsized = LoadText("model( name \"a\" )");
  ExpectExtent(*unsized, -0.2, 0.2, -0.2, 0.2, 0.9);
  EXPECT_EQ(Look(*unsized, -5, 0, 1.01, 0).mod, nullptr);
}

TEST(Body, BlocksAreStretchedToTheSizeTogether) {
  // Two blocks cover 0..4 by 0..2; the right half is lower.
  const auto world = LoadText(
      "model( name \"a\" size [2 4 1]\n"
      "  block( points 4 point[0] [0 0] point[1] [2 0] point[2] [2 2] point[3] [0 2] z [0 10] )\n"
      "  block( points 4 point[0] [2 0] point[1] [4 0] point[2] [4 2] point[3] [2 2] z [0 5] ) )");
  ExpectExtent(*world, -1, 1, -2, 2, 0.25);
  ExpectExtent(*world, -1, 0, -2, 2, 0.75);
}

TEST(Body, HeightsAreScaledNotShifted) {
  const auto world = LoadText(
      "model( name \"a\" size [1 1 3] block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 1]"
      " point[3] [0 1] z [2 4] ) )");
  EXPECT_FALSE(SeenAt(*world, 2.99));
  EXPECT_TRUE(SeenAt(*world, 3));
  EXPECT_TRUE(SeenAt(*world, 6));
  EXPECT_FALSE(SeenAt(*world, 6.01));
}

TEST(Body, OddPointListsAreHarmless) {
  const auto world = LoadText(
      "model( name \"a\" size [2 2 1] block( points 3 point[2] [0 4] point[0] [4 0] point[7] [9 9]"
      " z [0 1] ) )\n"  // the missing point is (0, 0)
      "model( name \"b\" block( ) ) model( name \"c\" block( points 1 point[0] [1 1] z [0 1] ) )\n"
      "model( name \"d\" block( points 0 z [0 1] ) )");
  EXPECT_NEAR(Look(*world, -5, -0.5, 0.5, 0).range, 4, 1.01 * kCell);
  EXPECT_NEAR(Look(*world, 5, -0.5, 0.5, M_PI).range, 4.5, 2.01 * kCell);
  for (const char* name : {"b", "c", "d"}) {
    Find(*world, name)->SetPose(Pose(0, 8, 0, 0));
    EXPECT_FALSE(Find(*world, name)->HasCollision());
  }
  EXPECT_EQ(Look(*world, -5, 8, 0, 0).mod, nullptr);
}

/// A block with clockwise points gives the same body as one with counter-clockwise points.
TEST(Body, ClockwiseBlocksAreReversed) {
  const std::string in_order = "point[0] [0 0] point[1] [4 1] point[2] [5 5] point[3] [1 3] ";
  const std::string clockwise = "point[3] [0 0] point[2] [4 1] point[1] [5 5] point[0] [1 3] ";
  std::vector<double> views[2];
  for (int i = 0; i < 2; i++) {
    const auto world =
        LoadText("model( name \"a\" size [2 2 1] pose [0.013 0.017 0 12] block( points 4 " +
                 (i ? clockwise : in_order) + "z [0 1] ) )");
    for (int k = 0; k < 360; k++)
      views[i].push_back(Look(*world, -3 * std::cos(k), -3 * std::sin(k), 0.5, k).range);
  }
  EXPECT_EQ(views[0], views[1]);
}

TEST(Body, OriginShiftsBodyAndHeights) {
  const auto world =
      LoadText("model( name \"a\" pose [1 2 0.5 90] origin [0.5 0 0.25 0] size [2 1 1] )");
  ExpectExtent(*world, 0.5, 1.5, 1.5, 3.5, 1);
  EXPECT_EQ(Look(*world, -10, 2, 0.74, 0).mod, nullptr);
  EXPECT_NE(Look(*world, -10, 2, 0.76, 0).mod, nullptr);
  EXPECT_NE(Look(*world, -10, 2, 1.74, 0).mod, nullptr);
  EXPECT_EQ(Look(*world, -10, 2, 1.76, 0).mod, nullptr);
}

TEST(Body, NoblocksRemovesIt) {
  const auto world = LoadText("model( name \"a\" noblocks 1 )");
  EXPECT_FALSE(SeenAt(*world, 0.5));
  const auto with_block = LoadText(
      "model( name \"a\" noblocks 1 size [2 2 1] block( points 3 point[0] [0 0] point[1] [1 0]"
      " point[2] [0 1] z [0 1] ) )");
  EXPECT_TRUE(SeenAt(*with_block, 0.5));
}

// Stage corrupts its memory in this case.
TEST(Body, ABoundaryAddsAFrameToTheDefaultBody) {
  for (const char* size : {"[1 1 1]", "[3 2 0.4]"}) {
    const auto world = LoadText("model( name \"a\" boundary 1 size " + std::string(size) + " )");
    Model* a = Find(*world, "a");
    const Geom geom = a->GetGeom();
    ExpectExtent(*world, -geom.size.x / 2, geom.size.x / 2, -geom.size.y / 2, geom.size.y / 2,
                 geom.size.z / 2);
    EXPECT_EQ(Look(*world, -10, 0, geom.size.z + 0.01, 0).mod, nullptr);
    for (int i = 0; i < 20; i++) a->SetPose(Pose(0.1 * i, 0.3, 0, 0.2 * i));
  }
}

TEST(Body, ABoundaryIsAFrameEvenWithoutABody) {
  const auto world = LoadText("model( name \"a\" boundary 1 noblocks 1 size [4 2 1] )");
  ExpectExtent(*world, -2, 2, -1, 1, 0.5);
  EXPECT_NEAR(Look(*world, 0, 0, 0.5, 0).range, 1.99, 1.01 * kCell);  // from inside
}

TEST(Body, ABoundaryHasNoEffectBesideBlocks) {
  const std::string blocks =
      " size [4 4 1] block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 8] point[3] [0 8]"
      " z [0 1] ) block( points 4 point[0] [7 7] point[1] [8 7] point[2] [8 8] point[3] [7 8]"
      " z [0 1] ) )";
  const auto with = LoadText("model( name \"a\" boundary 1" + blocks);
  const auto without = LoadText("model( name \"a\"" + blocks);
  for (int i = 0; i < 100; i++)
    EXPECT_EQ(Look(*with, 1.3, -1.2, 0.5, 0.1 * i).range,
              Look(*without, 1.3, -1.2, 0.5, 0.1 * i).range);
  EXPECT_EQ(Look(*with, 1.3, -1.2, 0.5, -M_PI / 2).mod, nullptr);
}

TEST(Body, SetGeomScalesAndZeroSizesCanBeUndone) {
  const auto world = LoadText("model( name \"a\" size [1 1 1] )");
  Model* a = Find(*world, "a");
  a->SetGeom(Geom(Pose(0.5, 0, 0, 0), Size(2, 3, 0.5)));
  ExpectExtent(*world, -0.5, 1.5, -1.5, 1.5, 0.25);
  EXPECT_FALSE(SeenAt(*world, 0.6));
  a->SetGeom(Geom(Pose(), Size(0, 0, 0)));
  EXPECT_FALSE(SeenAt(*world, 0.25));
  a->SetGeom(Geom(Pose(), Size(1, 2, 1)));
  ExpectExtent(*world, -0.5, 0.5, -1, 1, 0.75);
}

TEST(Body, BlocksAddedAtRunTimeAreDrawnWithTheNextChange) {
  const auto world = EmptyWorld();
  Model* a = world->CreateModel(nullptr, "model");
  a->ClearBlocks();
  EXPECT_FALSE(SeenAt(*world, 0.5));
  a->AddBlockRect(0, 0, 1, 1, 1);
  a->AddBlockRect(1, 0, 3, 1, 0.5);
  a->SetGeom(Geom(Pose(), Size(4, 1, 1)));
  ExpectExtent(*world, -2, 2, -0.5, 0.5, 0.25);
  ExpectExtent(*world, -2, -1, -0.5, 0.5, 0.75);
  a->SetPose(Pose(1, 1, 0, 0));
  ExpectExtent(*world, -1, 3, 0.5, 1.5, 0.25);
}

TEST(Body, AddingBlocksLeavesNoStaleCells) {
  const auto world = LoadText("model( name \"a\" size [1 1 1] )");
  Model* a = Find(*world, "a");
  for (int i = 0; i < 30; i++) {
    a->AddBlockRect(0.1 * i, 0.1, 1, 1, 1);
    if (i % 3 == 0) a->SetPose(Pose(0.05 * i, 0, 0, 0.1));
  }
  a->ClearBlocks();
  a->SetPose(Pose(9, 9, 0, 0));
  for (int i = 0; i < 60; i++) EXPECT_EQ(Look(*world, 0.5, 0.2, 0.5, 0.1 * i).mod, nullptr);
}

TEST(Body, RasterOfAPlainBoxLacksItsUpperAndRightBorder) {
  const auto world = LoadText("model( name \"a\" size [2 1 1] pose [3 4 0 50] )");
  std::vector<uint8_t> raster(40 * 20, 0);
  Find(*world, "a")->Rasterize(raster.data(), 40, 20, 2.0 / 40, 1.0 / 20);
  for (size_t y = 0; y < 20; y++)
    for (size_t x = 0; x < 40; x++)
      EXPECT_EQ(raster[x + 40 * y], x == 0 || y == 0 ? 1 : 0) << x << " " << y;
}

TEST(Body, RasterLeavesOtherBytesAlone) {
  const auto world = LoadText("model( name \"a\" size [2 1 1] )");
  std::vector<uint8_t> raster(10 * 10, 7);
  Find(*world, "a")->Rasterize(raster.data(), 10, 10, 0.1, 0.05);  // half of the body
  EXPECT_EQ(raster[0], 1);
  EXPECT_EQ(raster[5 + 10 * 5], 7);
  Find(*world, "a")->Rasterize(raster.data(), 10, 10, 1e-9, 1e-9);  // extremely fine, but safe
}

// ---- collisions ---------------------------------------------------------------------------------

TEST(Collision, IsTwoOutlinesInOneCell) {
  const auto world =
      LoadText("model( name \"a\" size [1 1 1] ) model( name \"b\" pose [5 0 0 0] size [1 1 1] )");
  Model *a = Find(*world, "a"), *b = Find(*world, "b");
  EXPECT_FALSE(a->HasCollision() || b->HasCollision());
  b->SetPose(Pose(0.9, 0.3, 0, 0));
  EXPECT_TRUE(a->HasCollision() && b->HasCollision());
  EXPECT_FALSE(a->Stalled() || b->Stalled());
  b->SetGeom(Geom(Pose(), Size(0.3, 0.3, 1)));
  b->SetPose(Pose(0, 0, 0, 0));
  EXPECT_FALSE(b->HasCollision());  // nested
  b->SetGeom(Geom(Pose(), Size(1, 1, 1)));
  EXPECT_TRUE(b->HasCollision());  // congruent
}

TEST(Collision, HeightsThatTouchOverlap) {
  const auto world =
      LoadText("model( name \"a\" size [0.4 0.4 0.2] ) model( name \"bar\" size [0.4 0.4 1] )");
  Model *a = Find(*world, "a"), *bar = Find(*world, "bar");
  bar->SetPose(Pose(0.1, 0, 0.2, 0));
  EXPECT_TRUE(a->HasCollision());
  bar->SetPose(Pose(0.1, 0, 0.21, 0));
  EXPECT_FALSE(a->HasCollision());
  a->SetPose(Pose(0, 0, 1.21, 0));
  EXPECT_TRUE(a->HasCollision());
  a->SetPose(Pose(0, 0, 1.22, 0));
  EXPECT_FALSE(a->HasCollision());
}

TEST(Collision, OnlyObstaclesCount) {
  const auto world = LoadText("model( name \"a\" ) model( name \"b\" pose [0.1 0 0 0] )");
  Model *a = Find(*world, "a"), *b = Find(*world, "b");
  EXPECT_TRUE(a->HasCollision());
  b->SetObstacleReturn(false);
  EXPECT_FALSE(a->HasCollision() || b->HasCollision());
  b->vis.obstacle_return = true;
  EXPECT_TRUE(a->HasCollision() && b->HasCollision());
  b->SetRangerReturn(-1);
  EXPECT_TRUE(a->HasCollision());
}

TEST(Collision, TheGroundIsHitBelowZero) {
  const auto world = LoadText("model( name \"a\" pose [0 0 -0.001 0] )");
  Model* a = Find(*world, "a");
  EXPECT_TRUE(a->HasCollision());
  a->SetObstacleReturn(false);
  EXPECT_FALSE(a->HasCollision());
  a->SetObstacleReturn(true);
  a->SetPose(Pose(0, 0, 0, 0));
  EXPECT_FALSE(a->HasCollision());
}

TEST(Collision, DescendantsCountRelativesDoNot) {
  const auto world = LoadText(
      "model( name \"a\" size [0.4 0.4 1] stack_children 0 model( name \"b\" pose [0.1 0 0 0] )"
      " model( name \"c\" pose [2 0 0 0] ) ) model( name \"d\" pose [4 0 0 0] )");
  Model *a = Find(*world, "a"), *d = Find(*world, "d");
  EXPECT_FALSE(a->HasCollision());
  d->SetPose(Pose(2.1, 0, 0, 0));
  EXPECT_TRUE(a->HasCollision());
  EXPECT_FALSE(Find(*world, "a.b")->HasCollision());
  d->SetParent(a);
  EXPECT_FALSE(a->HasCollision());
}

TEST(Collision, SubCellBodiesThatStraddleABorderAreHit) {
  const auto world =
      LoadText("model( name \"a\" size [1 1 1] ) model( name \"b\" size [0.01 0.01 1] )");
  Model* b = Find(*world, "b");
  b->SetPose(Pose(0.5, 0.2, 0, 0));
  EXPECT_TRUE(b->HasCollision());
}

TEST(FreeSpace, RandomPosesAreTriedUntilOneIsFree) {
  const auto world = LoadText(
      "model( name \"a\" size [0.4 0.4 1] ) model( size [2 2 1] )\n"
      "model( pose [1 1 0 45] size [2 2 1] ) model( pose [-1 -1 0 45] size [1 1 1] )");
  Model* a = Find(*world, "a");
  for (int i = 0; i < 50; i++) {
    EXPECT_TRUE(a->RandomPoseInFreeSpace(-1.5, 1.5, -1.5, 1.5));
    EXPECT_FALSE(a->HasCollision());
    const Pose pose = a->GetPose();
    EXPECT_TRUE(std::fabs(pose.x) <= 1.5 && std::fabs(pose.y) <= 1.5) << pose.String();
    EXPECT_EQ(pose.z, 0);
  }
}

TEST(FreeSpace, GivesUpAfterTheTriesAllowed) {
  const auto world = LoadText("model( name \"a\" size [0.4 0.4 1] origin [0 0 -0.1 0] )");
  Model* a = Find(*world, "a");
  int poses = 0;
  a->AddCallback(
      Model::CB_POSE, [](Model*, void* count) { return ++*static_cast<int*>(count), 0; }, &poses);
  EXPECT_FALSE(a->RandomPoseInFreeSpace(-1, 1, -1, 1, 10));  // never above the ground
  EXPECT_EQ(poses, 11);
}

TEST(FreeSpace, PlaceInFreeSpaceLeavesAFreePoseAlone) {
  const auto world =
      LoadText("model( name \"a\" pose [5 6 0 0] ) model( name \"b\" pose [9 9 0 0] )");
  Model* a = Find(*world, "a");
  EXPECT_TRUE(a->PlaceInFreeSpace(-1, 1, -1, 1));
  ExpectPose(a->GetPose(), 5, 6, 0, 0);
  Find(*world, "b")->SetPose(Pose(5.1, 6, 0, 0));
  EXPECT_TRUE(a->PlaceInFreeSpace(-1, 1, -1, 1));
  EXPECT_LT(std::fabs(a->GetPose().x), 1.001);
}

}  // namespace
}  // namespace Stg
