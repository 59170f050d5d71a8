// SPDX-License-Identifier: GPL-2.0-or-later
//
// Angles, poses, and sine and cosine with the same results on all machines.

#include "geometry/geometry.hh"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "geometry/trigonometry.hh"
#include "random/fnv1a.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using test::RandomSource;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// ---- sine and cosine ----------------------------------------------------------------------------

/// The error of a result in units of the last place of the exact value.
double ErrorInUlps(double result, long double exact) {
  const double nearest = static_cast<double>(exact);
  const double ulp = std::nextafter(std::fabs(nearest), kInfinity) - std::fabs(nearest);
  return static_cast<double>(std::fabs(static_cast<long double>(result) - exact) /
                             static_cast<long double>(ulp));
}

double WorstError(double angle) {
  const SineCosine found = SinCos(angle);
  return std::max(ErrorInUlps(found.sine, std::sin(static_cast<long double>(angle))),
                  ErrorInUlps(found.cosine, std::cos(static_cast<long double>(angle))));
}

TEST(SinCos, LessThanOneUlpOff) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is too short";
  RandomSource random(1);
  for (const double reach : {0.8, 4.0, 100.0, 1e4, 1e6})
    for (int i = 0; i < 200000; i++) {
      const double angle = random.Real(-reach, reach);
      ASSERT_LT(WorstError(angle), 1.0) << "at " << angle;
    }
}

TEST(SinCos, LessThanOneUlpOffAroundQuarterTurns) {
  if (std::numeric_limits<long double>::digits < 64) GTEST_SKIP() << "long double is too short";
  for (int n = -636000; n <= 636000; n += n > -3000 && n < 3000 ? 1 : 97) {
    double angle = static_cast<double>(n) * (M_PI / 2);
    ASSERT_LT(WorstError(angle), 1.0) << "at " << n << " quarter turns";
    ASSERT_LT(WorstError(std::nextafter(angle, kInfinity)), 1.0) << n;
    ASSERT_LT(WorstError(std::nextafter(angle, -kInfinity)), 1.0) << n;
    angle = static_cast<double>(n) * (M_PI / 4);
    if (std::fabs(angle) < 1e6) {
      ASSERT_LT(WorstError(angle), 1.0) << n;
    }
  }
}

TEST(SinCos, TinyAngles) {
  for (double angle = 1; angle > 0; angle *= 0.37) {
    ASSERT_LT(WorstError(angle), 1.0) << angle;
    if (angle < 1e-8) {
      ASSERT_EQ(SinCos(angle).sine, angle);
      ASSERT_EQ(SinCos(angle).cosine, 1.0);
    }
  }
}

TEST(SinCos, KnownValues) {
  EXPECT_EQ(SinCos(0).sine, 0.0);
  EXPECT_EQ(SinCos(0).cosine, 1.0);
  EXPECT_EQ(SinCos(M_PI / 2).sine, 1.0);
  EXPECT_EQ(SinCos(-M_PI / 2).sine, -1.0);
  EXPECT_EQ(SinCos(M_PI).cosine, -1.0);
  EXPECT_LT(std::fabs(SinCos(M_PI / 2).cosine), 1e-16);
  EXPECT_LT(std::fabs(SinCos(M_PI).sine), 2e-16);
}

TEST(SinCos, IsSymmetric) {
  RandomSource random(2);
  for (int i = 0; i < 200000; i++) {
    const double angle = random.Real(-1, 1) * std::pow(10.0, random.Real(-10, 12));
    const SineCosine there = SinCos(angle), back = SinCos(-angle);
    ASSERT_EQ(there.cosine, back.cosine) << angle;
    ASSERT_EQ(there.sine, -back.sine) << angle;
  }
  // The borders of quadrants, approached from both sides.
  for (const double angle : {M_PI / 4, 3 * M_PI / 4, 5 * M_PI / 4, 1001 * M_PI / 4}) {
    EXPECT_EQ(SinCos(angle).cosine, SinCos(-angle).cosine);
    EXPECT_EQ(SinCos(angle).sine, -SinCos(-angle).sine);
  }
}

