// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/tile_part.hh"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "support/random_source.hh"

namespace Stg::internal::grid {
namespace {

using test::RandomSource;

TEST(Parts, CellsOfATileAreOnePart) {
  std::vector<TilePart> parts;
  PartsMaker maker(&parts);
  maker.Add(-1, -1);
  maker.Add(0, 7);
  maker.Add(7, 0);
  maker.Add(-8, -1);
  maker.Add(0, 7);
  maker.Finish();
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].x, -1);
  EXPECT_EQ(parts[0].y, -1);
  EXPECT_EQ(parts[0].cells, uint64_t{1} << 63 | uint64_t{1} << 56);
  EXPECT_EQ(parts[1].x, 0);
  EXPECT_EQ(parts[1].y, 0);
  EXPECT_EQ(parts[1].cells, uint64_t{1} << 56 | uint64_t{1} << 7);
  EXPECT_EQ(CountCells(parts), 4u);
}

TEST(Parts, NoCellsMakeNone) {
  std::vector<TilePart> parts;
  PartsMaker(&parts).Finish();
  EXPECT_TRUE(parts.empty());
  EXPECT_EQ(CountCells(parts), 0u);
}

TEST(Parts, OfRandomCells) {
  RandomSource random(1);
  for (int round = 0; round < 500; round++) {
    const int spread = random.Pick<int>({3, 40, 1000, std::numeric_limits<int>::max()});
    std::map<std::pair<int, int>, uint64_t> expected;  // by y, x
    std::vector<TilePart> parts = {
        {.x = 5, .y = 5, .slot = 7, .cells = 1},
        {.x = 5, .y = 5, .slot = 8, .cells = 2}};  // of other bodies; must stay
    PartsMaker maker(&parts);
    const int count = random.Int(0, 200);
    for (int i = 0; i < count; i++) {
      const int x = random.Int(-spread, spread), y = random.Int(-spread, spread);
      maker.Add(x, y);
      expected[{y >> 3, x >> 3}] |= uint64_t{1} << ((x & 7) + 8 * (y & 7));
    }
    maker.Finish();
    ASSERT_EQ(parts.size(), expected.size() + 2);
    EXPECT_EQ(parts[0].cells, 1u);
    EXPECT_EQ(parts[1].cells, 2u);
    size_t i = 2;
    for (const auto& [place, cells] : expected) {
      ASSERT_EQ(parts[i].x, place.second);
      ASSERT_EQ(parts[i].y, place.first);
      ASSERT_EQ(parts[i].slot, 0u);
      ASSERT_EQ(parts[i].cells, cells);
      if (i > 2) {
        ASSERT_TRUE(parts[i - 1].ComesBefore(parts[i]));
        ASSERT_FALSE(parts[i].ComesBefore(parts[i - 1]));
      }
      i++;
    }
  }
}

}  // namespace
}  // namespace Stg::internal::grid
