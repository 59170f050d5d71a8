// SPDX-License-Identifier: GPL-2.0-or-later
//
// Extremes of rays: ranges from 0 to infinity, headings beside multiples of 45 degrees and after
// millions of turns, fans of all sizes. Each test verifies a row of docs/extremes.md.

#include "extremes_testing.hh"
#include "geometry/trigonometry.hh"
#include "sensing/batch.hh"
#include "support/sanitized.hh"

namespace Stg::extremes {
namespace {

const double kTinyRanges[] = {std::numeric_limits<double>::denorm_min(), 1e-300, 1e-9,
                              1e-3 * kCell};
const double kOtherRanges[] = {
    0.9 * kCell, 1.0, 8.0, 1e6, 1e12, 1e300, std::numeric_limits<double>::max(), kInfinity};

// ---- ranges -------------------------------------------------------------------------------------

/// A ranger in the cell of the origin, 0.005 m from two borders, a post, and the ranger's reading.
struct RangeScene {
  RangeScene(double range, double post_x) : world(WorldOfCells(kCell)) {
    if (std::isfinite(post_x))
      AddBox(world.get(), Size(0.002, 0.002, 1), Pose(post_x, 0.005, 0, 0));
    ranger = AddRanger(world.get(), Pose(0.005, 0.005, 0.5, 0), range);
    EXPECT_FALSE(world->Update());
    reading = ranger->GetSensors()[0].ranges.at(0);
    intensity = ranger->GetSensors()[0].intensities.at(0);
  }
  std::unique_ptr<World> world;
  ModelRanger* ranger;
  double reading, intensity;
};

TEST(Ranges, MissReadsTheMaximumRange) {
  for (const double range : kTinyRanges) EXPECT_EQ(RangeScene(range, kNaN).reading, range);
  for (const double range : kOtherRanges) EXPECT_EQ(RangeScene(range, kNaN).reading, range);
  for (const double range : kTinyRanges) {  // a post in the next cell is out of range
    const RangeScene scene(range, 0.03);
    EXPECT_EQ(scene.reading, range);
    EXPECT_EQ(scene.intensity, 0);
  }
  EXPECT_EQ(RangeScene(0, kNaN).reading, 0);
}

TEST(Ranges, VisibleBodiesAreHit) {
  // Even the shortest ray hits a post in the ranger's own cell, and no reading exceeds the range.
  for (const double range : kTinyRanges) {
    const RangeScene scene(range, 0.01);
    EXPECT_EQ(scene.intensity, 1) << range;
    EXPECT_LE(scene.reading, range);
    EXPECT_GE(scene.reading, 0);
  }
  for (const double range : kOtherRanges) {
    const RangeScene scene(range, range < kCell ? 0.01 : 0.61);
    EXPECT_EQ(scene.intensity, 1) << range;
    EXPECT_NEAR(scene.reading, range < kCell ? 0.0075 : 0.605, kStraightFace * kCell) << range;
  }
}

TEST(Ranges, ZeroCastsNoRay) {
  const RangeScene scene(0, 0.01);
  EXPECT_EQ(scene.reading, 0);
  EXPECT_EQ(scene.intensity, 0);
}

TEST(Ranges, NegativeAndNaNCastNoRay) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  AddBox(world.get(), Size(0.5, 0.5, 1), Pose());
  for (const double range : {-1e-300, -1.0, -kInfinity}) {
    EXPECT_EQ(LookFrom(world.get(), Pose(-2, 0, 0, 0), range).mod, nullptr);
    EXPECT_EQ(LookFrom(world.get(), Pose(-2, 0, 0, 0), range).range, range);
  }
  EXPECT_TRUE(std::isnan(LookFrom(world.get(), Pose(-2, 0, 0, 0), kNaN).range));
  for (const double range : {-1.0, kNaN}) {
    const RangeScene scene(range, 0.01);
    EXPECT_EQ(scene.reading, 0);
    EXPECT_EQ(scene.intensity, 0);
  }
}

/// Walls perpendicular to the ray at known distances, up to the whole width of the grid. Rays
/// longer than 16384 cells are walked in several legs.
TEST(Ranges, FarWallsHaveTheRightRange) {
  Worst near_error, far_error;
  for (const double cells : {10000.0, 16384.0, 17000.0, 1e5, 3e6, 1e8, 1e9, 2e9})
    for (const double heading : {0.0, 0.3, M_PI / 4, 1.3, M_PI / 2}) {
      const double length = cells * kCell, edge = 0.999 * kLastCell * kCell;
      const double dx = std::cos(heading) * length, dy = std::sin(heading) * length;
      if (dx > 1.99 * edge || dy > 1.99 * edge) continue;
      const std::unique_ptr<World> world = WorldOfCells(kCell);
      const Pose from(-edge + 0.003, -edge + 0.007, 0, heading);
      const Model* wall =
          AddBox(world.get(), Size(2, 4, 1), Pose(from.x + dx, from.y + dy, 0, heading));
      for (const double range : {1.5 * length, 1e12, kInfinity}) {
        const RaytraceResult found = LookFrom(world.get(), from, range);
        EXPECT_EQ(found.mod, wall) << cells << " " << heading << " " << range;
        const double error = (found.range - (length - 1)) / kCell;
        (cells < 1e7 ? near_error : far_error).Note(error);
        EXPECT_LE(std::fabs(error), kTurnedFace + 2e-9 * cells)
            << cells << " " << heading << " " << range;
      }
      // A ray that ends a little more than two cells before the wall misses it.
      const double shorter = length - 1 - (2 + 2e-9 * cells) * kCell;
      EXPECT_EQ(LookFrom(world.get(), from, shorter).mod, nullptr) << cells << " " << heading;
      EXPECT_EQ(LookFrom(world.get(), from, shorter).range, shorter);
    }
  near_error.Record("cells_up_to_3e6_cells");
  far_error.Record("cells_up_to_2e9_cells");
}

// ---- headings -----------------------------------------------------------------------------------

/// The reading, in cells, of a wall 5 m away. It faces `facing`, near which the ranger's heading
/// is.
double ReadingOfFacing(double facing, double heading) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  const double away = 5.5;
  AddBox(world.get(), Size(1, 3, 1),
         Pose(0.011 + away * std::cos(facing), 0.007 + away * std::sin(facing), 0, facing));
  ModelRanger* ranger = AddRanger(world.get(), Pose(0.011, 0.007, 0.5, 0), 40);
  ranger->SetPose(Pose(0.011, 0.007, 0.5, heading));
  EXPECT_FALSE(world->Update());
  EXPECT_EQ(ranger->GetSensors()[0].intensities.at(0), 1) << facing << " " << heading;
  return ranger->GetSensors()[0].ranges.at(0) / kCell;
}

