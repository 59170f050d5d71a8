// SPDX-License-Identifier: GPL-2.0-or-later
//
// Blocks without a height range.

#include "looking.hh"
#include "models/body.hh"
#include "support/model_testing.hh"

namespace Stg {
namespace {

std::string Block(const std::string& rest) {
  return " block( points 4 point[0] [0 0] point[1] [1 0] point[2] [1 1] point[3] [0 1] " + rest +
         " )";
}

std::unique_ptr<World> WorldOf(const std::string& blocks) {
  return LoadText("model( name \"a\" size [1 1 3]" + blocks + " )");
}

/// Expects a body from 0 to the height of the model.
void ExpectFull(World& world) {
  EXPECT_TRUE(SeenAt(world, 0));
  EXPECT_TRUE(SeenAt(world, 0.001));
  EXPECT_TRUE(SeenAt(world, 2.999));
  EXPECT_FALSE(SeenAt(world, 3.001));
}

TEST(BlockHeights, MissingRangeFillsTheModel) {
  ExpectFull(*WorldOf(Block("")));
  ExpectFull(*WorldOf(Block("") + Block("")));
}

/// Mixes blocks with and without height ranges, in both orders, with ranges in any unit.
TEST(BlockHeights, MissingRangeFillsTheModelBesideOthers) {
  for (const char* z : {"[0 1]", "[0 0.2]", "[0 50]", "[0.1 0.2]", "[2 4]", "[0 0]", "[-1 0]"}) {
    for (const bool first : {true, false}) {
      const std::string other = Block(std::string("z ") + z), full = Block("");
      const auto world = WorldOf(first ? full + other : other + full);
      const auto& blocks = Find(*world, "a")->body().blocks();
      const Bounds& heights = blocks[first ? 0 : 1]->z_range();
      EXPECT_NEAR(heights.max - heights.min, 3, 1e-12) << z << first;
    }
  }
}

TEST(BlockHeights, OtherBlocksKeepTheirRelativeHeights) {
  const auto world = WorldOf(Block("") + Block("z [0 0.5]") + Block("z [0.5 2]"));
  const auto& blocks = Find(*world, "a")->body().blocks();
  EXPECT_EQ(blocks[1]->z_range().max, 0.75);
  EXPECT_EQ(blocks[2]->z_range().min, 0.75);
  EXPECT_EQ(blocks[2]->z_range().max, 3);
}

/// A ranger sees a robot of such a block, as in the benchmark against VMAS.
TEST(BlockHeights, RangersSeeBlocksWithoutRange) {
  const auto world =
      LoadText("position( name \"other\" pose [2 0 0 0] size [0.4 0.4 0.3]" + Block("") +
               " )\nposition( ranger( name \"eye\" pose [0 0 -0.2 0] alwayson 1 "
               "sensor( range [0 5] samples 1 ) ) size [0.3 0.3 0.3] )");
  Step(*world, 2);
  const auto* eye = dynamic_cast<ModelRanger*>(world->GetModel("position:0.eye"));
  if (!eye) eye = dynamic_cast<ModelRanger*>(world->GetModel("position:1.eye"));
  ASSERT_NE(eye, nullptr);
  EXPECT_NEAR(eye->GetSensors()[0].ranges.at(0), 1.8, 0.03);
}

/// The body is the same in a copy and after a reset.
TEST(BlockHeights, AreTheSameInCopies) {
  const auto world = WorldOf(Block("") + Block("z [0 2]"));
  World copy;
  ASSERT_TRUE(copy.LoadCopy(*world));
  ExpectFull(copy);
  EXPECT_EQ(copy.StateHash(), world->StateHash());
  ASSERT_TRUE(world->Reset(1));
  ExpectFull(*world);
}

}  // namespace
}  // namespace Stg
