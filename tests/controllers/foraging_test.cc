// SPDX-License-Identifier: GPL-2.0-or-later
// Navigation of the foraging controllers, without a world.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "examples/ctrl/support/fasr_tables.hh"
#include "examples/ctrl/support/path_planner.hh"

namespace Stg {
namespace {

// ---- fasr's tables

TEST(FasrTablesTest, SquaresCoverTheWorldAndWhatIsOutside) {
  EXPECT_EQ(ctrl::SquareOf(-8), 0u);
  EXPECT_EQ(ctrl::SquareOf(-4.01), 0u);
  EXPECT_EQ(ctrl::SquareOf(-4), 1u);
  EXPECT_EQ(ctrl::SquareOf(3.99), 2u);
  EXPECT_EQ(ctrl::SquareOf(4), 3u);
  EXPECT_EQ(ctrl::SquareOf(-100), 0u);
  EXPECT_EQ(ctrl::SquareOf(100), 3u);
}

TEST(FasrTablesTest, HeadingsAreByErrandThenRowThenColumn) {
  using ctrl::Errand;
  EXPECT_EQ(ctrl::HeadingFor(Errand::kDeliver, -7, -7), dtor(90));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kDeliver, -1, -3), dtor(-90));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kDeliver, -3, 7), dtor(45));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kFetch, -7, -7), dtor(-120));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kFetch, 7, -1), dtor(90));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kRefuel, 7, -7), dtor(120));
  EXPECT_EQ(ctrl::HeadingFor(Errand::kRefuel, 7, -3), dtor(-160));
}

// ---- fasr2's planner

/// A map of 32 m x 32 m with a wall of cells at x = 16 from row 0 to `top`.
ctrl::PathPlanner Walled(int top) {
  std::vector<uint8_t> occupied(32 * 32, 0);
  for (size_t row = 0; row <= static_cast<size_t>(top); row++) occupied[row * 32 + 16] = 1;
  return ctrl::PathPlanner(occupied, 32, 32);
}

Pose At(double x, double y) { return Pose(x, y, 0, 0); }

TEST(PathPlannerTest, CellsAndTheirCentres) {
  const ctrl::PathPlanner planner(std::vector<uint8_t>(1024, 0), 64, 32);
  EXPECT_EQ(planner.CellOf(-32, -16), (ctrl::MapCell{0, 0}));
  EXPECT_EQ(planner.CellOf(31.9, 15.9), (ctrl::MapCell{31, 31}));
  EXPECT_EQ(planner.CellOf(0, 0), (ctrl::MapCell{16, 16}));
  EXPECT_EQ(planner.CentreOf({16, 16}), point_t(1, 0.5));
  EXPECT_FALSE(planner.CellOf(1e30, -1e30).InMap());
}

TEST(PathPlannerTest, GoesFromTheGoalBackToTheStartCellByCell) {
  ctrl::PathPlanner planner = Walled(20);
  const ctrl::Path& path = *planner.Plan(At(-5.5, -5.5), At(5.5, -5.5));
  ASSERT_EQ(path.size(), 1u + 11 + 2 * 11) << "eleven columns, and up and down to row 21";
  EXPECT_EQ(path.front(), point_t(5.5, -5.5));
  EXPECT_EQ(path.back(), point_t(-5.5, -5.5));
  for (size_t i = 1; i < path.size(); i++) {
    EXPECT_EQ(std::fabs(path[i].x - path[i - 1].x) + std::fabs(path[i].y - path[i - 1].y), 1);
    EXPECT_FALSE(path[i].x == 0.5 && path[i].y < 5) << "through the wall";
  }
}

TEST(PathPlannerTest, CachesPlans) {
  ctrl::PathPlanner planner = Walled(20);
  const ctrl::Path* path = planner.Plan(At(-5.5, -5.5), At(5.5, -5.5));
  EXPECT_EQ(planner.Plan(At(-5.9, -5.1), At(5.1, -5.9)), path) << "the same cells";
  EXPECT_NE(planner.Plan(At(-4.5, -5.5), At(5.5, -5.5)), path);
}

TEST(PathPlannerTest, ReturnsNoPathIfTheGoalIsUnreachable) {
  ctrl::PathPlanner closed = Walled(31);
  EXPECT_TRUE(closed.Plan(At(-5, -5), At(5, -5))->empty());
  ctrl::PathPlanner open = Walled(20);
  EXPECT_TRUE(open.Plan(At(-5, -5), At(0.5, -5))->empty()) << "a goal in the wall";
  EXPECT_TRUE(open.Plan(At(-5, -5), At(50, -5))->empty()) << "a goal outside";
  EXPECT_TRUE(open.Plan(At(50, -5), At(5, -5))->empty()) << "a start outside";
  EXPECT_FALSE(open.Plan(At(0.5, -5), At(5, -5))->empty()) << "a start in the wall";
  EXPECT_EQ(open.Plan(At(5, 5), At(5, 5))->size(), 1u);
}

TEST(PathPlannerTest, DirectionIsTheFarthestInSightAlongThePathAndALittleToTheLeft) {
  const ctrl::Path path{{10, 0}, {4, 0}, {0, 4}, {0, 0}};
  EXPECT_NEAR(*ctrl::DirectionAlong(path, At(0, 0)), 0.25, 1e-12);
  EXPECT_NEAR(*ctrl::DirectionAlong(path, At(-2, 0)), std::atan2(4, 2) + 0.25, 1e-12);
  EXPECT_NEAR(*ctrl::DirectionAlong(path, At(10, -4)), M_PI / 2 + 0.25, 1e-12);
  EXPECT_NEAR(*ctrl::DirectionAlong(path, At(14.9, 0.0)), M_PI + 0.25 - 2 * M_PI, 1e-12);
  EXPECT_FALSE(ctrl::DirectionAlong(path, At(15, 0))) << "5 m is out of sight";
  EXPECT_FALSE(ctrl::DirectionAlong({}, At(0, 0)));
}

}  // namespace
}  // namespace Stg
