// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compares Stage's trigonometry, which is the same on all machines, with the C library's.

#include "geometry/trigonometry.hh"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/random_source.hh"

namespace Stg {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// The difference in units of the last place of `expected`.
double Ulps(double found, double expected) {
  const double size = std::fabs(expected);
  const double unit = std::nextafter(size, kInfinity) - size;
  return std::fabs(found - expected) / unit;
}

TEST(SinCos, IsTheCLibrarysToALastPlace) {
  test::RandomSource random(1);
  for (int i = 0; i < 100000; i++) {
    const double angle = random.Real(-100, 100);
    EXPECT_LE(Ulps(SinCos(angle).sine, std::sin(angle)), 1) << angle;
    EXPECT_LE(Ulps(SinCos(angle).cosine, std::cos(angle)), 1) << angle;
  }
}

TEST(ArcTangent, IsTheCLibrarysToALastPlace) {
  test::RandomSource random(2);
  for (int i = 0; i < 200000; i++) {
    const double scale = std::pow(10.0, random.Int(-12, 12));
    const double y = random.Real(-1, 1), x = random.Real(-1, 1) * scale;
    EXPECT_LE(Ulps(ArcTangent(y, x), std::atan2(y, x)), 1) << y << " " << x;
  }
}

TEST(ArcTangent, IsExactAlongTheAxesAndDiagonals) {
  for (const double y : {-2.0, -0.0, 0.0, 2.0})
    for (const double x : {-2.0, -0.0, 0.0, 2.0}) {
      const double found = ArcTangent(y, x), expected = std::atan2(y, x);
      EXPECT_EQ(found, expected) << y << " " << x;
      EXPECT_EQ(std::signbit(found), std::signbit(expected)) << y << " " << x;
    }
}

TEST(ArcTangent, IsContinuousWhereTheReductionChanges) {
  for (const double ratio : {0.4375, 0.6875, 1.1875, 2.4375})
    for (const double x : {ratio, std::nextafter(ratio, 0.0)})
      EXPECT_LE(Ulps(ArcTangent(x, 1), std::atan(x)), 1) << x;
}

TEST(Hypotenuse, IsTheCLibrarysToTwoLastPlaces) {
  test::RandomSource random(3);
  for (int i = 0; i < 200000; i++) {
    const double scale = std::pow(10.0, random.Int(-300, 300));
    const double x = random.Real(-1, 1) * scale, y = random.Real(-1, 1) * scale;
    EXPECT_LE(Ulps(Hypotenuse(x, y), std::hypot(x, y)), 2) << x << " " << y;
  }
}

TEST(Hypotenuse, OfExtremes) {
  EXPECT_EQ(Hypotenuse(3, -4), 5);
  EXPECT_EQ(Hypotenuse(0, -0.0), 0);
  EXPECT_DOUBLE_EQ(Hypotenuse(-3e200, 4e200), 5e200);
  EXPECT_EQ(Hypotenuse(3e-200, 0), 3e-200);
  EXPECT_EQ(Hypotenuse(kInfinity, kNaN), kInfinity);
  EXPECT_LT(Hypotenuse(1e308, -1e308), kInfinity);
  EXPECT_TRUE(std::isnan(Hypotenuse(kNaN, 1)));
  EXPECT_TRUE(std::isnan(Hypotenuse(0, kNaN)));
}

TEST(ArcTangent, OfExtremes) {
  EXPECT_EQ(ArcTangent(1, kInfinity), 0);
  EXPECT_EQ(ArcTangent(1, -kInfinity), M_PI);
  EXPECT_EQ(ArcTangent(-1, -kInfinity), -M_PI);
  EXPECT_EQ(ArcTangent(kInfinity, 1), M_PI / 2);
  EXPECT_EQ(ArcTangent(1e300, 1e-300), M_PI / 2);
  EXPECT_EQ(ArcTangent(5e-324, 1), 5e-324);
  EXPECT_TRUE(std::isnan(ArcTangent(kInfinity, kInfinity)));
  EXPECT_TRUE(std::isnan(ArcTangent(kNaN, 1)));
  EXPECT_TRUE(std::isnan(ArcTangent(1, kNaN)));
  EXPECT_TRUE(std::isnan(ArcTangent(0, kNaN)));
}

}  // namespace
}  // namespace Stg
