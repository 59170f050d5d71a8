// SPDX-License-Identifier: GPL-2.0-or-later
//
// With the exact ray model, ranges end at outlines and do not depend on the cell size.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "models/body.hh"
#include "models/host.hh"
#include "sensing/scene.hh"
#include "support/model_testing.hh"
#include "support/random_source.hh"

using Stg::test::RandomSource;

namespace Stg {
namespace {

constexpr double kCells[] = {0.005, 0.02, 0.1, 0.5};

// ---- the expected ranges, without a grid --------------------------------------------------------

using Real = long double;

struct Point {
  Real x, y;
};

struct Wall {
  Point a, b;
  Bounds z;
  const Model* model;
};

/// All edges of bodies that stop rangers.
std::vector<Wall> WallsOf(const World& world) {
  std::vector<Wall> walls;
  for (Model* model : world.GetAllModels()) {
    if (model->vis.ranger_return < 0) continue;
    const Pose global = model->GetGlobalPose();
    const Geom geom = model->GetGeom();
    const Pose frame = global + geom.pose;
    const Real c = std::cos(Real{frame.a}), s = std::sin(Real{frame.a});
    const double lift = global.z + geom.pose.z;
    for (const auto& block : model->body().blocks()) {
      const std::vector<point_t>& points = block->points();
      const auto place = [&](const point_t& p) {
        return Point{frame.x + p.x * c - p.y * s, frame.y + p.x * s + p.y * c};
      };
      for (size_t i = 0; i < points.size(); i++)
        walls.push_back({place(points[i]), place(points[(i + 1) % points.size()]),
                         Bounds(block->z_range().min + lift, block->z_range().max + lift), model});
    }
  }
  return walls;
}

/// The distance to the nearest wall along a ray, or infinity.
Real TrueRange(const std::vector<Wall>& walls, const Model* finder, const Pose& origin) {
  const Real c = std::cos(Real{origin.a}), s = std::sin(Real{origin.a});
  Real nearest = std::numeric_limits<Real>::infinity();
  for (const Wall& wall : walls) {
    if (origin.z < wall.z.min || origin.z > wall.z.max || wall.model->IsRelated(finder)) continue;
    const Real ax = wall.a.x - origin.x, ay = wall.a.y - origin.y;
    const Real bx = wall.b.x - origin.x, by = wall.b.y - origin.y;
    const Real side_a = c * ay - s * ax, side_b = c * by - s * bx;
    if ((side_a > 0) == (side_b > 0)) continue;
    const Real share = side_a / (side_a - side_b);
    const Real along = c * (ax + share * (bx - ax)) + s * (ay + share * (by - ay));
    if (along >= 0 && along < nearest) nearest = along;
  }
  return nearest;
}

struct Comparison {
  size_t rays = 0, hits = 0, missed = 0, invented = 0;
  Real worst = 0;  ///< max error, metres
};

/// Compares the readings of a ranger's first sensor with the expected ranges.
Comparison Compare(const World& world, const ModelRanger& ranger) {
  const std::vector<Wall> walls = WallsOf(world);
  const ModelRanger::Sensor& sensor = ranger.GetSensors()[0];
  Pose origin = ranger.GetGlobalPose() + ranger.GetGeom().pose + sensor.pose;
  origin.z = ranger.GetGlobalPose().z + ranger.GetGeom().pose.z + sensor.pose.z + sensor.size.z / 2;
  Comparison result;
  for (size_t i = 0; i < sensor.ranges.size(); i++) {
    Pose ray = origin;
    ray.a += sensor.bearings[i];
    const Real expected = TrueRange(walls, &ranger, ray);
    const bool should = expected <= Real{sensor.range.max}, does = sensor.intensities[i] > 0;
    result.rays++;
    result.hits += should;
    result.missed += should && !does;
    result.invented += does && !should;
    if (should && does)
      result.worst = std::max(result.worst, std::fabs(expected - Real{sensor.ranges[i]}));
  }
  return result;
}

void ExpectTrue(const World& world, const ModelRanger& ranger, const std::string& what,
                Real tolerance = 1e-9) {
  const Comparison found = Compare(world, ranger);
  EXPECT_EQ(found.missed, 0u) << what << ", of " << found.hits;
  EXPECT_EQ(found.invented, 0u) << what << ", of " << found.rays - found.hits;
  EXPECT_LE(found.worst, tolerance) << what;
}

// ---- worlds -------------------------------------------------------------------------------------

std::string Header(double cell) {
  std::ostringstream text;
  text << std::fixed;
  text.precision(15);
  text << "resolution " << cell << " ray_model \"exact\"\n"
       << "define lidar ranger(size [0.1 0.1 0.1] sensor(range [0 12] fov 360 samples 720))\n";
  return text.str();
}

/// Boxes and stars with random sizes and headings, some much smaller than a cell, some above or
/// below the rays, with lidars among them.
std::string RandomScene(RandomSource* random, int lidars) {
  std::ostringstream text;
  text << std::fixed;
  text.precision(15);
  for (int i = 0; i < 60; i++) {
    text << "model(pose [" << random->Real(-10, 10) << " " << random->Real(-10, 10) << " "
         << (random->OneIn(6) ? 1.5 : 0.0) << " " << random->Real(-180, 180) << "] size ["
         << std::pow(10, random->Real(-3, 0.5)) << " " << std::pow(10, random->Real(-3, 0.5))
         << " 1]";
    if (random->OneIn(8)) text << " ranger_return -1";
    if (random->OneIn(2)) {
      const int corners = random->OneIn(10) ? 300 : random->Int(3, 12);
      text << " block(points " << corners;
      for (int c = 0; c < corners; c++)
        text << " point[" << c << "] [" << std::cos(2 * M_PI * c / corners) * random->Real(0.2, 1)
             << " " << std::sin(2 * M_PI * c / corners) * random->Real(0.2, 1) << "]";
      text << " z [0 1])";
    }
    text << ")\n";
  }
  for (int i = 0; i < lidars; i++)
    text << "lidar(name \"lidar" << i << "\" pose [" << random->Real(-9, 9) << " "
         << random->Real(-9, 9) << " 0.2 " << random->Real(-180, 180) << "])\n";
  return text.str();
}

std::string LidarAt(double x, double y, double degrees) {
  std::ostringstream text;
  text << std::fixed;
  text.precision(15);
  text << "lidar(name \"lidar\" pose [" << x << " " << y << " 0 " << degrees << "])\n";
  return text.str();
}

bool SameBits(const std::vector<double>& a, const std::vector<double>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(double)) == 0;
}

/// The readings of a lidar in a world, after one update.
std::vector<double> ReadingsIn(const std::string& text) {
  const std::unique_ptr<World> world = LoadText(text);
  const auto* lidar = FindRunning<ModelRanger>(*world, "lidar");
  Step(*world);
  return lidar->GetSensors()[0].ranges;
}

// ---- tests --------------------------------------------------------------------------------------

TEST(ExactRays, AreTrueInRandomWorldsAtEveryCellSize) {
  constexpr int kLidars = 5;
  for (uint64_t seed = 1; seed <= 8; seed++) {
    std::vector<std::vector<double>> first(kLidars);
    for (const double cell : kCells) {
      RandomSource random(seed);
      const std::unique_ptr<World> world = LoadText(Header(cell) + RandomScene(&random, kLidars));
      std::vector<ModelRanger*> lidars;
      for (int i = 0; i < kLidars; i++)
        lidars.push_back(FindRunning<ModelRanger>(*world, "lidar" + std::to_string(i)));
      Step(*world);
      for (int i = 0; i < kLidars; i++) {
        const std::string what = "seed " + std::to_string(seed) + ", cell " + std::to_string(cell);
        ExpectTrue(*world, *lidars[i], what);
        const std::vector<double>& ranges = lidars[i]->GetSensors()[0].ranges;
        if (first[i].empty()) first[i] = ranges;
        EXPECT_TRUE(SameBits(first[i], ranges)) << what << ": the cell size shows";
      }
    }
    if (HasFailure()) return;
  }
}

TEST(ExactRays, AreMoreAccurateThanCells) {
  // Prove that the comparison is meaningful: the cell model fails it clearly.
  RandomSource random(1);
  std::string text = Header(0.1) + RandomScene(&random, 1);
  text.replace(text.find("exact"), 5, "cell");
  const std::unique_ptr<World> world = LoadText(text);
  const auto* lidar = FindRunning<ModelRanger>(*world, "lidar0");
  Step(*world);
  EXPECT_GT(Compare(*world, *lidar).worst, 0.05);
}

TEST(ExactRays, FollowBodiesThatMove) {
  RandomSource random(5);
  const std::unique_ptr<World> world = LoadText(Header(0.05) + RandomScene(&random, 1));
  const auto* lidar = FindRunning<ModelRanger>(*world, "lidar0");
  Step(*world);
  std::vector<Model*> boxes;
  for (Model* model : world->GetChildren())
    if (model->GetModelType() == "model") boxes.push_back(model);
  for (int step = 0; step < 40; step++) {
    for (Model* box : boxes) {
      if (random.OneIn(2)) box->AddToPose(random.Real(-0.1, 0.1), random.Real(-0.1, 0.1), 0, 0.1);
      if (random.OneIn(20)) box->AddToPose(0, 0, random.OneIn(2) ? 1.0 : -1.0, 0);
      if (random.OneIn(20)) box->SetRangerReturn(random.OneIn(2) ? -1 : 1);
    }
    if (random.OneIn(4)) {
      const size_t victim = static_cast<size_t>(random.Int(0, static_cast<int>(boxes.size()) - 1));
      delete boxes[victim];
      boxes.erase(boxes.begin() + static_cast<long>(victim));
    }
    // Readings are taken at the beginning of a step; nothing else moves here.
    Step(*world);
    ExpectTrue(*world, *lidar, "step " + std::to_string(step));
    if (HasFailure()) return;
  }
}

TEST(ExactRays, InAPictureOfWalls) {
  // Walls traced from a bitmap have rectangles and corners that share edges.
  for (const double cell : {0.02, 0.3}) {
    const std::unique_ptr<World> world = LoadText(
        Header(cell) + "model(size [16 16 1] bitmap \"" + std::getenv("STAGE_SOURCE_DIR") +
        "/worlds/bitmaps/cave.png\")\n" + "lidar(name \"a\" pose [-7 -7 0 12])\n" +
        "lidar(name \"b\" pose [0.3 2.4 0 0]) lidar(name \"c\" pose [5.123 -4.567 0 90])\n");
    for (const char* name : {"a", "b", "c"}) {
      const auto* lidar = FindRunning<ModelRanger>(*world, name);
      Step(*world);
      EXPECT_GT(Compare(*world, *lidar).hits, 100u) << name;
      ExpectTrue(*world, *lidar, name);
    }
  }
}

TEST(ExactRays, ParallelToTheAxesAndAlongEdges) {
  // The sides of a box are on cell borders; some rays are at multiples of 45 degrees.
  for (const double cell : kCells) {
    const std::string box = Header(cell) + "model(pose [3 0 0 0] size [2 2 1])\n";
    const std::vector<double> from_left = ReadingsIn(box + LidarAt(0, 0, 0));
    ASSERT_EQ(from_left.size(), 720u);
    const auto ahead = [&](double x, double y, double degrees) {
      std::string text = box + LidarAt(x, y, degrees);
      text.replace(text.find("samples 720"), 11, "samples 1");
      return ReadingsIn(text)[0];
    };
    EXPECT_DOUBLE_EQ(ahead(0, 0, 0), 2);
    EXPECT_DOUBLE_EQ(ahead(6, 0, 180), 2);
    EXPECT_DOUBLE_EQ(ahead(3, 4, -90), 3);
    EXPECT_DOUBLE_EQ(ahead(3, -4, 90), 3);
    EXPECT_DOUBLE_EQ(ahead(0, 1, 0), 2) << "along the upper side: its nearer end";
    EXPECT_DOUBLE_EQ(ahead(0, -1, 0), 2) << "along the lower side";
    EXPECT_DOUBLE_EQ(ahead(0, -1 - 1e-9, 0), 12) << "just below it";
    EXPECT_NEAR(ahead(1, 0, 45), std::sqrt(2), 1e-12) << "into a corner";
    EXPECT_NEAR(ahead(0, 3, -45), 2 * std::sqrt(2), 1e-12) << "at a corner's tip";
    EXPECT_EQ(ahead(2, 0.5, 0), 0) << "on the near side";
    EXPECT_EQ(ahead(2, 0.5, 180), 0) << "on the near side, looking away";
    EXPECT_DOUBLE_EQ(ahead(3, 0, 0), 1) << "from inside";
  }
}

TEST(ExactRays, HitBlocksThatShareACorner) {
  // Blocks surround a point; rays go exactly to that point and beside it.
  for (const double cell : kCells) {
    std::ostringstream text;
    text << std::fixed;
    text.precision(15);
    text << Header(cell);
    for (const double at : {0.0, 7.37, 123.456})
      text << "model(pose [" << at << " " << at << " 0 0] size [1 1 1] block(points 3 "
           << "point[0] [0 0] point[1] [1 -1] point[2] [1 0] z [0 1]) block(points 3 "
           << "point[0] [0 0] point[1] [1 0] point[2] [1 1] z [0 1]))\n";
    const std::unique_ptr<World> world = LoadText(text.str());
    const auto any = [](Model* candidate, const Model* finder, const void*) {
      return candidate != finder;
    };
    for (const double at : {0.0, 7.37, 123.456})
      for (int i = 0; i < 2000; i++) {
        // The tip of the fan is half a metre to the left of the model's origin.
        const double angle = M_PI / 2 + M_PI * (i + 0.5) / 2000, far = 0.1 + 0.001 * i;
        const Pose from(at - 0.5 + far * std::cos(angle), at + far * std::sin(angle), 0.5,
                        angle - M_PI);
        const RaytraceResult hit =
            world->Raytrace(from, 10, any, world->GetGround(), nullptr, true);
        ASSERT_NE(hit.mod, nullptr) << "cell " << cell << " at " << at << " angle " << angle;
        ASSERT_NEAR(hit.range, far, 1e-6);
      }
  }
}

/// Two boxes in the same place with different intensities, and a lidar with `samples` samples.
std::string TwoInOnePlace(double first, double second, int samples) {
  std::ostringstream text;
  text << Header(0.02);
  for (const double seen : {first, second})
    text << "model(name \"box" << seen << "\" pose [5 0 0 0] size [1 3 1] ranger_return " << seen
         << ")\n";
  text << "ranger(name \"lidar\" size [0.1 0.1 0.1] sensor(range [0 12] fov 30 samples " << samples
       << "))\n";
  return text.str();
}

TEST(ExactRays, HitTheOlderOfTwoCoincidentModels) {
  for (const auto& [first, second] : {std::pair(0.5, 0.75), std::pair(0.75, 0.5)})
    for (const int samples : {1, 3, 200}) {
      const std::unique_ptr<World> world = LoadText(TwoInOnePlace(first, second, samples));
      const auto* lidar = FindRunning<ModelRanger>(*world, "lidar");
      for (const char* moves : {"", "box0.5", "box0.75"}) {
        if (*moves) {
          Model* const box = world->GetModel(moves);
          box->SetGlobalPose(Pose(9, 9, 0, 0));
          box->SetGlobalPose(Pose(5, 0, 0, 0));
        }
        Step(*world);
        for (const double intensity : lidar->GetSensors()[0].intensities)
          ASSERT_EQ(intensity, first) << samples << " samples, " << moves << " moved";
      }
    }
}

TEST(ExactRays, LongOnes) {
  // One wall is at 30 km, at the end of 94 legs; another one is a nanometre out of range.
  const auto ahead = [](const std::string& range, double degrees, double wall) {
    std::ostringstream text;
    text << std::fixed;
    text.precision(15);
    text << "resolution 0.02 ray_model \"exact\"\n"
         << "ranger(name \"lidar\" pose [0.3 0.4 0 " << degrees << "] size [0.1 0.1 0.1] sensor("
         << "range [0 " << range << "] fov 0 samples 1))\n"
         << "model(pose [" << 0.3 + wall * std::cos(degrees * M_PI / 180) << " "
         << 0.4 + wall * std::sin(degrees * M_PI / 180) << " 0 " << degrees
         << "] size [1 3 1] origin [0.5 0 0 0])\n";
    return ReadingsIn(text.str())[0];
  };
  for (const double degrees : {0.0, 90.0, 33.0, -120.0, 179.9})
    for (const char* range : {"40000", "\"inf\"", "1000000000000"})
      EXPECT_NEAR(ahead(range, degrees, 30000), 30000, 1e-6) << degrees << " " << range;
  EXPECT_EQ(ahead("500", 10, 500 + 1e-6), 500);
  EXPECT_NEAR(ahead("500", 10, 500 - 1e-6), 500 - 1e-6, 1e-9);
}

TEST(ExactRays, SensorsChooseForThemselves) {
  const std::string text =
      "resolution 0.1\n"
      "model(pose [5.03 0 0 0] size [1 1 1])\n"
      "ranger(name \"both\" size [0.1 0.1 0.1]\n"
      "  sensor(range [0 9] fov 0 samples 1 ray_model \"exact\")\n"
      "  sensor(range [0 9] fov 0 samples 1 ray_model \"cell\")\n"
      "  sensor(range [0 9] fov 0 samples 1))\n";
  const std::unique_ptr<World> world = LoadText(text);
  const auto* both = FindRunning<ModelRanger>(*world, "both");
  Step(*world);
  const std::vector<ModelRanger::Sensor>& sensors = both->GetSensors();
  EXPECT_DOUBLE_EQ(sensors[0].ranges[0], 4.53);
  EXPECT_DOUBLE_EQ(sensors[1].ranges[0], 4.55) << "the middle of the cell";
  EXPECT_EQ(sensors[2].ranges[0], sensors[1].ranges[0]);

  const LoadOutcome wrong = TryToLoad("ray_model \"precise\"\n");
  EXPECT_EQ(wrong.status, 1);
  EXPECT_NE(wrong.errors.find("t.world:1:11: found \"precise\", expected \"cell\" or \"exact\""),
            std::string::npos)
      << wrong.errors;
}

TEST(ExactRays, CostNothingIfUnused) {
  const std::string text =
      "model(size [4 4 1]) ranger(name \"lidar\" pose [5 0 0 0] sensor(samples 1 range [0 9]))\n";
  const auto bytes = [](World* world) { return world->host().scene.grid.statistics().bytes; };
  const std::unique_ptr<World> thin = LoadText(text),
                               exact = LoadText("ray_model \"exact\" " + text);
  FindRunning<ModelRanger>(*thin, "lidar");
  const size_t before = bytes(exact.get());
  EXPECT_EQ(bytes(thin.get()), before);
  FindRunning<ModelRanger>(*exact, "lidar");
  Step(*thin);
  Step(*exact);
  EXPECT_FALSE(thin->host().scene.exact_rasterization);
  EXPECT_TRUE(exact->host().scene.exact_rasterization) << "since the first exact ray";
  EXPECT_GT(bytes(exact.get()), bytes(thin.get()));
}

}  // namespace
}  // namespace Stg
