// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/cell_set.hh"

#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "support/random_source.hh"

namespace Stg::internal::grid {
namespace {

using test::RandomSource;

TEST(Parts, GroupCellsByTile) {
  std::vector<CellSet> sets;
  CellSetBuilder maker(&sets);
  maker.Add(-1, -1);
  maker.Add(0, 7);
  maker.Add(7, 0);
  maker.Add(-8, -1);
  maker.Add(0, 7);
  maker.Finish();
  ASSERT_EQ(sets.size(), 2u);
  EXPECT_EQ(sets[0].x, -1);
  EXPECT_EQ(sets[0].y, -1);
  EXPECT_EQ(sets[0].cells, uint64_t{1} << 63 | uint64_t{1} << 56);
  EXPECT_EQ(sets[1].x, 0);
  EXPECT_EQ(sets[1].y, 0);
  EXPECT_EQ(sets[1].cells, uint64_t{1} << 56 | uint64_t{1} << 7);
  EXPECT_EQ(CountCells(sets), 4u);
}

TEST(Parts, AreEmptyWithoutCells) {
  std::vector<CellSet> sets;
  CellSetBuilder(&sets).Finish();
  EXPECT_TRUE(sets.empty());
  EXPECT_EQ(CountCells(sets), 0u);
}

TEST(Parts, HandleRandomCells) {
  RandomSource random(1);
  for (int round = 0; round < 500; round++) {
    const int spread = random.Pick<int>({3, 40, 1000, std::numeric_limits<int>::max()});
    std::map<std::pair<int, int>, uint64_t> expected;  // by y, x
    std::vector<CellSet> sets = {
        {.x = 5, .y = 5, .slot = 7, .cells = 1},
        {.x = 5, .y = 5, .slot = 8, .cells = 2}};  // of other bodies; must stay
    CellSetBuilder maker(&sets);
    const int count = random.Int(0, 200);
    for (int i = 0; i < count; i++) {
      const int x = random.Int(-spread, spread), y = random.Int(-spread, spread);
      maker.Add(x, y);
      expected[{y >> 3, x >> 3}] |= uint64_t{1} << ((x & 7) + 8 * (y & 7));
    }
    maker.Finish();
    ASSERT_EQ(sets.size(), expected.size() + 2);
    EXPECT_EQ(sets[0].cells, 1u);
    EXPECT_EQ(sets[1].cells, 2u);
    size_t i = 2;
    for (const auto& [place, cells] : expected) {
      ASSERT_EQ(sets[i].x, place.second);
      ASSERT_EQ(sets[i].y, place.first);
      ASSERT_EQ(sets[i].slot, 0u);
      ASSERT_EQ(sets[i].cells, cells);
      if (i > 2) {
        ASSERT_TRUE(sets[i - 1].ComesBefore(sets[i]));
        ASSERT_FALSE(sets[i].ComesBefore(sets[i - 1]));
      }
      i++;
    }
  }
}

}  // namespace
}  // namespace Stg::internal::grid
