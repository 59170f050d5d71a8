// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/batch.hh"

#include <gtest/gtest.h>

#include <set>
#include <utility>
#include <vector>

#include "support/draw_cells.hh"
#include "support/fan_with_own_directions.hh"
#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

using Cell = std::pair<int32_t, int32_t>;

const int kMine = 0, kOther = 0;  // trees, of which only the addresses are used

grid::Body BodyOf(const void* tree) {
  grid::Body body;
  body.tree = tree;
  return body;
}

bool Hides(const ray_mask_t& mask, Cell cell) {
  const int64_t x = (cell.first >> 3) - mask.x, y = (cell.second >> 3) - mask.y;
  if (x < 0 || y < 0 || x >= mask.width || y >= mask.height) return false;
  return mask.tiles[y * mask.width + x] >> ((cell.first & 7) | (cell.second & 7) << 3) & 1;
}

/// A batch with one fan, whose self-mask covers the cells.
struct WithSelfMask {
  RayBatch batch;
  DirectionTables tables;
  WithSelfMask(const grid::Grid& grid, const grid::Rasterizations& own, const void* tree) {
    batch.Add(Fan(), 1, batch.MakeSelfMask(grid, own, tree, false));
    batch.Close(tables);
  }
  ray_mask_t mask() const { return batch.SelfMaskOf(batch.fans()[0]); }
};

TEST(SelfMask, HidesExactlyTheCellsWithoutOtherBodies) {
  test::RandomSource random(1);
  for (int round = 0; round < 200; round++) {
    grid::Grid grid;
    const grid::BodyId mine = grid.AddBody(BodyOf(&kMine)),
                       also_mine = grid.AddBody(BodyOf(&kMine));
    const grid::BodyId other = grid.AddBody(BodyOf(&kOther));
    const int32_t x0 = random.Int(-100000, 100000), y0 = random.Int(-100000, 100000);
    const auto cell = [&] { return Cell{x0 + random.Int(0, 70), y0 + random.Int(0, 70)}; };
    std::vector<grid::CellRef> first, second;
    std::set<Cell> own, own_of[2], others;
    for (int i = 0; i < 200; i++) {
      const Cell at = cell();
      const bool is_first = random.OneIn(2);
      own.insert(at);
      if (!own_of[is_first].insert(at).second) continue;  // a body has each cell once
      (is_first ? first : second)
          .push_back(test::DrawCell(&grid, at.first, at.second, is_first ? mine : also_mine));
    }
    for (int i = 0; i < 300; i++) {
      const Cell at = cell();
      if (others.insert(at).second) test::DrawCell(&grid, at.first, at.second, other);
    }
    const std::vector<grid::CellSet> parts[] = {test::CellSetsOf(grid, first),
                                                test::CellSetsOf(grid, second)};
    const WithSelfMask with(grid, {{&parts[0], &parts[1]}}, &kMine);
    const ray_mask_t mask = with.mask();
    ASSERT_LE(mask.width, 10u);
    for (int32_t x = x0 - 20; x < x0 + 90; x++)
      for (int32_t y = y0 - 20; y < y0 + 90; y++)
        ASSERT_EQ(Hides(mask, {x, y}), own.count({x, y}) && !others.count({x, y}));
  }
}

TEST(SelfMask, OfNoCellsIsEmpty) {
  grid::Grid grid;
  const WithSelfMask with(grid, grid::Rasterizations(), &kMine);
  EXPECT_EQ(with.mask().width, 0u);
  const std::vector<grid::CellSet> none;
  EXPECT_EQ(WithSelfMask(grid, {{&none}}, &kMine).mask().width, 0u);
}

TEST(SelfMask, LargeBodiesHaveNone) {
  const int32_t side = static_cast<int32_t>(kMaxMaskSide) * 8;
  for (const int32_t size : {side, side + 1, 1 << 29})
    for (const bool wide : {false, true}) {
      grid::Grid grid;
      const grid::BodyId mine = grid.AddBody(BodyOf(&kMine));
      const std::vector<grid::CellSet> parts = test::CellSetsOf(
          grid,
          {test::DrawCell(&grid, -64, 128, mine),
           test::DrawCell(&grid, -64 + (wide ? size - 1 : 0), 128 + (wide ? 0 : size - 1), mine)});
      const WithSelfMask with(grid, {{&parts}}, &kMine);
      EXPECT_EQ(with.mask().width != 0, size == side) << size;
      EXPECT_EQ(Hides(with.mask(), {-64, 128}), size == side);
    }
}

