// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan.hh"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <vector>

#include "grid/grid.hh"
#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr int32_t kOne = 1 << 30;
constexpr double kQ16 = 65536;

// ---- bearings and tables ------------------------------------------------------------------------

TEST(Bearings, BothEndsAreIncluded) {
  for (const double fov : {0.1, M_PI, 2 * M_PI, 4 * M_PI, -1.0})
    for (const uint32_t count : {2u, 3u, 5u, 180u, 181u, 1000u}) {
      EXPECT_DOUBLE_EQ(SampleBearing(fov, count, 0), -fov / 2);
      EXPECT_NEAR(SampleBearing(fov, count, count - 1), fov / 2, 1e-14);
      for (uint32_t i = 1; i < count; i++)
        ASSERT_NEAR(SampleBearing(fov, count, i) - SampleBearing(fov, count, i - 1),
                    fov / (count - 1), 1e-13);
    }
}

TEST(Bearings, ASingleSampleLooksAhead) {
  for (const double fov : {0.0, 1.0, 2 * M_PI, -1.0, kInfinity, kNaN})
    EXPECT_EQ(SampleBearing(fov, 1, 0), 0.0) << fov;
}

TEST(Bearings, NoFieldOfViewLooksAhead) {
  for (uint32_t i = 0; i < 5; i++) EXPECT_EQ(SampleBearing(0.0, 5, i), 0.0);
}

TEST(Directions, QuarterTurnsAreExact) {
  const auto expect = [](double bearing, int32_t cosine, int32_t sine) {
    const Direction d = MakeDirection(bearing);
    EXPECT_EQ(d.cosine, cosine) << bearing;
    EXPECT_EQ(d.sine, sine) << bearing;
  };
  for (const double turns : {-3.0, -1.0, 0.0, 1.0, 2.0}) {
    const double start = turns * 2 * M_PI;
    expect(start, kOne, 0);
    expect(start + M_PI / 2, 0, kOne);
    expect(start + M_PI, -kOne, 0);
    expect(start - M_PI / 2, 0, -kOne);
  }
}

TEST(Directions, AreTheNearestOfTheirLength) {
  test::RandomSource random(1);
  for (int i = 0; i < 100000; i++) {
    const double bearing = random.Real(-10, 10);
    const Direction d = MakeDirection(bearing), mirrored = MakeDirection(-bearing);
    ASSERT_LE(std::fabs(d.cosine - std::cos(bearing) * kOne), 0.501);
    ASSERT_LE(std::fabs(d.sine - std::sin(bearing) * kOne), 0.501);
    ASSERT_EQ(mirrored.cosine, d.cosine);
    ASSERT_EQ(mirrored.sine, -d.sine);
  }
}

TEST(DirectionTables, OneForEachKindOfSensor) {
  DirectionTables tables;
  EXPECT_EQ(tables.Find(0, 1), DirectionTables::kAhead);
  EXPECT_EQ(tables.Find(2.0, 1), DirectionTables::kAhead);
  const uint32_t first = tables.Find(M_PI, 180);
  const uint32_t second = tables.Find(M_PI, 181);
  EXPECT_EQ(first, 1u);
  EXPECT_EQ(second, 181u);
  EXPECT_EQ(tables.Find(2 * M_PI, 180), 362u);
  EXPECT_EQ(tables.Find(M_PI, 180), first);
  EXPECT_EQ(tables.Find(M_PI, 181), second);
  EXPECT_EQ(tables.all().size(), 542u);
  for (uint32_t i = 0; i < 180; i++) {
    const Direction expected = MakeDirection(SampleBearing(M_PI, 180, i));
    EXPECT_EQ(tables.all()[first + i].cosine, expected.cosine);
    EXPECT_EQ(tables.all()[first + i].sine, expected.sine);
  }
  // The first sample points to the right, the last one to the left.
  EXPECT_EQ(tables.all()[first].sine, -kOne);
  EXPECT_EQ(tables.all()[first + 179].sine, kOne);
  EXPECT_EQ(tables.all()[second + 90].sine, 0);
}

