// SPDX-License-Identifier: GPL-2.0-or-later
//
// World::Raytrace: known readings, fans, unusual arguments, and random worlds compared with the
// reference walk.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "geometry/trigonometry.hh"
#include "grid/outline.hh"
#include "raytrace_testing.hh"
#include "stage.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using test::RandomSource;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Tolerance of a reading, which is the middle of the ray's path through the cell: one and a half
/// cells along the longer axis, metres.
double Slack(double heading) {
  return 1.5 * kCell / std::max(std::fabs(std::cos(heading)), std::fabs(std::sin(heading)));
}

// ---- known readings -----------------------------------------------------------------------------

struct KnownWorld {
  std::unique_ptr<World> world = EmptyWorld();
  std::map<char, Model*> models;
  KnownWorld() {
    models['-'] = nullptr;
    models['A'] = AddBox(world.get(), Size(1, 1, 1), Pose(3, 2, 0, 0));
    models['B'] = AddBox(world.get(), Size(1, 0.6, 1), Pose(-2.5, 1.3, 0, 0.5));
    models['C'] = AddBox(world.get(), Size(0.1, 4, 1), Pose(-5, -1, 0, 0));
    models['D'] = AddBox(world.get(), Size(0.3, 0.3, 0.2), Pose(1.2, -0.9, 0, M_PI / 4));
    models['E'] = AddBox(world.get(), Size(20, 0.1, 1), Pose(0, -8, 0, 0.05));
  }
};

struct Reading {
  double x, y, z, heading, range;
  char hit;
  double expected;
};

TEST(KnownReadings, OfStage43) {
  const KnownWorld known;
  const Reading readings[] = {
      {0.1, 0.2, 0.5, 0, 8, '-', 8},
      {0.1, 0.2, 0.5, 0.6, 8, 'A', 2.9079079548295601},
      {0.1, 0.2, 0.5, 0.75, 8, 'A', 3.2800826992133425},
      {0.1, 0.2, 0.5, 2.7, 8, 'B', 2.3449456093958401},
      {0.1, 0.2, 0.5, 3.0, 8, 'C', 5.1111498494944492},
      {0.1, 0.2, 0.5, -3.1, 8, 'C', 5.0643799275963906},
      {0.1, 0.2, 0.5, M_PI, 8, 'C', 5.0599999999999996},
      {0.1, 0.2, 0.5, -M_PI / 2, 9, 'E', 8.1600000000000001},
      {0.1, 0.2, 0.5, -0.8, 8, '-', 8},
      {0.1, 0.2, 0.1, -0.8, 8, 'D', 1.4218879757764089},
      {0.1, 0.2, 0.2, -0.8, 8, 'D', 1.4218879757764089},  // the heights just touch
      {0.1, 0.2, 0.21, -0.8, 8, '-', 8},
      {-0.015, -0.013, 0.5, -2.9, 8, 'C', 5.0929073748899869},
      {-0.015, -0.013, 0.5, 2.65, 8, 'B', 2.4331253625908591},
      {-0.015, -0.013, 0.5, 0.62, 8, 'A', 3.0901419977538711},
      {2.9, 1.9, 0.5, 1.0, 5, 'A', 0.71303706346687279},  // from inside
      {2.0, 2.0, 0.5, 0.1, 0.55, 'A', 0.50251045920022763},
      {2.505, 2.0, 0.5, 0.3, 0.021, 'A', 0},  // in the start cell
      {9.7, 6.1, 0.5, -2.2, 18.5, 'E', 17.415043447913526},
      // Stage 4.3 finds nothing here, because its rays end early.
      {2.0, 2.0, 0.5, 0.1, 0.51, 'A', 0.50251045920022763},
      {2.505, 2.0, 0.5, 0.3, 0.019, 'A', 0},
      {9.7, 6.1, 0.5, -2.2, 17.6, 'E', 17.415043447913526},
  };
  for (const Reading& r : readings) {
    const Pose from(r.x, r.y, r.z, r.heading);
    const RaytraceResult found = Look(known.world.get(), from, r.range);
    const std::string which = from.String() + " " + std::to_string(r.range);
    EXPECT_EQ(found.mod, known.models.at(r.hit)) << which;
    if (r.hit == '-')
      EXPECT_EQ(found.range, r.expected) << which;
    else
      EXPECT_NEAR(found.range, r.expected, Slack(r.heading)) << which;
    EXPECT_LE(found.range, r.range);
    EXPECT_EQ(found.pose, from);
  }
}

TEST(KnownReadings, ColoursAreThoseOfTheModelHit) {
  const KnownWorld known;
  known.models.at('A')->SetColor(Color(0.25, 0.5, 0.75, 1));
  const RaytraceResult hit = Look(known.world.get(), Pose(0.1, 0.2, 0.5, 0.6), 8);
  EXPECT_EQ(hit.color, Color(0.25, 0.5, 0.75, 1));
  const RaytraceResult miss = Look(known.world.get(), Pose(0.1, 0.2, 0.5, 0), 8);
  EXPECT_EQ(miss.color, Color(1, 0, 0, 1));
}

