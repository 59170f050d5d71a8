// SPDX-License-Identifier: GPL-2.0-or-later
//
// Extremes of space: places far from the origin and beyond the last cell, cells of all sizes, rays
// that start on borders. Each test verifies a row of docs/extremes.md.

#include <fstream>

#include "extremes_testing.hh"
#include "support/random_world.hh"

namespace Stg::extremes {
namespace {

constexpr double kSizes[] = {1e-5, 0.02, 1e3};  // sizes of cells, metres

// ---- far from the origin ------------------------------------------------------------------------

/// Readings, in cells, of a wall 400 cells ahead, at several headings and from positions that are
/// not whole cells. The scene is at (x, y), in cells.
std::vector<double> ReadingsAt(double x, double y, double cell, Worst* error) {
  std::vector<double> readings;
  const std::unique_ptr<World> world = WorldOfCells(cell);
  const Model* wall = AddBox(world.get(), Size(20 * cell, 1200 * cell, cell),
                             Pose((x + 410.3) * cell, (y + 0.4) * cell, 0, 0));
  for (int i = 0; i < 100; i++) {
    const double heading = -0.7 + 0.014 * i, start = 0.37 * i + 0.013;
    const Pose from((x + start) * cell, (y + 0.61 * i) * cell, 0, heading);
    const RaytraceResult found = LookFrom(world.get(), from, 1000 * cell);
    EXPECT_EQ(found.mod, wall) << x << " " << y << " " << heading;
    readings.push_back(found.range / cell);
    const double cosine = std::cos(heading);
    error->Note((readings.back() - (400.3 - start) / cosine) * cosine);
  }
  return readings;
}

TEST(Far, ReadingsEqualThoseAtTheOrigin) {
  Worst error, difference;
  for (const double cell : kSizes) {
    const std::vector<double> expected = ReadingsAt(0, 0, cell, &error);
    for (const double x : {1e6, 1e9, kLastCell - 1300, -1e9, -kLastCell + 1300})
      for (const double y : {0.0, 1e9, -kLastCell + 1300}) {
        const std::vector<double> found = ReadingsAt(x, y, cell, &error);
        for (size_t i = 0; i < found.size(); i++) difference.Note(found[i] - expected[i]);
      }
  }
  error.Record("cells_from_the_closed_form");
  difference.Record("cells_from_the_origin");
  EXPECT_LE(error.value(), kStraightFace);
  EXPECT_LE(difference.value(), 1e-4);
}

TEST(Far, RangersSeeAndRobotsStopAtCells) {
  for (const double place : {1e9, -1e9}) {
    const double x = place * kCell;
    const std::unique_ptr<World> world = WorldOfCells(kCell);
    world->SetContactModel(ContactModel::kCells);
    AddBox(world.get(), Size(0.5, 2, 1), Pose(x + 2.25, x, 0, 0));
    ModelRanger* ranger = AddRanger(world.get(), Pose(x, x, 0.5, 0), 8);
    auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
    robot->SetPose(Pose(x + 1, x + 1.5, 0, 0));  // moves beside the ray against the wall
    robot->SetGeom(Geom(Pose(), Size(0.4, 1.4, 1)));
    robot->Subscribe();
    robot->SetSpeed(1, 0, 0);
    Step(*world, 20);
    EXPECT_NEAR(ranger->GetSensors()[0].ranges[0], 2, kStraightFace * kCell);
    EXPECT_TRUE(robot->Stalled());
    // The face is at 2.0; the robot stops half a body and at most one step of 0.1 before it.
    EXPECT_LE(robot->GetPose().x, x + 1.8 + 2 * kCell);
    EXPECT_GE(robot->GetPose().x, x + 1.7 - 2 * kCell);
  }
}

/// The pose, relative to x, of a robot that has hit a wall beside its middle and was turned by it.
Pose PoseAtWall(double x) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  world->SetContactModel(ContactModel::kOutlines);
  AddBox(world.get(), Size(0.5, 2, 1), Pose(x + 2.25, x, 0, 0));
  auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
  robot->SetPose(Pose(x + 1, x + 1.5, 0, 0));
  robot->SetGeom(Geom(Pose(), Size(0.4, 1.4, 1)));
  robot->Subscribe();
  robot->SetSpeed(1, 0, 0);
  Step(*world, 20);
  EXPECT_TRUE(robot->Stalled());
  const Pose pose = robot->GetPose();
  return Pose(pose.x - x, pose.y - x, pose.z, pose.a);
}

TEST(Far, RobotsSlideAndTurnAtOutlinesAsAtTheOrigin) {
  const Pose expected = PoseAtWall(0);
  EXPECT_LT(expected.a, -0.5);
  for (const double place : {1e6, -1e6, 1e9, -1e9}) {
    const Pose found = PoseAtWall(place * kCell);
    ExpectPose(found, expected.x, expected.y, expected.z, expected.a, 1e-7);
  }
}

// ---- beyond the last cell -----------------------------------------------------------------------

TEST(Beyond, BodiesAreNotRasterizedAndComeBack) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  Model* body = AddBox(world.get(), Size(1, 1, 1), Pose());
  Model* inner = AddBox(world.get(), Size(0.5, 3, 1), Pose(0, 5, 0, 0));
  for (const double far : {(kLastCell + 100) * kCell, 1e9, 1e15, 1e300})
    for (const Pose& place : {Pose(far, 0, 0, 0), Pose(-far, 0, 0, 1), Pose(0, far, 0, 2)}) {
      body->SetPose(place);
      ExpectPose(body->GetPose(), place.x, place.y, 0, place.a, 0);
      EXPECT_FALSE(body->HasCollision());
      EXPECT_EQ(LookFrom(world.get(), Pose(-2, 0, 0, 0), kInfinity).mod, nullptr) << far;
      EXPECT_EQ(LookFrom(world.get(), place, kInfinity).mod, nullptr) << far;
      EXPECT_EQ(LookFrom(world.get(), place, 7).range, 7) << far;
      inner->SetPose(place);  // both are there, and don't collide
      EXPECT_FALSE(body->HasCollision());
      inner->SetPose(Pose(0.3, 0, 0, 0));
      body->SetPose(Pose());
      EXPECT_TRUE(body->HasCollision());
      EXPECT_NEAR(LookFrom(world.get(), Pose(-2, 0, 0, 0), 8).range, 1.5, kStraightFace * kCell);
      inner->SetPose(Pose(0, 5, 0, 0));
    }
}