TEST(SinCos, StaysOnTheCircle) {
  RandomSource random(3);
  for (int i = 0; i < 200000; i++) {
    const double angle = random.Real(-1, 1) * std::pow(10.0, random.Real(-10, 300));
    const SineCosine turn = SinCos(angle);
    ASSERT_LE(std::fabs(turn.sine), 1.0);
    ASSERT_LE(std::fabs(turn.cosine), 1.0);
    ASSERT_NEAR(turn.sine * turn.sine + turn.cosine * turn.cosine, 1.0, 1e-15) << angle;
  }
}

TEST(SinCos, NonFiniteAnglesGiveNaN) {
  for (const double angle : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_TRUE(std::isnan(SinCos(angle).sine));
    EXPECT_TRUE(std::isnan(SinCos(angle).cosine));
  }
}

// The bits of the results are the same on every processor and with every compiler.
TEST(SinCos, SameBitsEverywhere) {
  uint64_t hash = kFnv1aStart;
  RandomSource random(4);
  for (int i = 0; i < 100000; i++) {
    const SineCosine turn = SinCos(random.Real(-1000, 1000));
    for (const double value : {turn.sine, turn.cosine})
      hash = Fnv1aStep(hash, std::bit_cast<uint64_t>(value));
  }
  EXPECT_EQ(hash, 2657029608358269676u);
}

// ---- angles -------------------------------------------------------------------------------------

TEST(Normalize, KeepsAnglesInRange) {
  RandomSource random(5);
  for (int i = 0; i < 100000; i++) {
    const double a = random.Real(-M_PI, M_PI);
    ASSERT_EQ(std::bit_cast<uint64_t>(normalize(a)), std::bit_cast<uint64_t>(a));
  }
  for (const double a : {M_PI, -M_PI, 0.0, -0.0, 5e-324})
    EXPECT_EQ(std::bit_cast<uint64_t>(normalize(a)), std::bit_cast<uint64_t>(a));
}

TEST(Normalize, EndsInRangeAtTheSameAngle) {
  RandomSource random(6);
  for (int i = 0; i < 200000; i++) {
    const double a = random.Real(-1, 1) * std::pow(10.0, random.Real(0, 5));
    const double n = normalize(a);
    ASSERT_TRUE(n >= -M_PI && n <= M_PI) << a;
    const double turns = (a - n) / (2 * M_PI);
    ASSERT_NEAR(turns, std::round(turns), 1e-9) << a;
  }
}

TEST(Normalize, AroundWholeAndHalfTurns) {
  for (int n = -20; n <= 20; n++)
    for (const double start : {n * M_PI, n * M_PI / 2}) {
      double up = start, down = start;
      for (int i = 0; i < 5; i++) {
        for (const double a : {up, down}) {
          EXPECT_LE(std::fabs(normalize(a)), M_PI) << n << " " << i;
          EXPECT_NEAR(std::sin(normalize(a)), std::sin(a), 1e-13);
          EXPECT_NEAR(std::cos(normalize(a)), std::cos(a), 1e-13);
        }
        up = std::nextafter(up, kInfinity);
        down = std::nextafter(down, -kInfinity);
      }
    }
  // Less than one turn out of range: the result must equal a single subtraction.
  EXPECT_EQ(normalize(4.0), 4.0 - 2 * M_PI);
  EXPECT_EQ(normalize(-4.0), -4.0 + 2 * M_PI);
}

TEST(Normalize, TerminatesForEveryArgument) {
  for (const double a : {1e10, 1e16, 1e100, std::numeric_limits<double>::max()}) {
    EXPECT_LE(std::fabs(normalize(a)), M_PI);
    EXPECT_LE(std::fabs(normalize(-a)), M_PI);
  }
  for (const double a : {kInfinity, -kInfinity, kNaN}) EXPECT_TRUE(std::isnan(normalize(a)));
}

TEST(Angles, DegreesAndRadians) {
  EXPECT_DOUBLE_EQ(dtor(180), M_PI);
  EXPECT_DOUBLE_EQ(rtod(M_PI / 2), 90);
  EXPECT_DOUBLE_EQ(rtod(dtor(12.345)), 12.345);
}

