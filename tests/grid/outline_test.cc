// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/outline.hh"

#include <gtest/gtest.h>

#include <cstdlib>
#include <limits>
#include <vector>

namespace Stg::internal::grid {
namespace {

using Cells = std::vector<point_int_t>;

Cells EdgeCells(point_int_t from, point_int_t to) {
  Cells cells;
  ForEachCellOfEdge(from, to, [&](int32_t x, int32_t y) { cells.emplace_back(x, y); });
  return cells;
}

Cells OutlineCells(const Cells& corners) {
  Cells cells;
  ForEachCellOfOutline(corners.data(), corners.size(),
                       [&](int32_t x, int32_t y) { cells.emplace_back(x, y); });
  return cells;
}

TEST(Edge, KnownPaths) {
  EXPECT_EQ(EdgeCells({0, 0}, {5, 2}),
            (Cells{{0, 0}, {1, 0}, {1, 1}, {2, 1}, {3, 1}, {4, 1}, {4, 2}}));
  EXPECT_EQ(EdgeCells({5, 2}, {3, 6}), (Cells{{5, 2}, {5, 3}, {4, 3}, {4, 4}, {4, 5}, {3, 5}}));
  EXPECT_EQ(EdgeCells({3, 6}, {0, 0}),
            (Cells{{3, 6}, {3, 5}, {2, 5}, {2, 4}, {2, 3}, {1, 3}, {1, 2}, {1, 1}, {0, 1}}));
  EXPECT_EQ(EdgeCells({0, 0}, {2, 2}), (Cells{{0, 0}, {0, 1}, {1, 1}, {1, 2}}));
  EXPECT_EQ(EdgeCells({2, 2}, {0, 0}), (Cells{{2, 2}, {2, 1}, {1, 1}, {1, 0}}));
  EXPECT_EQ(EdgeCells({0, 0}, {4, 0}), (Cells{{0, 0}, {1, 0}, {2, 0}, {3, 0}}));
  EXPECT_EQ(EdgeCells({0, 0}, {0, -3}), (Cells{{0, 0}, {0, -1}, {0, -2}}));
  EXPECT_TRUE(EdgeCells({7, 7}, {7, 7}).empty());
}

TEST(Edge, IsAConnectedPathCloseToTheLine) {
  for (int dx = -40; dx <= 40; dx++)
    for (int dy = -40; dy <= 40; dy++) {
      if (dx == 0 && dy == 0) continue;
      const point_int_t from(-3, 11), to(from.x + dx, from.y + dy);
      Cells cells = EdgeCells(from, to);
      ASSERT_EQ(cells.size(), static_cast<size_t>(std::abs(dx) + std::abs(dy)));
      ASSERT_EQ(cells.front(), from);
      cells.push_back(to);  // the cell after the path's end
      for (size_t i = 1; i < cells.size(); i++) {
        const int x = cells[i].x - from.x, y = cells[i].y - from.y;
        ASSERT_EQ(std::abs(cells[i].x - cells[i - 1].x) + std::abs(cells[i].y - cells[i - 1].y), 1);
        // Less than a cell from the line, measured along the shorter axis.
        ASSERT_LE(std::abs(x * dy - y * dx), std::max(std::abs(dx), std::abs(dy)))
            << dx << " " << dy;
      }
      for (size_t i = 0; i + 1 < cells.size(); i++) ASSERT_FALSE(cells[i] == to);
    }
}

TEST(Edge, DoesNotDependOnWhereItIs) {
  for (int dx = -12; dx <= 12; dx++)
    for (int dy = -12; dy <= 12; dy++) {
      const Cells here = EdgeCells({0, 0}, {dx, dy});
      const int far = (1 << 30) - 20;
      const Cells there = EdgeCells({far, -far}, {far + dx, -far + dy});
      ASSERT_EQ(here.size(), there.size());
      for (size_t i = 0; i < here.size(); i++)
        ASSERT_EQ(there[i], point_int_t(here[i].x + far, here[i].y - far));
    }
}

TEST(Outline, ATriangleHasItsEdges) {
  Cells expected = EdgeCells({0, 0}, {5, 2});
  for (const Cells& edge : {EdgeCells({5, 2}, {3, 6}), EdgeCells({3, 6}, {0, 0})})
    expected.insert(expected.end(), edge.begin(), edge.end());
  EXPECT_EQ(OutlineCells({{0, 0}, {5, 2}, {3, 6}}), expected);
}

TEST(Outline, SquareHasEachBorderCellOnce) {
  EXPECT_EQ(OutlineCells({{0, 0}, {2, 0}, {2, 2}, {0, 2}}),
            (Cells{{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}));
}

TEST(Outline, ABodyWithinOneCellHasThatCell) {
  EXPECT_EQ(OutlineCells({{4, -9}, {4, -9}, {4, -9}, {4, -9}}), (Cells{{4, -9}}));
  EXPECT_EQ(OutlineCells({{4, -9}, {4, -9}, {4, -9}}), (Cells{{4, -9}}));
}

TEST(Outline, LinesAndPointsAreNoBodies) {
  EXPECT_TRUE(OutlineCells({}).empty());
  EXPECT_TRUE(OutlineCells({{1, 1}}).empty());
  EXPECT_TRUE(OutlineCells({{1, 1}, {1, 1}}).empty());
  EXPECT_EQ(OutlineCells({{0, 0}, {2, 0}}), (Cells{{0, 0}, {1, 0}, {2, 0}, {1, 0}}));
}

TEST(Outline, ThinBodyHasEachCellTwice) {
  EXPECT_EQ(OutlineCells({{0, 0}, {3, 0}, {3, 0}, {0, 0}}),
            (Cells{{0, 0}, {1, 0}, {2, 0}, {3, 0}, {2, 0}, {1, 0}}));
}

}  // namespace
}  // namespace Stg::internal::grid