TEST(Batch, KeepsSelfMasksApart) {
  grid::Grid grid;
  const grid::BodyId mine = grid.AddBody(BodyOf(&kMine)), other = grid.AddBody(BodyOf(&kOther));
  const std::vector<grid::CellSet> a = test::CellSetsOf(
      grid, {test::DrawCell(&grid, 0, 0, mine), test::DrawCell(&grid, 30, 0, mine)});
  const std::vector<grid::CellSet> b =
      test::CellSetsOf(grid, {test::DrawCell(&grid, 100, 100, other)});
  RayBatch batch;
  DirectionTables tables;
  const SelfMask mask = batch.MakeSelfMask(grid, {{&a}}, &kMine, false);
  batch.Add(Fan(), 3, mask);
  batch.Add(Fan(), 2, batch.MakeSelfMask(grid, {{&b}}, &kOther, false));
  batch.Add(Fan(), 2, SelfMask());
  batch.Add(Fan(), 5, mask);  // two sensors of one body share a mask
  batch.Close(tables);
  ASSERT_EQ(batch.fans().size(), 4u);
  const bool expected[4][2] = {{true, false}, {false, true}, {false, false}, {true, false}};
  for (size_t i = 0; i < 4; i++) {
    EXPECT_EQ(Hides(batch.SelfMaskOf(batch.fans()[i]), {30, 0}), expected[i][0]) << i;
    EXPECT_EQ(Hides(batch.SelfMaskOf(batch.fans()[i]), {100, 100}), expected[i][1]) << i;
  }
}

TEST(Batch, NumbersTheRays) {
  RayBatch batch;
  DirectionTables tables;
  for (const uint32_t samples : {5u, 1u, 180u}) batch.Add(Fan(), samples, SelfMask());
  batch.Close(tables);
  EXPECT_EQ(batch.ray_count(), 186u);
  EXPECT_EQ(batch.fans()[0].record.first_ray, 0u);
  EXPECT_EQ(batch.fans()[1].record.first_ray, 5u);
  EXPECT_EQ(batch.fans()[2].record.first_ray, 6u);
  EXPECT_EQ(batch.fans()[2].record.samples, 180u);
  batch.Clear();
  EXPECT_EQ(batch.ray_count(), 0u);
  EXPECT_TRUE(batch.fans().empty());
  EXPECT_TRUE(batch.mask_words().empty());
}

// Fans are made once and added repeatedly: no data of a former batch may remain.
TEST(Batch, FansAreRightAfterManyClears) {
  test::RandomSource random(5);
  DirectionTables tables;
  RayBatch batch;
  for (int round = 0; round < 300; round++) {
    batch.Clear();
    batch.Allocate({.words = 6});  // of the mask
    std::vector<Fan> expected;
    uint64_t rays = 0;
    const int count = random.OneIn(4) ? 0 : random.Int(1, random.OneIn(2) ? 500 : 5);
    for (int i = 0; i < count; i++) {
      Fan fan;
      PlaceFan(&fan, Pose(random.Real(-99, 99), random.Real(-99, 99), 0, random.Real(-3, 3)),
               random.Real(0, 50), 10);
      fan.tag = static_cast<uint32_t>(random.Next());
      fan.exact = random.OneIn(2);
      const auto samples = static_cast<uint32_t>(random.Int(0, 20));
      const SelfMask mask = {random.Int(-9, 9), random.Int(-9, 9), 3, 2, 0};
      if (random.OneIn(3))
        test::AddTurned(&batch, fan, std::vector<double>(samples, 0.5), mask);
      else
        batch.Add(fan, samples, mask);
      fan.record.first_ray = static_cast<uint32_t>(rays);
      fan.record.samples = samples;
      fan.record.mask_x = mask.x;
      rays += samples;
      expected.push_back(fan);
    }
    batch.Close(tables);
    const std::span<const Fan> fans = batch.fans();
    ASSERT_EQ(fans.size(), expected.size());
    ASSERT_EQ(batch.ray_count(), rays);
    for (size_t i = 0; i < fans.size(); i++) {
      ASSERT_EQ(fans[i].tag, expected[i].tag);
      ASSERT_EQ(fans[i].exact, expected[i].exact);
      ASSERT_EQ(fans[i].range, expected[i].range);
      ASSERT_EQ(fans[i].record.x, expected[i].record.x);
      ASSERT_EQ(fans[i].record.cosine, expected[i].record.cosine);
      ASSERT_EQ(fans[i].record.first_ray, expected[i].record.first_ray);
      ASSERT_EQ(fans[i].record.samples, expected[i].record.samples);
      ASSERT_EQ(fans[i].record.mask_x, expected[i].record.mask_x);
      ASSERT_EQ(fans[i].record.mask_size, 3u | 2u << 16);
    }
  }
}

