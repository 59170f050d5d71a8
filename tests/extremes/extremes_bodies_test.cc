// SPDX-License-Identifier: GPL-2.0-or-later
//
// Extremes of bodies: thinner than a cell, without area, self-intersecting, with ten thousand
// points, without height. Each test verifies a row of docs/extremes.md.

#include <sys/resource.h>

#include <cstdlib>
#include <sstream>

#include "extremes_testing.hh"
#include "models/body.hh"
#include "support/random_source.hh"
#include "support/sanitized.hh"
#include "world/engine.hh"

namespace Stg::extremes {
namespace {

/// A model "a" with one block of these corners, which are written with all digits.
std::string ModelOf(const std::vector<point_t>& corners, const std::string& size,
                    const std::string& z = "[0 1]") {
  std::ostringstream text;
  text.precision(17);
  text << std::fixed << "model( name \"a\" size " << size << " block( points " << corners.size();
  for (size_t i = 0; i < corners.size(); i++)
    text << " point[" << i << "] [" << corners[i].x << " " << corners[i].y << "]";
  text << " z " << z << " ) )\n";
  return text.str();
}

/// Drives a robot of 0.2 m by 0.2 m at 0.5 m/s along x until it stalls. Returns the x of its front;
/// infinite if nothing stops it within 10 m.
double StopOf(World* world, double x, double y) {
  auto* robot = dynamic_cast<ModelPosition*>(world->CreateModel(nullptr, "position"));
  robot->SetGeom(Geom(Pose(), Size(0.2, 0.2, 0.4)));
  robot->SetPose(Pose(x, y, 0, 0));
  robot->Subscribe();
  robot->SetSpeed(0.5, 0, 0);
  for (int i = 0; i < 200 && !robot->Stalled(); i++) EXPECT_FALSE(world->Update());
  const double front = robot->Stalled() ? robot->GetPose().x + 0.1 : kInfinity;
  delete robot;
  return front;
}

/// Expects that a robot stops before x, by less than a step and some cells.
void ExpectStop(World* world, double x, double y) {
  const double front = StopOf(world, x - 1.3, y);
  EXPECT_LE(front, x + kCell) << y;
  EXPECT_GE(front, x - 0.05 - 2 * kCell) << y;
}

double Distance(World* world, const Pose& from) {
  const RaytraceResult found = LookFrom(world, from, 8);
  return found.mod ? found.range : kInfinity;
}

// ---- thin ---------------------------------------------------------------------------------------

TEST(Thin, WallsAreSeenAndStopRobotsAtAnyOffsetInTheirCells) {
  for (const double thickness : {0.005, 1e-4, 1e-9, 1e-300, 0.0})
    for (double offset = 0; offset < kCell; offset += 0.003) {
      const std::unique_ptr<World> world = WorldOfCells(kCell);
      const double x = 1 + offset;
      AddBox(world.get(), Size(thickness, 2, 1), Pose(x, 0, 0, 0));
      EXPECT_NEAR(Distance(world.get(), Pose(-1, 0.3, 0, 0)), x + 1, kCell) << thickness;
      EXPECT_NEAR(Distance(world.get(), Pose(3, 0.3, 0, M_PI)), 3 - x, kCell) << thickness;
      ExpectStop(world.get(), x, 0.1);
    }
}

TEST(Thin, RotatedWallsStopAllRaysAndRobots) {
  test::RandomSource random(7);
  Worst error;
  for (double heading = 0.05; heading < 3.1; heading += 0.31) {
    const std::unique_ptr<World> world = WorldOfCells(kCell);
    AddBox(world.get(), Size(0, 4, 1), Pose(0.007, 0.003, 0, heading));
    const double cosine = std::cos(heading), sine = std::sin(heading);
    for (int i = 0; i < 400; i++) {
      // Look from one side of the wall to the other, through a point of it.
      const double where = random.Real(-1.9, 1.9), away = random.Real(0.2, 2);
      const double across = random.Real(-1.2, 1.2);
      const Pose from(0.007 - sine * where - away * std::cos(heading + across),
                      0.003 + cosine * where - away * std::sin(heading + across), 0,
                      heading + across);
      const RaytraceResult found = LookFrom(world.get(), from, 8);
      ASSERT_NE(found.mod, nullptr) << heading << " " << from.String();
      error.Note((found.range - away) * std::cos(across) / kCell);
    }
    if (std::fabs(cosine) > 0.3) {
      const double front = StopOf(world.get(), -2, 0);
      EXPECT_LE(front, 0.1 * std::fabs(sine / cosine) + 0.1);
    }
  }
  error.Record("cells");
  EXPECT_LE(error.value(), kTurnedFace);
}

// ---- bodies without area ------------------------------------------------------------------------

TEST(Flat, BlocksOfPointsOnALineAreLines) {
  for (const std::vector<point_t>& corners :
       {std::vector<point_t>{{0, 0}, {1, 0}, {3, 0}}, {{0, 0}, {3, 0}}, {{3, 0}, {0, 0}, {1, 0}}}) {
    const auto world = LoadText(ModelOf(corners, "[2 1 1]"));
    const double way = Distance(world.get(), Pose(0.3, -2, 0.5, M_PI / 2));
    EXPECT_NEAR(way, 2, kStraightFace * kCell);
    const double y = -2 + way;
    for (const double x : {-0.9, 0.0, 0.9})
      EXPECT_NEAR(Distance(world.get(), Pose(x, -2, 0.5, M_PI / 2)), way, 1e-6);
    EXPECT_NEAR(Distance(world.get(), Pose(-3, y, 0.5, 0)), 2, kStraightFace * kCell);
    ExpectStop(world.get(), -1, y);
  }
}

TEST(Flat, BlocksOfPointsOnALineLieInTheMiddle) {
  for (const double at : {0.0, 0.5, 1.0, 3.0, -0.1, 1e9}) {
    const auto along_x = LoadText(ModelOf({{0, at}, {1, at}, {3, at}}, "[2 1 1]"));
    const auto along_y = LoadText(ModelOf({{at, 0}, {at, 1}, {at, 3}}, "[1 2 1]"));
    for (const double size : {1.0, 5.0, 0.0}) {
      EXPECT_NEAR(Distance(along_x.get(), Pose(0.3, -2, 0.5, M_PI / 2)), 2, kStraightFace * kCell);
      EXPECT_NEAR(Distance(along_y.get(), Pose(-2, 0.3, 0.5, 0)), 2, kStraightFace * kCell) << at;
      Find(*along_x, "a")->SetGeom(Geom(Pose(), Size(2, size, 1)));
      Find(*along_y, "a")->SetGeom(Geom(Pose(), Size(size, 2, 1)));
    }
  }
  // Two such blocks together have an extent, so they are stretched to the size.
  const auto both = LoadText(
      "model( name \"a\" size [2 1 1] block( points 2 point[0] [0 1] point[1] [3 1] z [0 1] )\n"
      "  block( points 2 point[0] [0 5] point[1] [3 5] z [0 1] ) )");
  EXPECT_NEAR(Distance(both.get(), Pose(0.3, -2, 0.5, M_PI / 2)), 1.5, kStraightFace * kCell);
  EXPECT_NEAR(Distance(both.get(), Pose(0.3, 2, 0.5, -M_PI / 2)), 1.5, kStraightFace * kCell);
}

TEST(Flat, BlocksOfEqualPointsAreACellOrNothing) {
  // A polygon of three or more corners occupies at least one cell.
  const auto world = LoadText(ModelOf({{1, 1}, {1, 1}, {1, 1}}, "[0.001 0.001 1]"));
  EXPECT_NEAR(Distance(world.get(), Pose(-1, 0.0, 0.5, 0)), 1, kStraightFace * kCell);
  ExpectStop(world.get(), 0, 0);
  // Two equal corners are no polygon.
  const auto nothing = LoadText(ModelOf({{1, 1}, {1, 1}}, "[0.001 0.001 1]"));
  EXPECT_EQ(Distance(nothing.get(), Pose(-1, 0.0, 0.5, 0)), kInfinity);
  EXPECT_EQ(StopOf(nothing.get(), -1, 0), kInfinity);
  EXPECT_FALSE(Find(*nothing, "a")->HasCollision());
}

TEST(Flat, ZeroSizeIsACellAndCanBeUndone) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  Model* model = AddBox(world.get(), Size(0, 0, 0), Pose(0.01, 0.01, 0, 0));
  EXPECT_NEAR(Distance(world.get(), Pose(-1, 0.01, 0, 0)), 1, kStraightFace * kCell);
  ExpectStop(world.get(), 0, 0.01);
  model->SetGeom(Geom(Pose(), Size(1, 1, 1)));
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 0.01, 0, 0)), 1.5, kStraightFace * kCell);
}

