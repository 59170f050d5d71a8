// SPDX-License-Identifier: GPL-2.0-or-later
//
// Fans that are traced together give bit-equal hits to rays that are traced alone.

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <limits>
#include <memory>
#include <vector>

#include "sensing/tracer.hh"
#include "support/fan_with_own_directions.hh"
#include "support/hit_lists.hh"
#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

using test::RandomSource;

/// Stands for a model, of which only the address is used.
struct Tag {
  int number;
};
Tag tags[64];
Model* ModelOf(int i) { return reinterpret_cast<Model*>(&tags[i]); }

/// A predicate that refuses models whose bit is set, and the finder itself.
bool NotRefused(Model* candidate, const Model* finder, const void* arg) {
  const auto number = reinterpret_cast<const Tag*>(candidate) - tags;
  return candidate != finder && !(*static_cast<const uint64_t*>(arg) >> number & 1);
}

/// Walls along the axes, each of a separate model; some only for exact rays.
class Scene {
 public:
  static constexpr int kReach = 150, kWalls = 60;

  explicit Scene(RandomSource* random) : random_(*random) {
    for (int i = 0; i < kWalls; i++) AddWall(i, i % 3 == 0);
  }

  /// Makes fans of the sensors of several robots, robot by robot. The resolution is one metre.
  void MakeBatch(int robots) {
    batch.Clear();
    for (int i = 0; i < robots; i++) {
      const int wall = random_.Int(0, kWalls - 1);  // the robot's body
      grid::Rasterizations body;
      if (random_.OneIn(2)) body.of_bodies.push_back(&cells_[wall]);
      const SelfMask mask = batch.MakeSelfMask(grid, body, ModelOf(wall), false);
      const Pose pose(Coordinate(), Coordinate(), random_.Int(0, 3), random_.Real(-4, 4));
      const int fans = random_.Int(1, 12);
      for (int k = 0; k < fans; k++) AddFan(pose, ModelOf(wall), mask);
    }
    batch.Close(tables_);
  }

  grid::Grid grid;
  RayBatch batch;
  uint64_t refused = 0;

 private:
  double Coordinate() { return random_.Real(-1.1, 1.1) * kReach; }

  void AddWall(int number, bool exact) {
    int x = random_.Int(-kReach, kReach), y = random_.Int(-kReach, kReach);
    int length = random_.Int(1, 60);
    // Many are aligned with a tile, so that self-masks have equal sizes at different places.
    if (random_.OneIn(2)) x &= ~7, y &= ~7, length = 8;
    const bool upwards = random_.OneIn(2);
    grid::Body body;
    body.z_min = random_.Int(0, 2);
    body.z_max = body.z_min + random_.Int(0, 2);
    body.model = ModelOf(number);
    body.tree = body.model;
    if (exact) {
      corners_[number] = {{x + 0.5, y + 0.5},
                          {upwards ? x + 0.5 : x + length - 0.5,  //
                           upwards ? y + length - 0.5 : y + 0.5}};
      body.corners = corners_[number].data();
      body.edges = 1;
      body.x = x;
      body.y = y;
      body.radius = length + 2;
    }
    grid::CellSetBuilder maker(&cells_[number]);
    for (int k = 0; k < length; k++) maker.Add(upwards ? x : x + k, upwards ? y + k : y);
    maker.Finish();
    if (exact)
      for (grid::CellSet& set : cells_[number]) set.edges = 1;
    grid.Rasterize(grid.AddBody(body), {}, cells_[number]);
  }

  void AddFan(const Pose& pose, const Model* finder, const SelfMask& mask) {
    Fan fan;
    const double endless = std::numeric_limits<double>::infinity();
    const double range =
        random_.OneIn(12) ? random_.Pick<double>({0, 1e5, endless}) : random_.Real(0, 2 * kReach);
    PlaceFan(&fan, pose, range, 1);
    fan.exact = random_.OneIn(8);
    fan.z_test = !random_.OneIn(6);
    fan.layer = random_.OneIn(8) ? grid.EverythingLayer(fan.exact)
                                 : grid.RangerLayer(fan.z, fan.z_test, fan.exact);
    fan.predicate = NotRefused;
    fan.finder = finder;
    fan.arg = &refused;
    const auto samples = static_cast<uint32_t>(random_.OneIn(8)   ? 0
                                               : random_.OneIn(8) ? random_.Int(250, 700)
                                                                  : random_.Int(1, 90));
    const SelfMask none;
    const SelfMask& seen = fan.exact || random_.OneIn(6) ? none : mask;
    if (random_.OneIn(4)) {
      std::vector<double> own;
      for (uint32_t i = 0; i < samples; i++) own.push_back(random_.Real(-3, 3));
      test::AddTurned(&batch, fan, own, seen);
    } else {
      fan.record.first_direction = tables_.Find(random_.Int(0, 6), samples);
      batch.Add(fan, samples, seen);
    }
  }

  RandomSource& random_;
  DirectionTables tables_;
  std::vector<grid::CellSet> cells_[kWalls];
  std::vector<point_t> corners_[kWalls];
};

