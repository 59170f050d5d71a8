// SPDX-License-Identifier: GPL-2.0-or-later
//
// Outlines of the area reached by rays: few points, without visible loss of detail.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "gui/draw/fan_polyline.hh"
#include "support/random_source.hh"

namespace Stg::draw {
namespace {

constexpr double kEver = 100;  // metres, larger than all ranges here

std::vector<double> Bearings(size_t count, double fov) {
  std::vector<double> bearings;
  for (size_t i = 0; i < count; i++)
    bearings.push_back(fov * (static_cast<double>(i) / static_cast<double>(count - 1) - 0.5));
  return bearings;
}

std::vector<RayEnd> Outline(const std::vector<double>& ranges, double fov, double tolerance,
                            double longest = kEver) {
  std::vector<RayEnd> ray_ends = {{7, 7}};  // belongs to another sensor
  const Directions directions = DirectionsOf(Bearings(ranges.size(), fov));
  const size_t count = AppendSimplified(ranges, directions, static_cast<float>(longest),
                                        static_cast<float>(tolerance), &ray_ends);
  EXPECT_EQ(count + 1, ray_ends.size());
  EXPECT_EQ(ray_ends[0].x, 7);
  ray_ends.erase(ray_ends.begin());
  return ray_ends;
}

double DistanceTo(const RayEnd& a, const RayEnd& b, const RayEnd& point) {
  const double x = b.x - a.x, y = b.y - a.y, px = point.x - a.x, py = point.y - a.y;
  const double square = x * x + y * y;
  const double share = square > 0 ? std::clamp((px * x + py * y) / square, 0.0, 1.0) : 0;
  return std::hypot(px - share * x, py - share * y);
}

/// True if the outline consists of ray end points, from the first to the last, and passes all of
/// them in order, within the tolerance.
bool StandsFor(const std::vector<RayEnd>& outline, const std::vector<double>& ranges, double fov,
               double tolerance) {
  const Directions directions = DirectionsOf(Bearings(ranges.size(), fov));
  size_t line = 0, found = 0;
  for (size_t i = 0; i < ranges.size(); i++) {
    const auto range = static_cast<float>(ranges[i]);
    const RayEnd point{range * directions.x[i], range * directions.y[i]};
    const auto off = [&] { return DistanceTo(outline[line], outline[line + 1], point); };
    while (line + 2 < outline.size() && off() > tolerance) line++;
    if (off() > tolerance) return false;
    if (found < outline.size() && point.x == outline[found].x && point.y == outline[found].y)
      found++;
  }
  return found == outline.size();
}

TEST(FanOutline, AWallIsALine) {
  std::vector<double> ranges;
  for (const double bearing : Bearings(181, M_PI / 2)) ranges.push_back(3 / std::cos(bearing));
  const std::vector<RayEnd> outline = Outline(ranges, M_PI / 2, 0.001);
  ASSERT_EQ(outline.size(), 2u);
  EXPECT_NEAR(outline[0].y, -3, 1e-5);
  EXPECT_NEAR(outline[1].x, 3, 1e-5);
  EXPECT_NEAR(outline[1].y, 3, 1e-5);
}

TEST(FanOutline, KeepsProtrudingPoints) {
  // One ray passes through a narrow door, so the outline goes along a line and back.
  std::vector<double> ranges(5, 2.0);
  ranges[2] = 6;
  const std::vector<RayEnd> outline = Outline(ranges, 1e-6, 0.01);
  EXPECT_TRUE(
      std::any_of(outline.begin(), outline.end(), [](const RayEnd& t) { return t.x > 5.9f; }));
}

TEST(FanOutline, HasFewerPointsAtSmallerScale) {
  const std::vector<double> ranges(361, 5.0);
  const size_t near = Outline(ranges, 2 * M_PI, 0.001).size();
  const size_t far = Outline(ranges, 2 * M_PI, 0.05).size();
  EXPECT_GT(near, 100u);
  EXPECT_LT(far, 50u);
  EXPECT_GT(far, 20u);
}

TEST(FanOutline, StaysWithinTheTolerance) {
  test::RandomSource random(5);
  for (int time = 0; time < 3000; time++) {
    const size_t count = static_cast<size_t>(random.Int(2, 400));
    const double fov = random.Pick<double>({0.001, 1, M_PI, 2 * M_PI});
    const double tolerance = random.Pick<double>({0, 0.001, 0.02, 0.3});
    std::vector<double> ranges(count);
    double range = random.Real(0, 8);
    for (double& r : ranges) {
      if (random.OneIn(20)) range = random.OneIn(5) ? 0 : random.Real(0, 8);
      range = std::max(range + random.Real(-0.01, 0.01) * random.Int(0, 1), 0.0);
      r = range;
    }
    const std::vector<RayEnd> outline = Outline(ranges, fov, tolerance);
    ASSERT_LE(outline.size(), count);
    ASSERT_TRUE(StandsFor(outline, ranges, fov, tolerance + 1e-5)) << time;
  }
}

TEST(FanOutline, ClampsInfiniteRanges) {
  const std::vector<double> ranges(3, std::numeric_limits<double>::infinity());
  for (const RayEnd& tip : Outline(ranges, 1, 0, 9)) EXPECT_NEAR(std::hypot(tip.x, tip.y), 9, 1e-5);
}

TEST(FanOutline, HandlesOneRayAndNoRays) {
  EXPECT_EQ(AppendSimplified({}, {}, 1, 0.1f, nullptr), 0u);
  std::vector<RayEnd> ray_ends;
  EXPECT_EQ(AppendSimplified({2}, {{1}, {0}}, 5, 0.1f, &ray_ends), 1u);
  EXPECT_EQ(ray_ends[0].x, 2);
}

}  // namespace
}  // namespace Stg::draw