TEST(Flat, NegativeSizesMirrorTheBody) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  Model* model = AddBox(world.get(), Size(-1, -2, 1), Pose());
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 0.9, 0, 0)), 1.5, kStraightFace * kCell);
  ExpectStop(world.get(), -0.5, 0.9);
  // A body with a negative height exists at no height.
  model->SetGeom(Geom(Pose(), Size(1, 1, -1)));
  ModelRanger* ranger = AddRanger(world.get(), Pose(-2, 0, 0.5, 0), 8);
  Step(*world);
  EXPECT_EQ(ranger->GetSensors()[0].ranges.at(0), 8);
}

// ---- many corners -------------------------------------------------------------------------------

TEST(Crossing, SelfIntersectingOutlinesAreSolid) {
  // The body is a bow tie with its waist at the center.
  const auto world = LoadText(ModelOf({{0, 0}, {2, 2}, {2, 0}, {0, 2}}, "[2 2 1]"));
  for (const double y : {-0.81, -0.33, 0.35, 0.77}) {
    EXPECT_NEAR(Distance(world.get(), Pose(-3, y, 0.5, 0)), 2, kStraightFace * kCell) << y;
    // From between its wings, the slopes are visible.
    EXPECT_NEAR(Distance(world.get(), Pose(0, y, 0.5, 0)), std::fabs(y), 2 * kCell) << y;
    EXPECT_NEAR(Distance(world.get(), Pose(0, y, 0.5, M_PI)), std::fabs(y), 2 * kCell) << y;
  }
  EXPECT_NEAR(Distance(world.get(), Pose(0, 3, 0.5, -M_PI / 2)), 3, 2 * kCell);
  ExpectStop(world.get(), -1, 0.4);
}

