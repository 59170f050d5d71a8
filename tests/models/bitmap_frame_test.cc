// SPDX-License-Identifier: GPL-2.0-or-later
//
// The part of a bitmap that is stretched to the size of its model.

#include <cstdio>
#include <fstream>

#include "looking.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

/// A bitmap of 50 x 50 pixels, dark in columns 20 to 29 and rows 10 to 29, so off-center in y.
std::string Picture() {
  const std::string path = testing::TempDir() + "bitmap_frame_test.pbm";
  std::ofstream out(path);
  out << "P1\n50 50\n";
  for (int y = 0; y < 50; y++) {
    for (int x = 0; x < 50; x++) out << (x >= 20 && x < 30 && y >= 10 && y < 30 ? "1" : "0");
    out << '\n';
  }
  return path;
}

std::string Map(const std::string& more) {
  return "model( name \"a\" bitmap \"" + Picture() + "\" size [10 10 1] " + more + " )\n";
}

constexpr char kHint[] =
    "found a picture with light margins (pixels: left 20, right 20, top 10, bottom 20), which are "
    "cut off before the rest is stretched to size: that moves walls by up to 4 m; bitmap_frame "
    "\"picture\" keeps the margins, bitmap_frame \"dark\" silences this warning";

TEST(BitmapFrame, DefaultsToTheDarkPartWithAHint) {
  const auto world = EmptyWorld();
  const LoadOutcome outcome = TryToLoad(world.get(), Map(""));
  EXPECT_EQ(outcome.errors, "t.world:1:24: warning: " + std::string(kHint) + "\n");
  ExpectExtent(*world, -5, 5, -5, 5, 0.5);
  ASSERT_EQ(Summarize(*world).load_warnings.size(), 1u);
  EXPECT_EQ(Summarize(*world).load_warnings[0], "t.world:1:24: " + std::string(kHint));
}

TEST(BitmapFrame, ExplicitDarkGivesNoHint) {
  const auto world = EmptyWorld();
  EXPECT_EQ(TryToLoad(world.get(), Map("bitmap_frame \"dark\"")).errors, "");
  ExpectExtent(*world, -5, 5, -5, 5, 0.5);
}

TEST(BitmapFrame, PictureKeepsTheMargins) {
  const auto world = EmptyWorld();
  EXPECT_EQ(TryToLoad(world.get(), Map("bitmap_frame \"picture\"")).errors, "");
  ExpectExtent(*world, -1, 1, -1, 3, 0.5);
}

TEST(BitmapFrame, PictureHasItsBoundaryAround) {
  const auto world = LoadText(Map("bitmap_frame \"picture\" boundary 1"));
  ExpectExtent(*world, -5, 5, -5, 5, 0.5);
  EXPECT_NEAR(Look(*world, -4.9, 0, 0.5, 0).range, 3.9, 1.01 * kCell);
}

TEST(BitmapFrame, WarnsOfUnknownValues) {
  const LoadOutcome outcome = TryToLoad(Map("bitmap_frame \"trimmed\""));
  EXPECT_EQ(outcome.errors.substr(outcome.errors.find("warning")),
            "warning: found \"trimmed\", expected \"dark\" or \"picture\"; using \"dark\"\n");
}

/// Margins of less than a cell have no effect.
TEST(BitmapFrame, GivesNoHintForMarginsBelowACell) {
  EXPECT_EQ(TryToLoad("resolution 5\n" + Map("")).errors, "");
}

/// The frame stays with the body when the body changes.
TEST(BitmapFrame, StaysWithABodyThatChanges) {
  const auto world = LoadText(Map("bitmap_frame \"picture\""));
  Model* const map = Find(*world, "a");
  map->SetGeom(Geom(Pose(), Size(5, 5, 1)));
  ExpectExtent(*world, -0.5, 0.5, -0.5, 1.5, 0.5);
  map->AddBlockRect(-0.1, -0.1, 0.2, 0.2, 1);
  map->SetGeom(Geom(Pose(), Size(10, 10, 1)));
  ExpectExtent(*world, -1, 1, -1, 3, 0.5);
}

TEST(BitmapFrame, IsInSnapshotsAndCopies) {
  const auto world = LoadText(Map("bitmap_frame \"picture\""));
  World copy;
  ASSERT_TRUE(copy.LoadCopy(*world));
  EXPECT_EQ(copy.StateHash(), world->StateHash());
  Model* const map = Find(*world, "a");
  map->AddBlockRect(-0.1, -0.1, 0.2, 0.2, 1);
  const uint64_t hash = world->StateHash();
  Snapshot snapshot;
  ASSERT_TRUE(world->Take(&snapshot));
  map->SetGeom(Geom(Pose(), Size(5, 5, 1)));
  EXPECT_NE(world->StateHash(), hash);
  ASSERT_TRUE(world->Restore(snapshot));
  EXPECT_EQ(world->StateHash(), hash);
  map->SetGeom(Geom(Pose(), Size(10, 10, 1)));
  ExpectExtent(*world, -1, 1, -1, 3, 0.5);
}

}  // namespace
}  // namespace Stg