TEST(Beyond, BodiesPartlyBeyondAreNotRasterized) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  const double edge = (kLastCell + 1) * kCell;
  Model* body = AddBox(world.get(), Size(2, 2, 1), Pose(edge - 1.05, 0, 0, 0));
  const Pose eye(edge - 5, 0, 0, 0);
  EXPECT_NEAR(LookFrom(world.get(), eye, 8).range, 2.95, kStraightFace * kCell);
  body->SetPose(Pose(edge - 0.95, 0, 0, 0));
  EXPECT_EQ(LookFrom(world.get(), eye, 8).mod, nullptr);
}

TEST(Beyond, RobotsDriveOutAndBackIn) {
  for (const double side : {1.0, -1.0}) {
    const std::unique_ptr<World> world = WorldOfCells(kCell);
    const double edge = side * kLastCell * kCell;
    const double wall = edge - side * 5;
    AddBox(world.get(), Size(0.2, 2, 1), Pose(wall, 0, 0, 0));
    auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
    robot->SetPose(Pose(edge - side * 3, 0, 0, 0));
    robot->Subscribe();
    robot->SetSpeed(side, 0, 0);
    Step(*world, 60);
    EXPECT_NEAR(robot->GetPose().x, edge + side * 3, 1e-6);
    EXPECT_FALSE(robot->Stalled());
    robot->SetSpeed(-side, 0, 0);
    Step(*world, 100);
    EXPECT_TRUE(robot->Stalled());
    EXPECT_NEAR(robot->GetPose().x, wall + side * 0.3, 0.1 + 2 * kCell);
  }
}

