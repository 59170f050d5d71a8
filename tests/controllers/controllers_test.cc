// SPDX-License-Identifier: GPL-2.0-or-later
// The decisions of the stock controllers, separately and in whole runs.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "examples/ctrl/support/arguments.hh"
#include "examples/ctrl/support/disperse_rule.hh"
#include "examples/ctrl/support/expand_rule.hh"
#include "examples/ctrl/support/obstacle_rule.hh"
#include "stage.hh"

namespace {

using ctrl::AvoidObstacles;
using ctrl::Disperse;
using ctrl::DisperseRule;
using ctrl::Drive;
using ctrl::ObstacleRule;
using ctrl::ObstacleState;
using ctrl::RayTable;
using ctrl::Surroundings;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// ---- arguments

std::string ReadTwo(const std::string& text, double* speed, double* gain) {
  return ctrl::ReadArguments(text, {{"speed", speed, 0, 10}, {"gain", gain, -1, 1}});
}

TEST(ArgumentsTest, SplitsAtBlanksAndTabs) {
  EXPECT_EQ(ctrl::SplitWords(" \tone two\t\tthree  "),
            (std::vector<std::string>{"one", "two", "three"}));
  EXPECT_TRUE(ctrl::SplitWords(" \t ").empty());
  EXPECT_TRUE(ctrl::SplitWords("").empty());
}

TEST(ArgumentsTest, ReadsGivenValuesAndKeepsDefaults) {
  double speed = 0.4, gain = 0.5;
  EXPECT_EQ(ReadTwo("disperse", &speed, &gain), "");
  EXPECT_EQ(speed, 0.4);
  EXPECT_EQ(ReadTwo("disperse\tgain=-0.25  ", &speed, &gain), "");
  EXPECT_EQ(speed, 0.4);
  EXPECT_EQ(gain, -0.25);
  EXPECT_EQ(ReadTwo("disperse speed=1 gain=1e-1", &speed, &gain), "");
  EXPECT_EQ(speed, 1.0);
  EXPECT_EQ(gain, 0.1);
}

TEST(ArgumentsTest, RefusesUnknownArguments) {
  double speed = 0.4, gain = 0.5;
  EXPECT_EQ(ReadTwo("d sped=1", &speed, &gain),
            "found the argument \"sped=1\", expected speed=NUMBER, gain=NUMBER");
  for (const char* bad : {"d speed", "d 0.4", "d =1", "d spee=1", "d speeds=1"})
    EXPECT_NE(ReadTwo(bad, &speed, &gain), "") << bad;
  EXPECT_EQ(speed, 0.4);
}

TEST(ArgumentsTest, RefusesNumbersOutOfRange) {
  double speed = 0.4, gain = 0.5;
  EXPECT_EQ(ReadTwo("d speed=fast", &speed, &gain),
            "found \"speed=fast\", expected a number from 0.000000 to 10.000000");
  for (const char* bad :
       {"d speed=", "d speed=1m", "d speed=nan", "d speed=inf", "d speed=-0.1", "d speed=11",
        "d speed=1=2", "d speed=+1", "d speed=0x1", "d speed=1e", "d speed=1e999"})
    EXPECT_NE(ReadTwo(bad, &speed, &gain), "") << bad;
  EXPECT_EQ(speed, 0.4);
}

// ---- wander

/// Calls the rule with a fixed random number.
std::optional<ctrl::ObstacleCommand> Avoid(const std::vector<double>& ranges, ObstacleState* state,
                                           unsigned random_number = 3) {
  return AvoidObstacles(ranges, ObstacleRule(), state,
                        [=](unsigned choices) { return random_number % choices; });
}

/// Nine ranges of 5 m, except one.
std::vector<double> NineWith(size_t index, double range) {
  std::vector<double> ranges(9, 5.0);
  ranges[index] = range;
  return ranges;
}

TEST(WanderTest, DoesNothingWithoutRanges) {
  ObstacleState state;
  EXPECT_FALSE(Avoid({}, &state));
}

TEST(WanderTest, CruisesOnAFreePath) {
  ObstacleState state;
  const auto command = Avoid(std::vector<double>(9, 1.0), &state);
  EXPECT_EQ(command->forward, 0.4);
  EXPECT_EQ(command->turn, 0.0);
  EXPECT_FALSE(command->avoiding);
}

TEST(WanderTest, OnlyTheMiddleThirdIsAhead) {
  // With nine samples, the middle third is strictly between 3 and 6: samples 4 and 5.
  for (size_t i = 0; i < 9; i++) {
    ObstacleState state;
    EXPECT_EQ(Avoid(NineWith(i, 0.99), &state)->avoiding, i == 4 || i == 5) << i;
  }
}

TEST(WanderTest, StopsForVeryNearObstacles) {
  for (size_t i = 0; i < 9; i++) {
    ObstacleState state;
    const auto command = Avoid(NineWith(i, 0.29), &state);
    EXPECT_TRUE(command->avoiding) << i;
    EXPECT_EQ(command->forward, 0.0) << i;
  }
  ObstacleState state;
  EXPECT_EQ(Avoid(NineWith(4, 0.3), &state)->forward, 0.05);
}

TEST(WanderTest, TurnsToTheFreerSide) {
  // The middle sample is part of the right half.
  for (size_t i = 0; i < 9; i++) {
    ObstacleState state;
    EXPECT_EQ(Avoid(NineWith(i, 0.2), &state)->turn, i > 4 ? -0.5 : 0.5) << i;
  }
  ObstacleState state;
  EXPECT_EQ(Avoid(std::vector<double>(9, 0.5), &state)->turn, 0.5) << "a tie: left";
}

TEST(WanderTest, KeepsTurningForTenUpdatesAndTheRandomNumberModuloTen) {
  ObstacleState state;
  EXPECT_EQ(Avoid(NineWith(5, 0.5), &state, 1003)->turn, -0.5);
  const std::vector<double> free(9, 5.0);
  for (int i = 1; i < 13; i++) {
    const auto command = Avoid(free, &state);
    EXPECT_TRUE(command->avoiding) << i;
    EXPECT_EQ(command->forward, 0.05) << i;
    EXPECT_FALSE(command->turn) << i;
  }
  EXPECT_FALSE(Avoid(free, &state)->avoiding);
}

TEST(WanderTest, KeepsTheSideUntilTheTurnIsOver) {
  ObstacleState state;
  EXPECT_EQ(Avoid(NineWith(5, 0.5), &state, 0)->turn, -0.5);
  for (int i = 1; i < 10; i++) EXPECT_FALSE(Avoid(NineWith(4, 0.5), &state, 0)->turn) << i;
  EXPECT_EQ(Avoid(NineWith(4, 0.5), &state, 0)->turn, 0.5) << "still blocked: a new turn";
}

// ---- expand

/// A ring of single rays, evenly spaced, starting straight ahead.
ctrl::Sensors Ring(const std::vector<double>& readings) {
  ctrl::Sensors sensors(readings.size());
  for (size_t i = 0; i < readings.size(); i++) {
    const double share = static_cast<double>(i) / static_cast<double>(readings.size());
    sensors[i].pose.a = Stg::normalize(2 * M_PI * share);
    sensors[i].ranges = {readings[i]};
  }
  return sensors;
}

constexpr ctrl::Clearance kAhead[] = {{0, 0.5}};
const ctrl::ExpandRule kExpandRule{0.3, kAhead};

TEST(ExpandTest, SumsReadingsAsVectors) {
  const Stg::point_t sum = ctrl::OpenSpace(Ring({3, 4, 1, 2}));
  EXPECT_NEAR(sum.x, 2, 1e-12);
  EXPECT_NEAR(sum.y, 2, 1e-12);
}

TEST(ExpandTest, TurnsToOpenSpace) {
  const auto drive = ctrl::Expand(Ring({3, 4, 1, 2}), kExpandRule);
  ASSERT_TRUE(drive);
  EXPECT_NEAR(drive->turn, M_PI / 4, 1e-12);
  EXPECT_EQ(drive->forward, 0) << "more than half a radian to the side";
}

TEST(ExpandTest, DrivesIfAllAheadIsClear) {
  EXPECT_EQ(ctrl::Expand(Ring({0.51, 0.2, 0.1, 0.1}), kExpandRule)->forward, 0.3);
  EXPECT_EQ(ctrl::Expand(Ring({0.5, 0.2, 0.1, 0.1}), kExpandRule)->forward, 0);
}

TEST(ExpandTest, DoesNothingIfTheSumLiesOnAnAxis) {
  EXPECT_FALSE(ctrl::Expand(Ring({2}), kExpandRule));
  EXPECT_FALSE(ctrl::Expand(Ring({0, 0, 0, 0}), kExpandRule));
}

TEST(ExpandTest, ASensorWithoutDataReadsNothing) {
  ctrl::Sensors sensors = Ring({2, 1, 1, 0});
  sensors[0].ranges.clear();
  EXPECT_EQ(ctrl::Expand(sensors, kExpandRule)->forward, 0);
  EXPECT_NEAR(ctrl::OpenSpace(sensors).x, -1, 1e-12);
}

// ---- disperse

constexpr double kRadius = 0.25;

/// Bearings of a laser's rays, radians; `fov` in degrees.
std::vector<double> Bearings(double fov, size_t count) {
  std::vector<double> bearings(count, 0.0);
  for (size_t i = 0; count > 1 && i < count; i++)
    bearings[i] = Stg::dtor(fov) * (static_cast<double>(i) / static_cast<double>(count - 1) - 0.5);
  return bearings;
}

Surroundings Look(const RayTable& table, const std::vector<double>& ranges, double cap = 8) {
  Surroundings seen;
  ctrl::AddReadings(table, ranges.data(), cap, &seen);
  ctrl::LimitFreePath(table, ranges.data(), {0, 0, kRadius}, &seen);
  return seen;
}

/// An obstacle in front of a laser: range (metres) between two bearings (degrees).
struct Obstacle {
  double from, to, range;
};

Drive DriveWith(double fov, size_t count, const Obstacle& obstacle, double mount = 0) {
  const std::vector<double> bearings = Bearings(fov, count);
  std::vector<double> ranges(count, 8.0);
  for (size_t i = 0; i < count; i++) {
    const double degrees = Stg::rtod(bearings[i]);
    if (degrees >= obstacle.from && degrees <= obstacle.to) ranges[i] = obstacle.range;
  }
  return Disperse(Look(RayTable(mount, bearings), ranges), kRadius, DisperseRule());
}

TEST(DisperseTest, KeepsTheNearestReadingOfEachSector) {
  for (size_t count = 0; count < 80; count += 7) {
    const std::vector<double> bearings = Bearings(100, count);
    const RayTable table(0.3, bearings);
    std::vector<double> ranges;
    for (size_t i = 0; i < count; i++) ranges.push_back(1.0 + static_cast<double>(i * i % 7));
    const Surroundings seen = Look(table, ranges, 6);
    for (size_t sector = 0; sector < ctrl::kSectors; sector++) {
      bool any = false;
      double least = 6, at = 0;
      for (size_t i = 0; i < count; i++) {
        if (RayTable::SectorOf(Stg::SinCos(0.3 + bearings[i])) != sector) continue;
        any = true;
        if (ranges[i] < least) at = 0.3 + bearings[i];
        least = std::min(least, ranges[i]);
      }
      const ctrl::SectorReading& sight = seen.sectors[sector];
      EXPECT_EQ(sight.seen, any) << sector;
      EXPECT_EQ(sight.range, least < 6 ? least : ctrl::kUnlimited) << sector;
      const double sine = least < 6 ? sight.Direction().sine : std::sin(at);
      EXPECT_NEAR(sine, std::sin(at), 1e-12);
    }
  }
}

TEST(DisperseTest, SectorsAreAroundTheirMiddles) {
  for (size_t sector = 0; sector < ctrl::kSectors; sector++)
    for (const double off : {-0.49, 0.0, 0.49}) {
      const double angle = (static_cast<double>(sector) + off) * ctrl::kSectorWidth;
      EXPECT_EQ(RayTable::SectorOf(Stg::SinCos(angle)), sector) << off;
      EXPECT_EQ(RayTable::SectorOf(Stg::SinCos(angle - 2 * M_PI)), sector) << off;
    }
}

TEST(DisperseTest, FreePathIsThatOfADisc) {
  const RayTable table(0, {-0.6 * M_PI, -M_PI / 6, 0.0, M_PI / 6, M_PI});
  EXPECT_EQ(Look(table, {9, 9, 9, 9, 9}).free_path, 9);
  EXPECT_EQ(Look(table, {9, 9, 2, 9, 1}).free_path, 2) << "what is behind is not in the way";
  EXPECT_NEAR(Look(table, {0.1, 9, 9, 0.49, 9}).free_path, 0.49 * std::cos(M_PI / 6), 1e-12);
  EXPECT_EQ(Look(table, {9, 0.51, 9, 0.51, 9}).free_path, 9) << "wide enough to pass between";
}

TEST(DisperseTest, FreePathCountsFromTheRobotNotTheSensor) {
  const RayTable table(0, {0.0});
  const double range = 2;
  Surroundings seen;
  ctrl::LimitFreePath(table, &range, {0.5, 0.3, kRadius}, &seen);
  EXPECT_EQ(seen.free_path, ctrl::kUnlimited) << "0.3 m aside";
  ctrl::LimitFreePath(table, &range, {0.5, 0.2, kRadius}, &seen);
  EXPECT_EQ(seen.free_path, 2.5);
}

TEST(DisperseTest, RestsIfAllDirectionsAreEqual) {
  const auto rests = [](const Drive& drive) { return drive.forward == 0 && drive.turn == 0; };
  for (const double fov : {30.0, 180.0, 270.0, 350.0, 360.0})
    EXPECT_TRUE(rests(DriveWith(fov, 350, {1, 0, 0}))) << fov;
  EXPECT_TRUE(rests(DriveWith(360, 350, {-180, 180, 2})));
}

TEST(DisperseTest, DrivesAwayFromObstaclesBehind) {
  for (const double fov : {350.0, 360.0}) {
    const Drive drive = DriveWith(fov, 350, {140, 160, 1});
    EXPECT_GT(drive.forward, 0.2) << fov;
    EXPECT_LT(drive.turn, -0.1) << fov;
  }
}

TEST(DisperseTest, TurnsAwayFromASideWithAnyFieldOfView) {
  for (const double fov : {60.0, 180.0, 270.0, 350.0}) {
    EXPECT_LT(DriveWith(fov, 350, {15, 25, 1}).turn, -0.1) << fov;
    EXPECT_GT(DriveWith(fov, 350, {-25, -15, 1}).turn, 0.1) << fov;
  }
}

TEST(DisperseTest, IgnoresObstaclesBeyondTheHorizon) {
  EXPECT_GT(DriveWith(350, 350, {148, 152, 4.9}).forward, 0);
  EXPECT_EQ(DriveWith(350, 350, {148, 152, 5.1}).forward, 0);
}

/// Ranges of a laser of 360 degrees between parallel walls on the left and right.
std::vector<double> BetweenWalls(double left, double right) {
  std::vector<double> ranges;
  for (const double bearing : Bearings(360, 720)) {
    const double aside = std::sin(bearing);
    ranges.push_back(std::min(8.0, (aside > 0 ? left : right) / std::max(std::fabs(aside), 1e-9)));
  }
  return ranges;
}

// A robot counts as much as a wall at half the distance, however few rays hit it. Then robots are
// evenly spread: each is as far from the next robot as from its own mirror image behind a wall.
TEST(DisperseTest, AWallIsAMirror) {
  const RayTable table(0, Bearings(360, 720));
  const auto goal_with_robot = [&](double wall, double robot) {
    std::vector<double> ranges = BetweenWalls(wall, 100);
    ranges[180] = robot;  // almost exactly at -90 degrees
    return FindGoal(Look(table, ranges), kRadius, 5.0);
  };
  EXPECT_LT(goal_with_robot(1.5, 3.0).imbalance, 0.01);
  EXPECT_LT(goal_with_robot(1.0, 2.0).imbalance, 0.01);
  EXPECT_GT(goal_with_robot(1.5, 2.5).y, 0.03);
  EXPECT_LT(goal_with_robot(1.5, 3.5).y, -0.02);
  EXPECT_LT(FindGoal(Look(table, BetweenWalls(2, 2)), kRadius, 5.0).imbalance, 0.01);
}

TEST(DisperseTest, BlindSectorsGetTheAverage) {
  // The laser sees only a wall ahead; directions outside its view are assumed to be more open.
  const std::vector<double> bearings = Bearings(180, 180);
  std::vector<double> ranges;
  for (const double bearing : bearings)
    ranges.push_back(std::min(8.0, 1 / std::max(std::cos(bearing), 1e-9)));
  const Drive drive = Disperse(Look(RayTable(0, bearings), ranges), kRadius, DisperseRule());
  EXPECT_EQ(drive.forward, 0);
  EXPECT_EQ(std::fabs(drive.turn), DisperseRule().max_turn);
}

TEST(DisperseTest, MountingAngleRotatesAllSectors) {
  // The laser points back, so an obstacle in the middle of its view is behind the robot.
  const Drive drive = DriveWith(180, 181, {-5, 5, 1}, M_PI);
  EXPECT_GT(drive.forward, 0.1);
  EXPECT_NEAR(drive.turn, 0, 0.3);
}

TEST(DisperseTest, StopsAtTheEndOfTheFreePath) {
  const std::vector<double> bearings = Bearings(350, 350);
  std::vector<double> ranges(350, 8.0);
  ranges[0] = 1;  // behind
  const RayTable table(0, bearings);
  Surroundings seen = Look(table, ranges);
  double last = -1;
  for (const double free_path : {0.1, kRadius, 0.3, 0.5, 0.8, 1.1}) {
    seen.free_path = free_path;
    const double forward = Disperse(seen, kRadius, DisperseRule()).forward;
    EXPECT_GT(forward, last) << free_path;
    EXPECT_EQ(forward > 0, free_path > kRadius) << free_path;
    last = forward > 0 ? forward : -1;
  }
}

TEST(DisperseTest, SurvivesOddReadings) {
  const RayTable table(0, Bearings(350, 6));
  const double nan = std::nan("");
  for (const std::vector<double>& ranges : {std::vector<double>(6, 0.0),
                                            std::vector<double>(6, kInfinity),
                                            {nan, 1, 2, 3, 4, 5},
                                            {-1, 1, kInfinity, kInfinity, 4, 5}}) {
    const Drive drive = Disperse(Look(table, ranges), kRadius, DisperseRule());
    EXPECT_TRUE(std::isfinite(drive.forward));
    EXPECT_TRUE(std::isfinite(drive.turn));
  }
  const Drive blind = Disperse(Surroundings(), kRadius, DisperseRule());
  EXPECT_EQ(blind.forward, 0);
  EXPECT_EQ(blind.turn, 0);
}

TEST(DisperseTest, EqualRobotsShareATable) {
  const std::vector<double> bearings = Bearings(350, 350);
  const RayTable* table = ctrl::FindRayTable(0.1, 6, bearings);
  EXPECT_EQ(ctrl::FindRayTable(0.1, 6, bearings), table);
  EXPECT_NE(ctrl::FindRayTable(0.2, 6, bearings), table);
  EXPECT_NE(ctrl::FindRayTable(0.1, 5, bearings), table);
  EXPECT_NE(ctrl::FindRayTable(0.1, 6, Bearings(350, 349)), table);
}

}  // namespace