TEST(Numbers, SignAndBounds) {
  EXPECT_EQ(sgn(-5), -1);
  EXPECT_EQ(sgn(0), 1);
  EXPECT_EQ(sgn(7), 1);
  EXPECT_EQ(sgn(-0.1), -1.0);
  EXPECT_EQ(sgn(0.0), 1.0);
  EXPECT_EQ(constrain(5, 0, 3), 3);
  EXPECT_EQ(constrain(-5, 0, 3), 0);
  EXPECT_EQ(constrain(2, 0, 3), 2);
  EXPECT_TRUE(std::isnan(constrain(kNaN, 0, 3)));
  EXPECT_EQ(Bounds(1, 2).Constrain(9), 2);
}

// ---- poses --------------------------------------------------------------------------------------

TEST(Pose, Defaults) {
  EXPECT_TRUE(Pose().IsZero());
  EXPECT_EQ(Size().x, 0.4);
  EXPECT_EQ(Size().y, 0.4);
  EXPECT_EQ(Size().z, 1.0);
  Pose pose(1, 2, 3, 4);
  EXPECT_FALSE(pose.IsZero());
  pose.Zero();
  EXPECT_TRUE(pose.IsZero());
}

TEST(Pose, AdditionIsAChangeOfFrame) {
  const Pose frame(10, 20, 1, M_PI / 2);
  const Pose sum = frame + Pose(3, 1, 0.5, M_PI);
  EXPECT_NEAR(sum.x, 9, 1e-12);
  EXPECT_NEAR(sum.y, 23, 1e-12);
  EXPECT_EQ(sum.z, 1.5);
  EXPECT_NEAR(sum.a, -M_PI / 2, 1e-12);
  const Pose p(1.25, -7, 2, 0.3);
  EXPECT_EQ(Pose() + p, p);
  EXPECT_EQ(p + Pose(), p);
}

TEST(Pose, AdditionIsAssociative) {
  RandomSource random(7);
  const auto pose = [&] {
    return Pose(random.Real(-9, 9), random.Real(-9, 9), random.Real(-9, 9), random.Real(-3, 3));
  };
  for (int i = 0; i < 1000; i++) {
    const Pose a = pose(), b = pose(), c = pose();
    const Pose left = (a + b) + c, right = a + (b + c);
    EXPECT_NEAR(left.x, right.x, 1e-12);
    EXPECT_NEAR(left.y, right.y, 1e-12);
    EXPECT_NEAR(left.z, right.z, 1e-12);
    EXPECT_NEAR(normalize(left.a - right.a), 0, 1e-12);
  }
}

TEST(Pose, Comparisons) {
  EXPECT_LT(Pose(1, 0, 9, 9), Pose(0, -2, 0, 0));
  EXPECT_FALSE(Pose(0, 2, 0, 0) < Pose(2, 0, 0, 0));
  EXPECT_NE(Pose(1, 2, 3, 4), Pose(1, 2, 3, 5));
  EXPECT_DOUBLE_EQ(Pose(1, 2, 3, 4).Distance(Pose(4, 6, 99, 0)), 5.0);
}

TEST(Pose, AsText) {
  EXPECT_EQ(Pose(1, -2.5, 0.0004, 3.14159).String(), "[ 1.000 -2.500 0.000 3.142 ]");
  EXPECT_FALSE(Pose(1e300, 1e300, 1e300, 0).String().empty());
}

TEST(Pose, RandomPosesStayInTheirRectangle) {
  double low = 9, high = -9;
  for (int i = 0; i < 1000; i++) {
    const Pose p = Pose::Random(-2, 3, 5, 6);
    ASSERT_TRUE(p.x >= -2 && p.x <= 3 && p.y >= 5 && p.y <= 6);
    ASSERT_EQ(p.z, 0);
    ASSERT_LE(std::fabs(p.a), M_PI);
    low = std::min(low, p.a);
    high = std::max(high, p.a);
  }
  EXPECT_LT(low, -2.5);
  EXPECT_GT(high, 2.5);
}

TEST(Points, AreOrderedByXThenY) {
  EXPECT_LT(point_t(1, 9), point_t(2, 0));
  EXPECT_LT(point_t(1, 1), point_t(1, 2));
  EXPECT_LT(point_int_t(-1, 9), point_int_t(0, 0));
  EXPECT_FALSE(point_int_t(0, 0) < point_int_t(0, 0));
  point_t p(1, 2);
  p += point_t(3, 4);
  EXPECT_EQ(p, point_t(4, 6));
}

}  // namespace
}  // namespace Stg