TEST(Crossing, EdgesRasterizedTwiceAreRemovedTwice) {
  const auto world = LoadText(ModelOf({{0, 0}, {2, 0}, {0, 0}, {2, 0}, {2, 2}}, "[2 2 1]"));
  Model* model = Find(*world, "a");
  for (int i = 0; i < 10; i++) {
    model->SetPose(Pose(0.13 * i, 0, 0, 0.3 * i));
    Step(*world);
  }
  model->SetPose(Pose(30, 0, 0, 0));
  for (double heading = 0; heading < 6.28; heading += 0.01)
    EXPECT_EQ(Distance(world.get(), Pose(0, 0, 0.5, heading)), kInfinity);
}

bool IsReversed(std::vector<point_t> corners) {
  const point_t last = corners.back();
  OrientPolygon(&corners);
  return corners.front().x == last.x && corners.front().y == last.y;
}

/// Rotates and scales corners.
std::vector<point_t> Turned(std::vector<point_t> corners, double angle, double scale) {
  for (point_t& p : corners)
    p = point_t(scale * (p.x * std::cos(angle) - p.y * std::sin(angle)),
                scale * (p.x * std::sin(angle) + p.y * std::cos(angle)));
  return corners;
}

/// The orientation must be exact: a sum of angles that is 0 may be rounded to another value.
TEST(Order, OrientationIsExact) {
  const std::vector<point_t> left = {{0, 0}, {4, 1}, {5, 5}, {2, 2}, {1, 3}};
  const std::vector<point_t> right(left.rbegin(), left.rend());
  const std::vector<point_t> bow_tie = {{0, 0}, {2, 2}, {2, 0}, {0, 2}};
  const std::vector<point_t> uneven_bow_tie = {{0, 0}, {2, 2}, {2, 0}, {-5, 7}};
  const std::vector<point_t> twice = {{0, 0}, {4, 0}, {0, 3}, {0, 0.5}, {3, 0.5}, {0.2, 2}};
  test::RandomSource random(3);
  for (int i = 0; i < 10000; i++) {
    const double angle = random.Real(-4, 4), scale = std::exp(random.Real(-20, 20));
    const auto reversed = [&](const std::vector<point_t>& corners) {
      return IsReversed(Turned(corners, angle, scale));
    };
    ASSERT_FALSE(reversed(left)) << angle;
    ASSERT_FALSE(reversed(twice)) << angle;
    ASSERT_TRUE(reversed(right)) << angle;
    ASSERT_TRUE(reversed(bow_tie)) << angle;
    ASSERT_TRUE(reversed(uneven_bow_tie)) << angle;
  }
}

