// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/tile_board.hh"

#include <gtest/gtest.h>

#include <vector>

#include "support/random_source.hh"

namespace {

namespace grid = Stg::internal::grid;
using Stg::test::RandomSource;

TEST(TileBoard, OutlinesHaveTheCellsOfTheirRasterization) {
  RandomSource random(3);
  for (int round = 0; round < 500; round++) {
    const grid::CellBox box{random.Int(-9, 0), random.Int(-9, 0), random.Int(1, 9),
                            random.Int(1, 9)};
    const auto side = [&](int32_t first, int32_t last) {
      return random.Int(first * 8, last * 8 + 7);
    };
    const bool straight = random.OneIn(2);
    std::vector<Stg::point_int_t> corners{{side(box.min_x, box.max_x), side(box.min_y, box.max_y)}};
    for (int i = random.Int(2, 9); i > 0; i--) {
      Stg::point_int_t next(side(box.min_x, box.max_x), side(box.min_y, box.max_y));
      if (straight) (i % 2 ? next.x : next.y) = i % 2 ? corners.back().x : corners.back().y;
      corners.push_back(next);
    }
    // Straight outlines end in the row of their first corner, and above or below it.
    if (straight) corners.emplace_back(corners.back().x, corners.front().y);

    grid::TileBoard drawn(box), expected(box);
    for (size_t i = 0; i < corners.size(); i++)
      drawn.DrawEdge(corners[i], corners[(i + 1) % corners.size()]);
    std::vector<grid::CellSet> sets;
    grid::AppendOutline(corners.data(), corners.size(), &sets);
    for (const grid::CellSet& set : sets) expected.Add(set);
    ASSERT_TRUE(std::ranges::equal(drawn.words(), expected.words())) << round;
    drawn.Clear();
    EXPECT_EQ(std::ranges::count(drawn.words(), 0u), std::ssize(drawn.words()));
  }
}

}  // namespace