TEST(Beyond, PixelNumbersStopAtTheLastOne) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  for (const double x : {1e9, 1e300, kInfinity})
    EXPECT_EQ(world->MetersToPixels(x), std::numeric_limits<int32_t>::max());
  for (const double x : {-1e9, -1e300, -kInfinity, kNaN})
    EXPECT_EQ(world->MetersToPixels(x), std::numeric_limits<int32_t>::min());
  EXPECT_EQ(world->MetersToPixels(-0.01), -1);
  EXPECT_EQ(world->MetersToPixels(2e7 + 0.01), 1000000000);
}

// ---- cells of all sizes -------------------------------------------------------------------------

/// Readings, in cells, of a fan among boxes, in a scene whose dimensions are multiples of the cell.
std::vector<double> ReadingsInCells(double cell) {
  const std::unique_ptr<World> world = WorldOfCells(cell);
  const auto box = [&](double x, double y, double size, double heading) {
    AddBox(world.get(), Size(size * cell, size * cell, cell), Pose(x * cell, y * cell, 0, heading));
  };
  box(100.3, 20.4, 40.2, 0.3);
  box(-50.3, 60.4, 33.2, 1.1);
  box(10.3, -70.4, 55.1, -2.2);
  box(3.4, 5.3, 420.1, 0.01);
  ModelRanger* ranger =
      AddRanger(world.get(), Pose(0.3 * cell, 0.6 * cell, 0.5 * cell, 0.1), 500 * cell);
  ModelRanger::Sensor& sensor = ranger->GetSensorsMutable()[0];
  sensor.fov = 2 * M_PI;
  sensor.sample_count = 721;
  EXPECT_FALSE(world->Update());
  std::vector<double> readings = sensor.ranges;
  for (double& reading : readings) reading /= cell;
  return readings;
}

TEST(CellSizes, DoNotChangeReadingsInCells) {
  Worst difference;
  const std::vector<double> expected = ReadingsInCells(1);
  for (const double cell : {1e-5, 1e-3, 0.02, 0.1, 1 / 3.0, 17.0, 1e3, 1e6}) {
    const std::vector<double> found = ReadingsInCells(cell);
    ASSERT_EQ(found.size(), expected.size());
    for (size_t i = 0; i < found.size(); i++) {
      EXPECT_LT(found[i], 320) << "misses the frame";
      difference.Note(found[i] - expected[i]);
    }
  }
  difference.Record("cells");
  EXPECT_LE(difference.value(), 1e-4);
  EXPECT_EQ(ReadingsInCells(0.25), expected) << "scaling by powers of two is exact";
}

TEST(CellSizes, OutOfRangeAreRefused) {
  for (const char* size : {"0", "-0.02", "\"9e-7\"", "\"2e6\"", "\"1e-320\"", "\"nan\""}) {
    const LoadOutcome outcome = TryToLoad(std::string("resolution ") + size);
    EXPECT_FALSE(outcome.loaded) << size;
    EXPECT_EQ(outcome.errors.rfind("t.world:1:12: ", 0), 0u) << outcome.errors;
  }
  for (const char* size : {"\"1e-6\"", "\"1e-5\"", "1000", "\"1e6\""})
    EXPECT_TRUE(TryToLoad(std::string("resolution ") + size).loaded) << size;
  InitLibrary();
  for (const double ppm : {0.0, -50.0, kInfinity, kNaN}) {
    const std::string errors = ErrorsOf([&] { EXPECT_EQ(World("w", ppm).Resolution(), 50); });
    EXPECT_FALSE(errors.empty()) << ppm;
  }
}

// ---- starts on borders --------------------------------------------------------------------------

struct Start {
  const char* where;
  double x, y;  // metres
};
// The box of the tests below has its faces at 1.0 and 2.0, that is in cells 50 and 100.
const Start kStarts[] = {
    {"on a border in x", 0.5, 0.01},
    {"on a border in y", 0.51, 0.5},
    {"on a corner", 0.5, 0.5},
    {"on a region's corner", 1.28, 0},
    {"on a superregion's corner", 0, 0},
    {"on the outline", 1.01, 1.01},
    {"inside the body", 1.5, 1.5},
    {"on a corner inside", 1.6, 1.6},
    {"on a corner of the body", 1.0, 1.0},
    {"left of the world", -300.02, 1.5},
    {"far outside", 1e6, -1e6},
    {"in the last cell", kLastCell* kCell, 1.5},
    {"a thousand million cells away", 2e7, 0.5},
};