TEST(Order, CollinearPointsCountAsReversed) {
  for (int x = -30; x <= 30; x++)
    for (int y = -30; y <= 30; y++) {
      if (x == 0 && y == 0) continue;
      const auto at = [&](int n) { return point_t(0.125 * x * n, 0.125 * y * n); };  // exact
      EXPECT_TRUE(IsReversed({at(0), at(1)})) << x << " " << y;
      EXPECT_TRUE(IsReversed({at(0), at(8), at(1), at(4)})) << x << " " << y;
    }
}

TEST(Many, TenThousandCornersMakeACircle) {
  std::vector<point_t> corners;
  for (int i = 0; i < 10000; i++)
    corners.emplace_back(std::cos(2 * M_PI * i / 10000), std::sin(2 * M_PI * i / 10000));
  const auto world = LoadText(ModelOf(corners, "[4 4 1]"));
  Worst error;
  for (int i = 0; i < 360; i++) {
    const double heading = dtor(i + 0.3), x = std::cos(heading), y = std::sin(heading);
    error.Note((Distance(world.get(), Pose(0.001, 0.001, 0.5, heading)) - 2) / kCell);
    error.Note((Distance(world.get(), Pose(-5 * x, -5 * y, 0.5, heading)) - 3) / kCell);
  }
  error.Record("cells");
  EXPECT_LE(error.value(), kTurnedFace);
  ExpectStop(world.get(), -2, 0);
}

// ---- heights ------------------------------------------------------------------------------------

TEST(Height, ZeroHeightCollidesOnlyAtThatHeight) {
  for (const char* z : {"[0 0]", "[0 1]"}) {
    const std::vector<point_t> square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    const auto world = LoadText(ModelOf(square, z[3] == '0' ? "[1 1 1]" : "[1 1 0]", z));
    const auto seen_at = [&](double height) {
      return world->Raytrace(Pose(-2, 0, height, 0), 8, Anything, nullptr, nullptr, true).mod;
    };
    EXPECT_NE(seen_at(0), nullptr) << z;
    EXPECT_EQ(seen_at(1e-9), nullptr) << z;
    EXPECT_EQ(seen_at(-1e-9), nullptr) << z;
    ExpectStop(world.get(), -0.5, 0);  // touching height ranges overlap
    Find(*world, "a")->SetPose(Pose(0, 0, 0.401, 0));
    EXPECT_EQ(StopOf(world.get(), -2, 0), kInfinity) << "it is above the robot now";
    Find(*world, "a")->SetPose(Pose(0, 0, 0.2, 0));
    ExpectStop(world.get(), -0.5, 0);
  }
}

TEST(Height, ZeroHeightAboveTheFloorStaysThere) {
  const std::vector<point_t> square = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (const double height : {0.5, 0.25, 7.0}) {
    const std::string at = std::to_string(height);
    const auto world = LoadText(ModelOf(square, "[1 1 1]", "[" + at + " " + at + "]"));
    const auto seen_at = [&](double z) {
      return world->Raytrace(Pose(-2, 0, z, 0), 8, Anything, nullptr, nullptr, true).mod;
    };
    for (const double size : {1.0, 3.0, 0.0, -1.0}) {
      EXPECT_NE(seen_at(height), nullptr) << height;
      EXPECT_EQ(seen_at(height + 1e-9), nullptr) << height;
      EXPECT_EQ(seen_at(height - 1e-9), nullptr) << height;
      Find(*world, "a")->SetGeom(Geom(Pose(), Size(1, 1, size)));
    }
    // The robot is 0.4 m high, so it collides.
    Find(*world, "a")->SetPose(Pose(0, 0, 0.2 - height, 0));
    ExpectStop(world.get(), -0.5, 0);
  }
}

// ---- too large ----------------------------------------------------------------------------------

Size Island() { return Size(1e6, 1e6, 1); }  // 200 million cells

[[noreturn]] void MakeAnIslandIn2GB() {
  rlimit limit;
  limit.rlim_cur = limit.rlim_max = 2000000000;
  setrlimit(RLIMIT_AS, &limit);
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  world->SetRayModel(RayModel::kExact);  // bodies need cells and outlines
  AddRanger(world.get(), Pose(), 5);
  Step(*world);
  Model* model = world->CreateModel(nullptr, "model");
  model->SetGeom(Geom(Pose(), Island()));
  std::_Exit(world->Update() ? 1 : 0);
}