TEST(KnownReadings, PredicateFinderArgumentAndHeights) {
  const KnownWorld known;
  World* world = known.world.get();
  struct Asked {
    const Model* finder = nullptr;
    const Model* refused = nullptr;
  };
  static Asked asked;
  const auto predicate = [](Model* candidate, const Model* finder, const void* arg) {
    asked.finder = finder;
    return candidate != arg;
  };
  Model* a = known.models.at('A');
  Model* c = known.models.at('C');
  const Ray ray(c, Pose(3, 2, 0.5, M_PI), 20, predicate, a, true);
  EXPECT_EQ(world->Raytrace(ray).mod, nullptr);  // A is transparent, everything else is lower
  EXPECT_EQ(asked.finder, c);
  EXPECT_EQ(world->Raytrace(Ray(c, Pose(3, 2, 0.5, M_PI), 20, predicate, c, true)).mod, a);
  // Without the test of heights, the ray sees D from above.
  EXPECT_EQ(Look(world, Pose(0.1, 0.2, 5, -0.8), 8).mod, nullptr);
  EXPECT_EQ(world->Raytrace(Pose(0.1, 0.2, 5, -0.8), 8, Any, nullptr, nullptr, false).mod,
            known.models.at('D'));
}

// ---- fans ---------------------------------------------------------------------------------------

TEST(Fans, RaysAreSpreadFromRightToLeft) {
  const KnownWorld known;
  for (const double fov : {M_PI, 2 * M_PI, 1.0, 0.0, -1.0})
    for (const size_t count : {2u, 3u, 180u}) {
      std::vector<RaytraceResult> results(count);
      const Pose from(0.1, 0.2, 0.5, 0.4);
      known.world->Raytrace(from, 30, fov, Any, nullptr, nullptr, true, results);
      for (size_t i = 0; i < count; i++) {
        Pose ray = from;
        ray.a += -fov / 2 + static_cast<double>(i) * fov / static_cast<double>(count - 1);
        const RaytraceResult single = Look(known.world.get(), ray, 30);
        // Headings in a fan are rounded once more, so cells differ in rare cases.
        EXPECT_EQ(results[i].mod, single.mod) << fov << " " << i;
        EXPECT_NEAR(results[i].range, single.range, 2.1 * kCell) << fov << " " << i;
      }
    }
}

TEST(Fans, ASingleRayLooksAhead) {
  const KnownWorld known;
  for (const double fov : {0.0, 1.0, 2 * M_PI, kInfinity, kNaN}) {
    std::vector<RaytraceResult> results(1);
    const Pose from(0.1, 0.2, 0.5, 0.6);
    known.world->Raytrace(from, 8, fov, Any, nullptr, nullptr, true, results);
    EXPECT_EQ(results[0].mod, known.models.at('A'));
    EXPECT_EQ(results[0].range, Look(known.world.get(), from, 8).range);
  }
}

TEST(Fans, NoRays) {
  const KnownWorld known;
  std::vector<RaytraceResult> results;
  known.world->Raytrace(Pose(), 8, 1, Any, nullptr, nullptr, true, results);
  EXPECT_TRUE(results.empty());
}

// ---- unusual arguments --------------------------------------------------------------------------

TEST(OddRays, NothingHitGivesTheRangeItself) {
  const std::unique_ptr<World> world = EmptyWorld();
  for (const double range : {0.0, 0.001, 1.0 / 3, 8.0, 1e9, 1e300, kInfinity, -1.0}) {
    EXPECT_EQ(Look(world.get(), Pose(1, 2, 0.5, 0.7), range).range, range);
    EXPECT_EQ(Look(world.get(), Pose(1, 2, 0.5, 0.7), range).mod, nullptr);
  }
  EXPECT_TRUE(std::isnan(Look(world.get(), Pose(1, 2, 0.5, 0.7), kNaN).range));
}

TEST(OddRays, NonFinitePosesHitNothing) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(4, 4, 4), Pose());
  AddBox(world.get(), Size(0.01, 0.01, 4), Pose(0.01, 0.01, 0, 0));
  for (const double bad : {kNaN, kInfinity, -kInfinity})
    for (const Pose& from : {Pose(bad, 0, 1, 0), Pose(0, bad, 1, 0), Pose(0, 0, 1, bad)}) {
      const RaytraceResult found = Look(world.get(), from, 8);
      EXPECT_EQ(found.mod, nullptr) << from.String();
      EXPECT_EQ(found.range, 8) << from.String();
    }
}

TEST(OddRays, HugeHeadingsTerminate) {
  const std::unique_ptr<World> world = EmptyWorld();
  AddBox(world.get(), Size(4, 4, 4), Pose());
  for (const double heading : {1e6, -1e9, 1e100, 1e308})
    EXPECT_NE(Look(world.get(), Pose(0, 0, 1, heading), 8).mod, nullptr) << heading;
}

// ---- random worlds ------------------------------------------------------------------------------

/// The cells of a world's boxes, rasterized independently of the library.
using Picture = std::map<std::pair<int64_t, int64_t>, std::vector<Model*>>;