TEST(DirectionTables, ANegativeFieldOfViewIsTheReverse) {
  DirectionTables tables;
  const uint32_t forth = tables.Find(1.5, 7), back = tables.Find(-1.5, 7);
  for (uint32_t i = 0; i < 7; i++)
    EXPECT_NEAR(tables.all()[forth + i].sine, tables.all()[back + 6 - i].sine, 1);
}

// ---- places -------------------------------------------------------------------------------------

Fan Placed(const Pose& origin, double range, double ppm = 50) {
  Fan fan;
  PlaceFan(&fan, origin, range, ppm);
  return fan;
}
int32_t FractionX(const Fan& fan) { return static_cast<int32_t>(fan.record.fraction & 0xffff); }
int32_t FractionY(const Fan& fan) { return static_cast<int32_t>(fan.record.fraction >> 16); }

TEST(PlaceFan, AnOrdinaryRange) {
  const Fan fan = Placed(Pose(1.01, -0.015, 0.7, 0), 8);
  EXPECT_FALSE(fan.nothing);
  EXPECT_TRUE(fan.single_leg());
  EXPECT_EQ(fan.record.x, 50);
  EXPECT_EQ(FractionX(fan), 32768);
  EXPECT_EQ(fan.record.y, -1);
  EXPECT_NEAR(FractionY(fan), 16384, 1);
  EXPECT_EQ(fan.z, 0.7);
  EXPECT_EQ(fan.range, 8);
  EXPECT_EQ(fan.leg_length, 8);
  EXPECT_EQ(fan.record.cosine, 400 * 65536);
  EXPECT_EQ(fan.record.sine, 0);
}

TEST(PlaceFan, QuarterTurnsAreExact) {
  const int32_t length = 400 * 65536;
  for (const double turns : {-2.0, 0.0, 1.0}) {
    const double a = turns * 2 * M_PI;
    const auto heading = [&](double add) { return Placed(Pose(0, 0, 0, a + add), 8).record; };
    EXPECT_EQ(heading(M_PI / 2).cosine, 0);
    EXPECT_EQ(heading(M_PI / 2).sine, length);
    EXPECT_EQ(heading(M_PI).cosine, -length);
    EXPECT_EQ(heading(M_PI).sine, 0);
    EXPECT_EQ(heading(-M_PI / 2).cosine, 0);
    EXPECT_EQ(heading(-M_PI / 2).sine, -length);
  }
}

TEST(PlaceFan, TheCellIsTheFloor) {
  test::RandomSource random(2);
  for (int i = 0; i < 100000; i++) {
    const double reach = std::pow(10.0, random.Real(-20, 7));
    const double x = random.Real(-reach, reach), y = random.Real(-reach, reach);
    const Fan fan = Placed(Pose(x, y, 0, 1), 1);
    ASSERT_FALSE(fan.nothing);
    ASSERT_EQ(fan.record.x, std::floor(x * 50));
    ASSERT_EQ(fan.record.y, std::floor(y * 50));
    ASSERT_NEAR(FractionX(fan), (x * 50 - std::floor(x * 50)) * kQ16, 1.0001);
    ASSERT_NEAR(FractionY(fan), (y * 50 - std::floor(y * 50)) * kQ16, 1.0001);
  }
  // The origin is just left of a border: the fraction must not be rounded to a whole cell.
  const Fan fan = Placed(Pose(-1e-18, -1e-300, 0, 0), 1);
  EXPECT_EQ(fan.record.x, -1);
  EXPECT_EQ(FractionX(fan), 65535);
  EXPECT_EQ(fan.record.y, -1);
  EXPECT_EQ(FractionY(fan), 65535);
}

