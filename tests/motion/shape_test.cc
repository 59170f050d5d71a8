// SPDX-License-Identifier: GPL-2.0-or-later

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/motion_world.hh"

namespace {

using Stg::motion::ConvexParts;
using Stg::motion::CutConvex;
using test::MotionWorld;
using test::UnitVector;
using test::Vector;

double AreaOf(const Vector* corners, size_t count) {
  double area = 0.0;
  for (size_t i = 0; i < count; i++) area += 0.5 * Cross(corners[i], corners[(i + 1) % count]);
  return area;
}

/// Cuts a polygon, expects convex parts whose areas add up, and returns their number.
size_t Cut(const std::vector<Vector>& polygon) {
  ConvexParts parts;
  EXPECT_TRUE(CutConvex(polygon, &parts));
  double sum = 0.0;
  size_t first = 0;
  for (const uint32_t size : parts.sizes) {
    const Vector* corners = &parts.corners[first];
    for (size_t i = 0; i < size; i++) {
      const Vector a = corners[i], b = corners[(i + 1) % size], c = corners[(i + 2) % size];
      EXPECT_GT(Cross(b - a, c - b), -1e-12);
    }
    sum += AreaOf(corners, size);
    first += size;
  }
  EXPECT_NEAR(sum, std::fabs(AreaOf(polygon.data(), polygon.size())), 1e-9);
  return parts.sizes.size();
}

TEST(Shape, AConvexPolygonIsOnePieceInBothOrders) {
  EXPECT_EQ(Cut({{0, 0}, {2, 0}, {2, 1}, {0, 1}}), 1u);
  EXPECT_EQ(Cut({{0, 0}, {0, 1}, {2, 1}, {2, 0}}), 1u);
  EXPECT_EQ(Cut({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 1}, {0, 1}}), 1u);  // flat and equal corners
  std::vector<Vector> round;
  for (int i = 0; i < 100; i++) round.push_back(UnitVector(i * M_PI / 50.0));
  EXPECT_EQ(Cut(round), 1u);
}

TEST(Shape, ConcavePolygonsAreCutWhateverTheirFirstCorner) {
  std::vector<Vector> zigzag{{0, 0}, {1, 0.2}, {2, 0}, {3, 0.2}, {4, 0},
                             {4, 2}, {3, 1},   {2, 2}, {1, 1}};
  for (size_t i = 0; i < zigzag.size(); i++) {
    EXPECT_LE(Cut(zigzag), 8u);
    std::rotate(zigzag.begin(), zigzag.begin() + 1, zigzag.end());
  }
}

TEST(Shape, ConcavePolygonsAreCutIntoFewConvexPieces) {
  EXPECT_EQ(Cut({{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 2}, {0, 2}}), 2u);  // L
  std::vector<Vector> star;
  for (int i = 0; i < 10; i++)
    star.push_back((i % 2 == 0 ? 1.0 : 0.4) * UnitVector(i * M_PI / 5.0));
  EXPECT_LE(Cut(star), 6u);
  std::vector<Vector> comb{{0, 0}, {21, 0}};
  for (int i = 10; i >= 0; i--) {
    comb.push_back({2.0 * i + 1.0, 3.0});
    comb.push_back({2.0 * i, 3.0});
    if (i > 0) comb.push_back({2.0 * i - 0.1, 1.0});
    if (i > 0) comb.push_back({2.0 * i - 0.9, 1.0});
  }
  EXPECT_LE(Cut(comb), 24u);
}

TEST(Shape, APolygonThatIntersectsItselfGivesItsEdges) {
  ConvexParts parts;
  EXPECT_FALSE(CutConvex(std::vector<Vector>{{0, 0}, {1, 1}, {1, 0}, {0, 1}}, &parts));
  EXPECT_FALSE(CutConvex(std::vector<Vector>{{0, 0}, {1, 1}}, &parts));
  MotionWorld world;
  const uint32_t bow = world.AddPolygon({{0, 0}, {1, 1}, {1, 0}, {0, 1}});
  EXPECT_EQ(world.shapes.shapes[bow].piece_count, 4u);
  EXPECT_NEAR(world.shapes.shapes[bow].bound, std::sqrt(2.0), 1e-12);
}

TEST(Shape, APolygonWithoutSizeIsAPoint) {
  MotionWorld world;
  const std::vector<Vector> at(3, Vector{0.3, 0.4});
  const auto& point = world.shapes.shapes[world.AddPolygon(at)];
  EXPECT_EQ(point.piece_count, 1u);
  EXPECT_EQ(point.corner_count, 1u);
  EXPECT_NEAR(point.bound, 0.5, 1e-12);
  const auto& line = world.shapes.shapes[world.AddPolygon({{0, 0}, {1, 0}, {1, 0}})];
  EXPECT_EQ(line.piece_count, 2u);  // there and back
  EXPECT_EQ(line.arm, 0.5);
}

TEST(Shape, BoundCoreAndArmAreThoseOfTheOutline) {
  MotionWorld world;
  const auto& square = world.shapes.shapes[world.AddRectangle(2.0, 2.0)];
  EXPECT_NEAR(square.bound, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(square.arm, 2.0 * 0.3825978, 1e-3);
  const auto& disc = world.shapes.shapes[world.AddDisc(0.3)];
  EXPECT_EQ(disc.core, 0.0);
  EXPECT_EQ(disc.bound, 0.3);
  EXPECT_NEAR(disc.arm, 0.2, 1e-3);
  const auto& aside = world.shapes.shapes[world.AddDisc(0.3, {0.4, 0.0})];
  EXPECT_EQ(aside.core, 0.4);
  EXPECT_NEAR(aside.bound, 0.7, 1e-12);
}

}  // namespace