TEST(Batch, SlicesCanBeFilledInAnyOrder) {
  RayBatch batch;
  const DirectionTables tables;
  for (const uint32_t count : {100u, 3u, 50u, 200u}) {
    batch.Clear();
    batch.Add(Fan(), 4, SelfMask());
    const BatchSpace before = batch.Allocate({.rays = count * 2, .fans = count});
    EXPECT_EQ(before.fans, 1u);
    EXPECT_EQ(before.rays, 4u);
    for (uint32_t i = count; i-- > 0;) {
      Fan fan;
      fan.tag = i;
      if (i == 1) fan.layer = grid::kNoLayer;
      batch.Put(before.fans + i, fan, before.rays + i * 2, 2, SelfMask());
    }
    batch.SetLayer(2, 7);
    batch.Close(tables);
    ASSERT_EQ(batch.fans().size(), count + 1);
    EXPECT_EQ(batch.ray_count(), 4 + 2 * count);
    for (uint32_t i = 0; i < count; i++) {
      EXPECT_EQ(batch.fans()[1 + i].tag, i);
      EXPECT_EQ(batch.fans()[1 + i].record.first_ray, 4 + 2 * i);
      EXPECT_EQ(batch.fans()[1 + i].layer, i == 1 ? 7u : 0u);
    }
  }
}

TEST(Batch, FindsDirectionsInTheTablesOrOfTheFan) {
  RayBatch batch;
  DirectionTables tables;
  Fan fan;
  fan.record.first_direction = tables.Find(1.0, 10);
  batch.Add(fan, 10, SelfMask());
  const std::vector<double> own = {0.1, 0.2}, more = {0.3}, none;
  test::AddTurned(&batch, Fan(), own, SelfMask());
  test::AddTurned(&batch, Fan(), more, SelfMask());
  test::AddTurned(&batch, Fan(), none, SelfMask());
  // Later sensors may add tables, so indices are resolved when the batch is closed.
  fan.record.first_direction = tables.Find(2.0, 100);
  batch.Add(fan, 100, SelfMask());
  batch.Close(tables);

  std::span<const Fan> fans = batch.fans();
  EXPECT_EQ(batch.DirectionsOf(fans[0]), &tables.all()[1]);
  EXPECT_EQ(batch.DirectionsOf(fans[1])[0].cosine, MakeDirection(0.1).cosine);
  EXPECT_EQ(batch.DirectionsOf(fans[1])[1].sine, MakeDirection(0.2).sine);
  EXPECT_EQ(batch.DirectionsOf(fans[2])[0].cosine, MakeDirection(0.3).cosine);
  EXPECT_EQ(batch.DirectionsOf(fans[3]), batch.DirectionsOf(fans[2]) + 1)
      << "follows the one before";
  EXPECT_EQ(batch.DirectionsOf(fans[4]), &tables.all()[11]);
  EXPECT_EQ(batch.UnitVectorsOf(fans[0]), &tables.unit_vectors()[1]);
  EXPECT_EQ(batch.UnitVectorsOf(fans[1])[1].sine, std::sin(0.2));
  EXPECT_EQ(batch.UnitVectorsOf(fans[4]), &tables.unit_vectors()[11]);
  EXPECT_EQ(batch.own_directions().size(), 3u);
  EXPECT_EQ(fans[1].record.first_direction, tables.all().size());
  EXPECT_EQ(fans[2].record.samples, 1u);
  batch.Clear();
  EXPECT_TRUE(batch.own_directions().empty());
}

// A sensor may have nothing to look at in a step.
TEST(Directions, HandleAFanWithoutRays) {
  RayBatch batch;
  const DirectionTables tables;
  test::AddTurned(&batch, Fan(), std::vector<double>(), SelfMask());
  test::AddTurned(&batch, Fan(), std::vector<double>(2, 1.0), SelfMask());
  test::AddTurned(&batch, Fan(), std::vector<double>(), SelfMask());
  batch.Close(tables);
  EXPECT_EQ(batch.ray_count(), 2u);
  const Direction* const first = batch.own_directions().data();
  EXPECT_EQ(batch.DirectionsOf(batch.fans()[0]), first);
  EXPECT_EQ(batch.DirectionsOf(batch.fans()[1]), first);
  EXPECT_EQ(batch.DirectionsOf(batch.fans()[2]), first + 2);
}

}  // namespace
}  // namespace Stg::internal::sensing