TEST(PlaceFan, LongRangesAreWalkedInEqualLegs) {
  const double longest = RAY_LEG_CELLS / 50.0;  // metres
  EXPECT_TRUE(Placed(Pose(), longest).single_leg());
  EXPECT_EQ(Placed(Pose(), longest).record.cosine, RAY_LEG_CELLS << 16);
  for (const double range : {std::nextafter(longest, 1e9), 400.0, 1000.0, 12345.678, 1e9, 1e300}) {
    const Fan fan = Placed(Pose(0, 0, 0, 0.3), range);
    EXPECT_FALSE(fan.single_leg());
    EXPECT_FALSE(fan.nothing);
    EXPECT_EQ(fan.legs, std::floor(fan.legs));
    EXPECT_GE(fan.legs, 2);
    EXPECT_LE(fan.leg_length, longest);
    EXPECT_GE(fan.leg_length, longest / 2);
    EXPECT_NEAR(fan.legs * fan.leg_length / range, 1, 1e-12);
    EXPECT_EQ(fan.range, range);
    EXPECT_NEAR(std::hypot(fan.record.cosine, fan.record.sine), fan.leg_length * 50 * kQ16, 1.5);
  }
}

TEST(PlaceFan, AnInfiniteRange) {
  for (const double range : {kInfinity, std::numeric_limits<double>::max()}) {
    const Fan fan = Placed(Pose(0, 0, 0, M_PI / 2), range);
    EXPECT_FALSE(fan.nothing);
    EXPECT_FALSE(fan.single_leg());
    EXPECT_TRUE(std::isinf(fan.legs));
    EXPECT_EQ(fan.range, range);
    EXPECT_EQ(fan.record.sine, RAY_LEG_CELLS << 16);
    EXPECT_DOUBLE_EQ(fan.leg_length, RAY_LEG_CELLS / 50.0);
  }
}

TEST(PlaceFan, InvalidRangesAndPosesCastNothing) {
  for (const double range : {0.0, -1.0, kNaN, -kInfinity}) {
    const Fan fan = Placed(Pose(), range);
    EXPECT_TRUE(fan.nothing) << range;
    EXPECT_FALSE(fan.single_leg());
  }
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    EXPECT_TRUE(Placed(Pose(bad, 0, 0, 0), 1).nothing) << bad;
    EXPECT_TRUE(Placed(Pose(0, bad, 0, 0), 1).nothing) << bad;
    EXPECT_TRUE(Placed(Pose(0, 0, 0, bad), 1).nothing) << bad;
  }
  const double edge = grid::kMaxCell / 50.0;
  EXPECT_TRUE(Placed(Pose(edge, 0, 0, 0), 1).nothing);
  EXPECT_TRUE(Placed(Pose(0, -edge, 0, 0), 1).nothing);
  EXPECT_TRUE(Placed(Pose(1e300, 0, 0, 0), 1).nothing);
  EXPECT_FALSE(Placed(Pose(edge - 1, 1 - edge, 0, 0), 1).nothing);
}

TEST(PlaceFan, TinyRangesAreRays) {
  EXPECT_TRUE(Placed(Pose(), 0.001).single_leg());
  EXPECT_TRUE(Placed(Pose(), 1e-300).single_leg());
  EXPECT_EQ(Placed(Pose(), 1e-300).record.cosine, 0);
}

// Tables of sensors that keep changing must not accumulate.
TEST(DirectionTables, UnusedTablesAreDropped) {
  DirectionTables tables;
  for (int step = 1; step < 150; step++) {
    tables.Find(step * 0.01, 100'000);
    tables.Trim();
    ASSERT_LE(tables.all().size(), 4'200'000u) << step;
  }
  EXPECT_GT(tables.generation(), 1u);
}

TEST(DirectionTables, UsedTablesAreKept) {
  DirectionTables tables;
  uint64_t generation = 0;
  for (int step = 0; step < 10; step++) {
    for (int sensor = 1; sensor <= 50; sensor++) tables.Find(sensor * 0.1, 100'000);
    if (step == 2) generation = tables.generation();
    tables.Trim();
  }
  EXPECT_EQ(tables.generation(), generation);
  EXPECT_GE(tables.all().size(), 5'000'000u);
}

}  // namespace
}  // namespace Stg::internal::sensing
