// SPDX-License-Identifier: GPL-2.0-or-later
//
// The recorded walk of a ray equals the walk of sensing.

#include "sensing/walk_record.hh"

#include <gtest/gtest.h>

#include "grid/grid.hh"
#include "random/random.hh"
#include "support/draw_cells.hh"

namespace Stg::internal::sensing {

namespace {

using Kind = WalkStep::Kind;

/// Adds clusters of cells that are far apart.
void Fill(RandomStream* random, grid::Grid* grid) {
  const grid::BodyId body = grid->AddBody(grid::Body());
  for (int cluster = 0; cluster < 20; cluster++) {
    const auto x = static_cast<int32_t>(random->Uniform(-3000, 3000));
    const auto y = static_cast<int32_t>(random->Uniform(-3000, 3000));
    for (int i = 0; i < 300; i++)
      test::DrawCellOnce(grid, x + static_cast<int32_t>(random->Uniform(0, 60)),
                         y + static_cast<int32_t>(random->Uniform(0, 60)), body);
  }
}

TEST(WalkRecordTest, FindsTheHitsThatTheWalkFinds) {
  RandomStream random(5);
  grid::Grid grid;
  Fill(&random, &grid);
  const ray_grid_t view = grid.View(grid::kEverything);
  const ray_mask_t none{nullptr, 0, 0, 0, 0};
  size_t hits = 0, leaps[4] = {0, 0, 0, 0};
  for (int i = 0; i < 3000; i++) {
    const auto coordinate = [&](double reach) {
      return static_cast<int>(random.Uniform(-reach, reach));
    };
    ray_t ray;
    ray_begin(&ray, &view, coordinate(3000), coordinate(3000),
              static_cast<int>(random.Uniform(0, 65535)),
              static_cast<int>(random.Uniform(0, 65535)), i % 50 == 0 ? 0 : coordinate(9e7),
              i % 51 == 0 ? 0 : coordinate(9e7));
    std::vector<WalkStep> steps;
    RecordWalk(view, none, ray, 1000000, &steps);
    ray_t sensing = ray;
    double at = 0;
    for (const WalkStep& step : steps) {
      EXPECT_EQ(step.from, at);
      EXPECT_GE(step.to, step.from);
      at = step.to;
      if (step.kind != Kind::kHit) {
        leaps[static_cast<size_t>(step.kind)]++;
        continue;
      }
      hits++;
      ASSERT_TRUE(ray_next(&view, &none, &sensing));
      EXPECT_EQ(step.x, sensing.x0 + sensing.sx * sensing.u);
      EXPECT_EQ(step.y, sensing.y0 + sensing.sy * sensing.v);
    }
    EXPECT_FALSE(ray_next(&view, &none, &sensing)) << "ray " << i << " has more hits";
  }
  EXPECT_GT(hits, 500u);
  for (const size_t count : leaps) EXPECT_GT(count, 100u);
}

TEST(WalkRecordTest, EndsAfterTheStepsThatAreAllowed) {
  grid::Grid grid;
  const grid::BodyId body = grid.AddBody(grid::Body());
  for (int i = 0; i < 100; i++) test::DrawCell(&grid, i, 0, body);
  const ray_grid_t view = grid.View(grid::kEverything);
  const ray_mask_t none{nullptr, 0, 0, 0, 0};
  ray_t ray;
  ray_begin(&ray, &view, 0, 0, 0, 0, 100 << 16, 0);
  std::vector<WalkStep> steps;
  RecordWalk(view, none, ray, 10, &steps);
  EXPECT_GE(steps.size(), 10u);
  EXPECT_LE(steps.size(), 11u);
}

}  // namespace

}  // namespace Stg::internal::sensing
