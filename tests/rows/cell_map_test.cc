// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/cell_map.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "support/random_source.hh"

namespace {

using Stg::internal::grid::CellBox;
using Stg::internal::grid::CellSet;
using Stg::rows::CellMap;
using Stg::test::RandomSource;

std::vector<CellSet> RandomSets(RandomSource* random, const CellBox& tiles) {
  std::vector<CellSet> sets;
  for (int i = random->Int(0, 12); i > 0; i--)
    sets.push_back({.x = random->Int(tiles.min_x, tiles.max_x),
                    .y = random->Int(tiles.min_y, tiles.max_y),
                    .cells = random->Next() | 1});
  return sets;
}

/// The distance to the nearest tile of the sets, columns or rows; 255 if there is none.
int DistanceTo(const std::vector<CellSet>& sets, int x, int y) {
  int least = 255;
  for (const CellSet& set : sets)
    least = std::min(least, std::max(std::abs(set.x - x), std::abs(set.y - y)));
  return least;
}

std::string Difference(CellMap* map, const std::vector<CellSet>& sets) {
  const CellMap::Content content = map->content();
  for (int y = content.y; y < content.y + content.height; y++)
    for (int x = content.x; x < content.x + content.width; x++) {
      uint64_t cells = 0;
      for (const CellSet& set : sets)
        if (set.x == x && set.y == y) cells |= set.cells;
      const std::string at = " at " + std::to_string(x) + " " + std::to_string(y);
      if (map->Tile(x, y) != cells) return "other cells" + at;
      const auto place = static_cast<size_t>((y - content.y) * content.width + x - content.x);
      if (content.distances[place] != DistanceTo(sets, x, y)) return "another distance" + at;
    }
  return "";
}

TEST(CellMap, CellsAndDistancesAreThoseOfItsSetsAlsoAfterChanges) {
  RandomSource random(1);
  for (int round = 0; round < 300; round++) {
    const CellBox tiles{random.Int(-9, 0), random.Int(-9, 0), random.Int(0, 30), random.Int(0, 9)};
    std::vector<CellSet> sets = RandomSets(&random, {-12, -4, 12, 6});
    CellMap map;
    ASSERT_TRUE(map.MakeChangeable(tiles, sets, true));
    ASSERT_EQ(Difference(&map, sets), "") << round;
    for (const CellSet& set : sets) map.SetTile(set.x, set.y, 0);
    sets = RandomSets(&random, tiles);
    const CellMap::Content content = map.content();
    std::ranges::fill(map.distances(), uint8_t{9});
    for (const CellSet& set : sets) {
      map.SetTile(set.x, set.y, map.Tile(set.x, set.y) | set.cells);
      map.distances()[static_cast<size_t>((set.y - content.y) * content.width + set.x -
                                          content.x)] = 0;
    }
    map.MeasureDistances();
    ASSERT_EQ(Difference(&map, sets), "") << round;
  }
}

}  // namespace