TEST(Headings, BesideMultiplesOf45Degrees) {
  Worst error, difference;
  for (int eighth = -8; eighth <= 16; eighth++) {
    const double exact = eighth * (M_PI / 4);
    const double expected = ReadingOfFacing(exact, exact);
    error.Note(expected - 5 / kCell);
    for (const double towards : {-kInfinity, kInfinity}) {
      const double beside = ReadingOfFacing(exact, std::nextafter(exact, towards));
      error.Note(beside - 5 / kCell);
      difference.Note(beside - expected);
    }
  }
  error.Record("cells");
  difference.Record("cells_between_neighbours");
  EXPECT_LE(error.value(), kTurnedFace);
  EXPECT_LE(difference.value(), 1e-4);
}

/// Reduces an angle modulo 2 pi, with more digits than a double has.
long double LeftOf(long double angle) {
  return std::remainder(angle, 6.283185307179586476925286766559005768L);
}

TEST(Headings, AfterMillionsOfTurns) {
  Worst heading_error, error;
  for (const double turns : {1e3, 1e6, -1e6, 1e9})
    for (double a = -3; a <= 3; a += 0.375) {
      const double wound = turns * 2 * M_PI + a;
      // `wound` is rounded, so its heading differs slightly from `a`. The rounded value counts.
      const double meant = static_cast<double>(LeftOf(wound));
      error.Note(ReadingOfFacing(meant, wound) - 5 / kCell);
      const std::unique_ptr<World> world = WorldOfCells(kCell);
      Model* model = AddBox(world.get(), Size(1, 1, 1), Pose(0, 0, 0, wound));
      EXPECT_LE(std::fabs(model->GetPose().a), M_PI);
      heading_error.Note((model->GetPose().a - meant) / std::fabs(turns));
    }
  heading_error.Record("radians_per_turn");
  error.Record("cells");
  EXPECT_LE(heading_error.value(), 2.5e-16);  // 2 M_PI is less than a turn by this amount
  EXPECT_LE(error.value(), kTurnedFace);
}