struct Outcome {
  std::vector<RayHit> hits;
  TraceCounters counters;
};

/// Traces each ray alone, without hit lists, by the walk of ray_walk.h.
Outcome RayByRay(const Scene& scene) {
  const RayBatch& batch = scene.batch;
  Outcome outcome;
  for (const Fan& fan : batch.fans()) {
    const ray_grid_t view = scene.grid.View(fan.layer);
    for (uint32_t i = 0; i < fan.record.samples; i++)
      outcome.hits.push_back(Tracer(scene.grid)
                                 .Trace(fan, view,
                                        {batch.DirectionsOf(fan)[i], batch.UnitVectorsOf(fan)[i]},
                                        batch.SelfMaskOf(fan), &outcome.counters));
  }
  return outcome;
}

/// Traces the fans `at_once` at a time.
Outcome Together(const Scene& scene, const HitLists& lists, uint32_t at_once) {
  Outcome outcome;
  outcome.hits = test::TraceBatch(scene.grid, scene.batch, lists, at_once, &outcome.counters);
  return outcome;
}

bool HasExactFans(const Scene& scene) {
  return std::ranges::any_of(scene.batch.fans(), [](const Fan& fan) { return fan.exact; });
}

/// Groups of exact rays examine fewer cells than single ones: they know which edges lie in the
/// cells of the first hit, and skip cells of the same edges.
void ExpectSame(const Outcome& found, const Outcome& expected, bool exact) {
  ASSERT_EQ(found.hits.size(), expected.hits.size());
  for (size_t i = 0; i < found.hits.size(); i++) {
    ASSERT_EQ(found.hits[i].model, expected.hits[i].model) << i;
    ASSERT_EQ(std::bit_cast<uint64_t>(found.hits[i].range),
              std::bit_cast<uint64_t>(expected.hits[i].range))
        << i << ": " << found.hits[i].range << ", not " << expected.hits[i].range;
  }
  EXPECT_EQ(found.counters.rays, expected.counters.rays);
  EXPECT_LE(found.counters.potential_hits, expected.counters.potential_hits);
  if (exact) return;
  EXPECT_EQ(found.counters.potential_hits, expected.counters.potential_hits);
}

TEST(RayGroup, GroupedFansEqualSingleRays) {
  RandomSource random(1);
  uint64_t exact = 0, long_rays = 0, none = 0, many = 0, hits = 0, told = 0;
  for (int round = 0; round < 40; round++) {
    Scene scene(&random);
    for (int batch = 0; batch < 3; batch++) {
      scene.refused = random.OneIn(3) ? 0 : random.Next() & random.Next();
      scene.MakeBatch(random.Int(1, 12));
      const Outcome expected = RayByRay(scene);
      for (const uint32_t at_once : {1u, 2u, 5u, 1000u}) {
        const Outcome found = Together(scene, HitLists(), at_once);
        ASSERT_NO_FATAL_FAILURE(ExpectSame(found, expected, HasExactFans(scene)))
            << at_once << " fans at once";
        EXPECT_EQ(found.counters.resumed, 0u);
        for (const uint32_t per_ray : {1u, 2u}) {
          // Supply the bodies of all hits, of half of them, or of none.
          const std::vector<uint32_t> lists = test::ListHits(scene.grid, scene.batch, per_ray, [&] {
            return batch > 0 && (batch == 2 || random.OneIn(2));
          });
          for (size_t i = 0; i < lists.size(); i += 1 + per_ray)
            told += lists[i] != 0 && lists[i + 1] != RAY_NO_HIT;
          const HitLists known{lists.data(), per_ray};
          ASSERT_NO_FATAL_FAILURE(
              ExpectSame(Together(scene, known, at_once), expected, HasExactFans(scene)))
              << at_once << " fans at once, with lists of " << per_ray;
        }
      }
      for (const Fan& fan : scene.batch.fans()) {
        exact += fan.exact;
        long_rays += fan.legs > 1;
        none += fan.record.samples == 0;
        many += fan.record.samples > 256 && fan.single_leg() && !fan.exact;
      }
      for (const RayHit& hit : expected.hits) hits += hit.model != nullptr;
    }
  }
  // Check that all cases occurred.
  EXPECT_GT(std::min({exact, long_rays, none, many}), 50u);
  EXPECT_GT(hits, 5000u);
  EXPECT_GT(told, 5000u);
}

// The number of rays that continue past their hit lists does not depend on grouping.
TEST(RayGroup, CountsResumedRays) {
  RandomSource random(2);
  Scene scene(&random);
  scene.refused = 0x5555555555555555;
  scene.MakeBatch(12);
  const std::vector<uint32_t> lists = test::ListHits(scene.grid, scene.batch, 1);
  const Outcome alone = Together(scene, {lists.data(), 1}, 1);
  EXPECT_GT(alone.counters.resumed, 0u);
  EXPECT_EQ(Together(scene, {lists.data(), 1}, 1000).counters.resumed, alone.counters.resumed);
}

}  // namespace
}  // namespace Stg::internal::sensing