/// The distance to the box's outline along an axis, from outside or inside; infinite if the ray
/// misses it.
double WayToOutline(double along, double across, double sign) {
  if (across < 1 || across >= 2.02) return kInfinity;
  double way = kInfinity;
  for (const double face : {1.0, 2.0})
    if ((face - along) * sign >= -kCell) way = std::min(way, std::max(0.0, (face - along) * sign));
  return way;
}

TEST(Starts, OnBordersHaveConsistentReadings) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  AddBox(world.get(), Size(1, 1, 1), Pose(1.5, 1.5, 0, 0));
  Worst error;
  for (const Start& start : kStarts)
    for (int quarter = 0; quarter < 4; quarter++) {
      const double sign = quarter < 2 ? 1 : -1;
      const double way = quarter % 2 == 0 ? WayToOutline(start.x, start.y, sign)
                                          : WayToOutline(start.y, start.x, sign);
      const Pose from(start.x, start.y, 0, quarter * M_PI / 2);
      const RaytraceResult found = LookFrom(world.get(), from, kInfinity);
      // In cells of the outline, the ray starts in an occupied cell or runs along such cells.
      const bool on_outline = LookFrom(world.get(), from, 1e-9).mod != nullptr;
      EXPECT_EQ(found.mod != nullptr, std::isfinite(way) || on_outline)
          << start.where << " " << quarter;
      if (on_outline)
        EXPECT_LE(found.range, kCell) << start.where << " " << quarter;
      else if (std::isfinite(way))
        error.Note((found.range - way) / kCell);
    }
  error.Record("cells");
  EXPECT_LE(error.value(), kStraightFace);
}

/// Writes a world with rangers at all these places, around a box and in a frame, and with robots on
/// borders of cells.
std::string WriteWorldOfStarts() {
  std::string path = testing::TempDir() + "stage-extremes-starts.world";
  std::ofstream out(path);
  out.precision(17);
  // A range of 327.68 m is 16384 cells, the maximum leg of a ray.
  out << "define eye ranger( alwayson 1 sensor( range [0 40] fov 360 samples 33 )"
         " sensor( range [0 \"inf\"] fov 0 samples 2 )"
         " sensor( range [0 327.68] fov 360 samples 9 )"
         " sensor( range [0 327.69] fov 360 samples 9 )"
         " sensor( range [0 0.02] fov 360 samples 9 )"
         " sensor( range [0 0.00001] fov 360 samples 9 ) )\n"
         "model( pose [1.5 1.5 0 0] size [1 1 1] )\nmodel( size [30 30 1] )\n"
         "model( pose [20000001.5 1.5 0 0] size [1 1 1] )\n";
  for (const Start& start : kStarts)
    for (const double heading : {0.0, 45.0, 90.0, 180.0})
      out << "eye( pose [" << std::fixed << start.x << " " << start.y << " 0.5 " << heading
          << "] )\n"
          << "position( alwayson 1 size [0.2 0.2 0.2] pose [" << start.x << " " << start.y << " 0 "
          << heading << "] velocity [0.02 0 0 0] update_interval 1000 eye() )\n";
  return path;
}

TEST(Starts, GiveTheSameResultsInAllModes) {
  const std::string path = WriteWorldOfStarts();
  const auto run = [&](int threads, bool batch, bool device) {
    RunOptions options;
    options.threads = threads;
    options.batch = batch;
    options.opencl = options.always_on_device = device;
    return random_world::RunFile(path, 6, options);
  };
  const random_world::Outcome expected = run(1, true, false);
  EXPECT_GT(expected.hits, 1000u);
  EXPECT_NE(expected.hashes.front(), expected.hashes.back());
  EXPECT_EQ(run(4, true, false).hashes, expected.hashes);
  EXPECT_EQ(run(1, false, false).hashes, expected.hashes);
  if (const std::string reason = device::WhyNone(); !reason.empty()) GTEST_SKIP() << reason;
  const random_world::Outcome found = run(1, true, true);
  EXPECT_EQ(found.hashes, expected.hashes);
  EXPECT_GT(found.device_steps, 0u);
}

}  // namespace
}  // namespace Stg::extremes