TEST(Headings, StayExactOverAMillionSteps) {
  constexpr int kSteps = kSanitized ? 100000 : 1000000;
  Worst drift;
  for (const double speed : {0.7, -3.0, 61.0}) {
    const auto world = LoadText(
        "position( name \"r\" noblocks 1 pose [0.011 0.007 0.5 10] localization \"odom\""
        " odom_error [0 0 0 0] velocity_bounds [-1 1 -1 1 -1 1 -4000 4000]"
        " ranger( name \"eye\" sensor( size [0 0 0] range [0 40] ) ) )\n");
    auto* robot = FindRunning<ModelPosition>(*world, "r");
    robot->SetSpeed(0, 0, speed);
    for (int i = 0; i < kSteps; i++) ASSERT_FALSE(world->Update());
    const long double turned = static_cast<long double>(speed) * 0.1L * kSteps;
    const long double expected = LeftOf(LeftOf(turned) + static_cast<long double>(dtor(10)));
    const double error = static_cast<double>(LeftOf(robot->GetPose().a - expected));
    // The estimate is the one before the turn of the last step.
    const long double last = static_cast<long double>(speed) * 0.1L;
    const double believed = static_cast<double>(LeftOf(robot->est_pose.a - LeftOf(turned - last)));
    drift.Note(error);
    drift.Note(believed);
    EXPECT_LE(std::fabs(robot->GetPose().a), M_PI);

    // The robot still sees a box ahead of it.
    const double facing = robot->GetPose().a;
    AddBox(world.get(), Size(1, 3, 4),
           Pose(0.011 + 5.5 * std::cos(facing), 0.007 + 5.5 * std::sin(facing), 0, facing));
    robot->Stop();
    auto* eye = FindRunning<ModelRanger>(*world, "r.eye");
    Step(*world, 2);
    EXPECT_NEAR(eye->GetSensors()[0].ranges.at(0), 5, kTurnedFace * kCell);
  }
  drift.Record("radians");
  // The limit covers rounding of speed times step, of the sum, and of two reductions by 2 M_PI.
  EXPECT_LE(drift.value(), 2.5e-15 * kSteps);
}

// ---- fans ---------------------------------------------------------------------------------------

/// A ranger in the center of a room of 10 m by 10 m.
struct Room {
  Room(double fov, unsigned samples) : world(WorldOfCells(kCell)) {
    AddBox(world.get(), Size(10, 10, 1), Pose());
    ranger = AddRanger(world.get(), Pose(0, 0, 0.5, 0), 20);
    Change(fov, samples);
  }
  void Change(double fov, unsigned samples) {
    sensor().fov = fov;
    sensor().sample_count = samples;
    EXPECT_FALSE(world->Update());
  }
  ModelRanger::Sensor& sensor() { return ranger->GetSensorsMutable()[0]; }
  std::unique_ptr<World> world;
  ModelRanger* ranger;
};