void Draw(Picture* picture, Model* model) {
  const Size size = model->GetGeom().size;
  const double x = size.x / 2, y = size.y / 2;
  const std::vector<point_int_t> corners =
      model->LocalToPixels({point_t(-x, -y), point_t(x, -y), point_t(x, y), point_t(-x, y)});
  internal::grid::ForEachCellOfOutline(corners.data(), corners.size(), [&](int32_t cx, int32_t cy) {
    (*picture)[{cx, cy}].push_back(model);
  });
}

/// The model that the reference walk finds.
Model* Expected(const Picture& picture, const Pose& from, double range) {
  const auto fixed = [](double value) { return static_cast<int64_t>(std::floor(value * 65536)); };
  const double x = from.x * 50, y = from.y * 50;
  const SineCosine heading = SinCos(from.a);
  const auto rounded = [&](double value) {
    return static_cast<int64_t>(std::copysign(std::floor(std::fabs(value) + 0.5), value));
  };
  const test::PlainRay ray{static_cast<int64_t>(std::floor(x)),
                           static_cast<int64_t>(std::floor(y)),
                           fixed(x - std::floor(x)),
                           fixed(y - std::floor(y)),
                           rounded(heading.cosine * (range * 50) * 65536),
                           rounded(heading.sine * (range * 50) * 65536)};
  Model* hit = nullptr;
  test::WalkPlainly(ray, [&](int64_t, int64_t, int64_t cx, int64_t cy) {
    const auto found = picture.find({cx, cy});
    if (found == picture.end()) return false;
    hit = *std::min_element(found->second.begin(), found->second.end(),
                            [](Model* a, Model* b) { return a->GetId() < b->GetId(); });
    return true;
  });
  return hit;
}

TEST(RandomWorlds, EveryRayHitsWhatThePlainWalkFinds) {
  RandomSource random(2);
  int hits = 0;
  for (const double centre : {0.0, 50.0, -50.0, 1e6}) {
    const std::unique_ptr<World> world = EmptyWorld();
    Picture picture;
    for (int i = 0; i < 60; i++) {
      Model* box = AddBox(world.get(), Size(random.Real(0.03, 3), random.Real(0.03, 3), 1),
                          Pose(centre + random.Real(-15, 15), centre + random.Real(-15, 15), 0,
                               random.Real(-3, 3)));
      Draw(&picture, box);
    }
    for (int i = 0; i < 8000; i++) {
      const Pose from(centre + random.Real(-20, 20), centre + random.Real(-20, 20), 0.5,
                      random.OneIn(10) ? random.Int(-2, 2) * M_PI / 2 : random.Real(-3, 3));
      const double range = random.Real(0.01, 30);
      const RaytraceResult found = Look(world.get(), from, range);
      ASSERT_EQ(found.mod, Expected(picture, from, range)) << from.String() << " " << range;
      if (!found.mod) {
        ASSERT_EQ(found.range, range);
        continue;
      }
      hits++;
      ASSERT_GE(found.range, 0);
      ASSERT_LE(found.range, range);
      // The end point of the range must be in or next to a cell of the model hit.
      const double far_x = from.x + found.range * std::cos(from.a);
      const double far_y = from.y + found.range * std::sin(from.a);
      bool close = false;
      for (int dx = -1; dx <= 1; dx++)
        for (int dy = -1; dy <= 1; dy++) {
          const auto at = picture.find({static_cast<int64_t>(std::floor(far_x * 50 + dx * 0.001)),
                                        static_cast<int64_t>(std::floor(far_y * 50 + dy * 0.001))});
          close |= at != picture.end();
        }
      ASSERT_TRUE(close) << from.String() << " " << found.range;
    }
  }
  EXPECT_GT(hits, 12000);
}

TEST(RandomWorlds, LineOfSightIsSymmetric) {
  // A free line of sight is free from both ends, and a body across it is seen from both ends.
  RandomSource random(3);
  const std::unique_ptr<World> world = EmptyWorld();
  Model* box = AddBox(world.get(), Size(0.2, 0.2, 1), Pose());
  for (int i = 0; i < 5000; i++) {
    const double heading = random.Real(-3, 3), length = random.Real(2, 20);
    const Pose a(random.Real(-10, 10), random.Real(-10, 10), 0.5, heading);
    const Pose b(a.x + length * std::cos(heading), a.y + length * std::sin(heading), 0.5,
                 normalize(heading + M_PI));
    const double part = random.Real(0.2, 0.8) * length;
    box->SetPose(Pose(a.x + part * std::cos(heading), a.y + part * std::sin(heading), 0,
                      random.Real(-3, 3)));
    EXPECT_EQ(Look(world.get(), a, length).mod, box);
    EXPECT_EQ(Look(world.get(), b, length).mod, box);
    box->AddToPose(-0.5 * std::sin(heading), 0.5 * std::cos(heading), 0, 0);
    EXPECT_EQ(Look(world.get(), a, length).mod, nullptr);
    EXPECT_EQ(Look(world.get(), b, length).mod, nullptr);
  }
}

}  // namespace
}  // namespace Stg