/// It runs in a separate process with 2 GB of memory; the island would need ten times as much.
TEST(Large, BodiesTooLargeForMemoryAreRefused) {
  if (kSanitized) GTEST_SKIP() << "sanitizers need more memory than the limit allows";
  testing::FLAGS_gtest_death_test_style = "threadsafe";
  EXPECT_EXIT(MakeAnIslandIn2GB(), testing::ExitedWithCode(0),
              "model:1: found bodies whose outlines cross more than 32006000 cells of the grid, "
              "20000000. of them this one's, expected smaller bodies or a coarser resolution; this "
              "one is not drawn");
}

TEST(Large, BodiesInFilesAreRefused) {
  const LoadOutcome outcome = TryToLoad("model( size [1000000 1000000 1] )");
  EXPECT_FALSE(outcome.loaded);
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  EXPECT_NE(outcome.errors.find("more than 16001000 cells"), std::string::npos) << outcome.errors;
}

TEST(Large, RefusedBodiesGetOneMessagePerSize) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  AddBox(world.get(), Size(1, 1, 1), Pose(5, 0, 0, 0));
  Model* model = AddBox(world.get(), Size(1, 1, 1), Pose());
  Model* child = world->CreateModel(model, "model");
  child->SetPose(Pose(0, 2, -1, 0));
  const auto lines = [&](const std::function<void()>& action) {
    const std::string errors = ErrorsOf(action);
    return std::count(errors.begin(), errors.end(), '\n');
  };
  EXPECT_EQ(lines([&] { model->SetGeom(Geom(Pose(), Island())); }), 1);
  EXPECT_EQ(lines([&] {
              for (int i = 0; i < 10; i++) {
                model->SetPose(Pose(0, 0, 0, 0.1 * i));
                EXPECT_FALSE(model->HasCollision());
                Step(*world);
              }
              model->SetPose(Pose());
            }),
            0);
  // The refused body is neither at its old place nor at its new one; all other bodies are
  // unchanged.
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 0, 0.5, 0)), 6.5, kStraightFace * kCell);
  EXPECT_EQ(Distance(world.get(), Pose(-2, 0, 0.5, M_PI)), kInfinity);
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 2, 0.5, 0)), 1.8, kStraightFace * kCell);
  ExpectStop(world.get(), 4.5, 0);
  EXPECT_EQ(lines([&] { model->SetGeom(Geom(Pose(), Island())); }), 1);
  EXPECT_EQ(lines([&] { model->SetGeom(Geom(Pose(), Size(1, 1, 1))); }), 0);
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 0, 0.5, 0)), 1.5, kStraightFace * kCell);
}

TEST(Large, BodiesCountTogether) {
  const std::unique_ptr<World> world = WorldOfCells(kCell);
  Model* model = AddBox(world.get(), Size(1, 1, 1), Pose());
  Model* other = AddBox(world.get(), Size(1, 1, 1), Pose(0, 3, 0, 0));
  grid::Grid& grid = world->engine().scene.grid;
  EXPECT_EQ(grid.rasterized_cells(), 400);
  // Pretend that only 100 cells are left: bodies may move, but not grow.
  const int64_t others = 2 * (16'000'000 + 3 * 1000) - 500;
  grid.AddRasterizedCells(others);
  EXPECT_EQ(ErrorsOf([&] { model->SetPose(Pose(1, 0, 0, 0)); }), "");
  EXPECT_EQ(ErrorsOf([&] { model->SetGeom(Geom(Pose(), Size(1.5, 1.5, 1))); }), "");
  EXPECT_EQ(grid.rasterized_cells(), others + 500);
  EXPECT_NE(ErrorsOf([&] { other->SetGeom(Geom(Pose(), Size(1.5, 1.5, 1))); }), "");
  EXPECT_EQ(grid.rasterized_cells(), others + 300);
  EXPECT_EQ(Distance(world.get(), Pose(-2, 3, 0.5, 0)), kInfinity);
  model->SetGeom(Geom(Pose(), Size(1, 1, 1)));  // frees cells
  other->SetPose(Pose(0, 4, 0, 0));
  EXPECT_NEAR(Distance(world.get(), Pose(-2, 4, 0.5, 0)), 1.25, kStraightFace * kCell);
  EXPECT_EQ(grid.rasterized_cells(), others + 500);
  grid.AddRasterizedCells(-others);
  delete model;
  delete other;
  EXPECT_EQ(grid.rasterized_cells(), 0);
}

}  // namespace
}  // namespace Stg::extremes