/// Expects bearings as in the closed form, and readings of the room's walls.
void ExpectFan(Room& room, double fov, Worst* error) {
  const ModelRanger::Sensor& s = room.sensor();
  const size_t n = s.sample_count;
  ASSERT_EQ(s.bearings.size(), n);
  ASSERT_EQ(s.ranges.size(), n);
  ASSERT_EQ(s.intensities.size(), n);
  for (size_t i = 0; i < n; i++) {
    const double share = n > 1 ? static_cast<double>(i) / static_cast<double>(n - 1) - 0.5 : 0;
    EXPECT_NEAR(s.bearings[i], fov * share, 1e-15 * std::fabs(fov));
    const double longer =
        std::max(std::fabs(std::cos(s.bearings[i])), std::fabs(std::sin(s.bearings[i])));
    error->Note((s.ranges[i] * longer - 5) / kCell);
  }
  if (n > 1) {
    EXPECT_EQ(s.bearings.front(), -fov / 2);
  }
}

TEST(Fans, WorkForAllSizesAndFieldsOfView) {
  Worst error;
  for (const unsigned samples : {0u, 1u, 2u, 3u, 1081u, 100000u})
    for (const double degrees : {0.0, 1e-9, 90.0, 360.0, 720.0, -90.0, -720.0, 3.6e6}) {
      SCOPED_TRACE(std::to_string(samples) + " samples over " + std::to_string(degrees));
      Room room(dtor(degrees), samples);
      ExpectFan(room, dtor(degrees), &error);
    }
  error.Record("cells");
  EXPECT_LE(error.value(), kStraightFace);
}

TEST(Fans, FullCirclesBeginAndEndAtTheSameRay) {
  Room room(2 * M_PI, 5);
  EXPECT_EQ(room.sensor().ranges.front(), room.sensor().ranges.back());
  room.Change(-2 * M_PI, 5);
  EXPECT_EQ(room.sensor().ranges.front(), room.sensor().ranges.back());
}

TEST(Fans, RebuildDirectionTables) {
  // There are so many kinds of fans that the direction tables are rebuilt several times. An
  // unchanged second sensor and a blobfinder must use the new tables.
  Room room(1, 100000);
  ModelRanger::Sensor other = room.sensor();
  other.sample_count = 7;
  other.fov = M_PI;
  room.ranger->GetSensorsMutable().push_back(other);
  auto* finder = dynamic_cast<ModelBlobfinder*>(room.world->CreateModel(nullptr, "blobfinder"));
  finder->range = 20;
  finder->scan_width = 9;
  finder->Subscribe();
  room.Change(2, 10);
  const std::vector<double> expected = room.ranger->GetSensors()[1].ranges;
  ASSERT_EQ(finder->GetBlobs().size(), 1u);
  const double blob = finder->GetBlobs()[0].range;
  Worst error;
  for (int i = 0; i < 100 && !testing::Test::HasFailure(); i++) {
    room.Change(0.5 + 0.03 * i, 90000);
    if (i % 20 == 19) ExpectFan(room, 0.5 + 0.03 * i, &error);
    EXPECT_EQ(room.ranger->GetSensors()[1].ranges, expected) << i;
    ASSERT_EQ(finder->GetBlobs().size(), 1u) << i;
    EXPECT_EQ(finder->GetBlobs()[0].range, blob) << i;
  }
  EXPECT_LE(error.value(), kStraightFace);
}

// ---- batches ------------------------------------------------------------------------------------

/// A batch counts rays beyond 32 bits, where the ray indices of a device would overflow.
TEST(Batches, CountMoreThan32BitsOfRays) {
  sensing::RayBatch batch;
  batch.Add(sensing::Fan(), UINT32_MAX, sensing::SelfMask());
  EXPECT_EQ(batch.ray_count(), uint64_t{UINT32_MAX});
  EXPECT_TRUE(batch.FitsDevice());
  for (uint64_t rays = 1; rays <= 3; rays++) {
    batch.Add(sensing::Fan(), 1, sensing::SelfMask());
    EXPECT_EQ(batch.ray_count(), uint64_t{UINT32_MAX} + rays);
    EXPECT_FALSE(batch.FitsDevice());
  }
  batch.Clear();
  EXPECT_TRUE(batch.FitsDevice());
}

}  // namespace
}  // namespace Stg::extremes
