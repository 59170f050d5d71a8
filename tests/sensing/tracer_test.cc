// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tracing, with and without the hit lists of a prefilter, compared with the reference walk.

#include "sensing/tracer.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "support/draw_cells.hh"
#include "support/fan_with_own_directions.hh"
#include "support/hit_lists.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"

namespace Stg::internal::sensing {
namespace {

using test::PlainRay;
using test::RandomSource;
using Cell = std::pair<int64_t, int64_t>;

/// Stands for a model, of which only the address is used.
struct Tag {
  int number;
};
Tag tags[64];
Model* ModelOf(int i) { return reinterpret_cast<Model*>(&tags[i]); }
int NumberOf(const Model* model) {
  return static_cast<int>(reinterpret_cast<const Tag*>(model) - tags);
}

uint64_t BitsOf(double value) { return std::bit_cast<uint64_t>(value); }

/// A predicate that refuses models whose bit is set.
bool NotRefused(Model* candidate, const Model*, const void* arg) {
  return !(*static_cast<const uint64_t*>(arg) >> NumberOf(candidate) & 1);
}

struct Scene {
  grid::Grid grid;
  std::map<Cell, std::vector<int>> cells;  // indices of bodies, in order
  std::vector<grid::BodyId> ids;
  uint64_t refused = 0;
  uint64_t hidden = 0;  // bodies that all rangers refuse, so layers for rangers may omit them

  int AddBody(double z_min, double z_max, bool visible = true) {
    grid::Body body;
    body.z_min = z_min;
    body.z_max = z_max;
    body.ranger_visible = visible;
    body.model = ModelOf(static_cast<int>(ids.size()));
    body.tree = body.model;
    if (!visible) hidden |= uint64_t{1} << ids.size();
    ids.push_back(grid.AddBody(body));
    return static_cast<int>(ids.size()) - 1;
  }
  grid::CellRef Draw(int body, int32_t x, int32_t y) {
    cells[{x, y}].push_back(body);
    return test::DrawCellOnce(&grid, x, y, ids[static_cast<size_t>(body)]);
  }

  Fan MakeFan(const Pose& origin, double range, bool z_test = true) const {
    Fan fan;
    PlaceFan(&fan, origin, range, 1);  // the resolution is one metre
    fan.z_test = z_test;
    fan.predicate = NotRefused;
    fan.arg = &refused;
    return fan;
  }

  /// The expected hit, by the rules, cell by cell.
  RayHit Expected(const Fan& fan, const Direction& d) const {
    if (fan.nothing) return {fan.range, nullptr};
    const FanRecord& r = fan.record;
    const int64_t dx = ray_rotate_x(r.cosine, r.sine, d.cosine, d.sine);
    const int64_t dy = ray_rotate_y(r.cosine, r.sine, d.cosine, d.sine);
    const double legs = std::min(fan.legs, 5000.0);
    const PlainRay ray{r.x,
                       r.y,
                       r.fraction & 0xffff,
                       r.fraction >> 16,
                       dx * static_cast<int64_t>(legs),
                       dy * static_cast<int64_t>(legs)};
    RayHit hit{fan.range, nullptr};
    test::WalkPlainly(ray, [&](int64_t u, int64_t v, int64_t x, int64_t y) {
      const auto found = cells.find({x, y});
      if (found == cells.end()) return false;
      for (const int i : found->second) {
        const grid::Body& body = grid.body(ids[static_cast<size_t>(i)]);
        if (fan.z_test && (fan.z < body.z_min || fan.z > body.z_max)) continue;
        if (refused >> i & 1) continue;
        hit = {Middle(ray, u, v) * fan.leg_length * legs, body.model};
        return true;
      }
      return false;
    });
    return hit;
  }

  /// The middle of the ray's path through a cell, as a fraction of its length.
  static double Middle(const PlainRay& ray, int64_t u, int64_t v) {
    long double in = 0, out = 1;
    const auto cut = [&](int64_t n, int64_t fraction, int64_t displacement) {
      if (displacement == 0) return;
      const int64_t offset = displacement < 0 ? 65536 - fraction : fraction;
      const long double length = static_cast<long double>(std::abs(displacement));
      in = std::max(in, static_cast<long double>(n * 65536 - offset) / length);
      out = std::min(out, static_cast<long double>((n + 1) * 65536 - offset) / length);
    };
    cut(u, ray.fx, ray.dx);
    cut(v, ray.fy, ray.dy);
    return static_cast<double>((in + out) / 2);
  }
};

/// Adds bodies in crowded cells, with various heights, some invisible to rangers.
void Fill(Scene* scene, RandomSource* random, int reach, int count) {
  for (int i = 0; i < 20; i++)
    scene->AddBody(random->Int(0, 1), random->Int(1, 3), !random->OneIn(5));
  for (int i = 0; i < count; i++)
    scene->Draw(random->Int(0, 19), random->Int(-reach, reach), random->Int(-reach, reach));
}

void ExpectSame(const RayHit& found, const RayHit& expected, const char* what) {
  EXPECT_EQ(found.model, expected.model) << what;
  if (found.model)
    EXPECT_NEAR(found.range, expected.range, 1e-9 * (1 + expected.range)) << what;
  else
    EXPECT_EQ(found.range, expected.range) << what;
}

const ray_mask_t kNoMask{nullptr, 0, 0, 0, 0};
constexpr Tracer::RayDirection kAhead{{1 << 30, 0}, {.sine = 0, .cosine = 1}};

RayHit TraceOne(const Scene& scene, const Fan& fan, const Tracer::RayDirection& bearing = kAhead) {
  TraceCounters counters;
  return Tracer(scene.grid).Trace(fan, scene.grid.View(fan.layer), bearing, kNoMask, &counters);
}

TEST(Tracer, TheNearestAcceptedBody) {
  RandomSource random(1);
  int hits = 0;
  for (int round = 0; round < 40; round++) {
    Scene scene;
    Fill(&scene, &random, 60, random.Int(5, 2000));
    for (int i = 0; i < 1000; i++) {
      scene.refused = random.OneIn(2) ? 0 : random.Next() & random.Next();
      Fan fan = scene.MakeFan(
          Pose(random.Real(-70, 70), random.Real(-70, 70), random.Int(-1, 4), random.Real(-4, 4)),
          random.Real(0, 120), !random.OneIn(4));
      if (random.OneIn(2)) {
        scene.refused |= scene.hidden;
        fan.layer = scene.grid.RangerLayer(fan.z, fan.z_test);
      }
      const RayHit found = TraceOne(scene, fan);
      ExpectSame(found, scene.Expected(fan, kAhead.fixed_point), "one ray");
      hits += found.model != nullptr;
      if (::testing::Test::HasFailure()) return;
    }
  }
  EXPECT_GT(hits, 5000);
}

TEST(Tracer, HeightIntervalsIncludeTheirEnds) {
  Scene scene;
  scene.Draw(scene.AddBody(1, 2), 10, 0);
  const auto sees = [&](double z, bool z_test) {
    return TraceOne(scene, scene.MakeFan(Pose(0.5, 0.5, z, 0), 20, z_test)).model != nullptr;
  };
  EXPECT_TRUE(sees(1, true));
  EXPECT_TRUE(sees(2, true));
  EXPECT_FALSE(sees(0.999, true));
  EXPECT_FALSE(sees(2.001, true));
  EXPECT_TRUE(sees(77, false));
}

TEST(Tracer, TheFirstBodyOfACellWins) {
  Scene scene;
  for (int i = 0; i < 3; i++) scene.Draw(scene.AddBody(0, 1), 10, 0);
  const Fan fan = scene.MakeFan(Pose(0.5, 0.5, 0, 0), 20);
  EXPECT_EQ(TraceOne(scene, fan).model, ModelOf(0));
  scene.refused = 1;
  EXPECT_EQ(TraceOne(scene, fan).model, ModelOf(1));
  scene.refused = 7;
  EXPECT_EQ(TraceOne(scene, fan).model, nullptr);
  EXPECT_EQ(TraceOne(scene, fan).range, 20);
}

TEST(Tracer, TheRangeIsThatOfTheMiddleOfTheCell) {
  Scene scene;
  scene.Draw(scene.AddBody(0, 1), 10, 10);
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(0.5, 10.5, 0, 0), 20)).range, 10);
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(20.25, 10.5, 0, M_PI), 20)).range, 9.75);
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(10.5, 0, 0, M_PI / 2), 20)).range, 10.5);
  // If the ray starts or ends inside of the cell, the range is the middle of the remaining path.
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(10.5, 10.5, 0, 0), 20)).range, 0.25);
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(0, 10.5, 0, 0), 10.5)).range, 10.25);
  EXPECT_DOUBLE_EQ(TraceOne(scene, scene.MakeFan(Pose(10.5, 10.5, 0, 0), 0.25)).range, 0.125);
}

TEST(Tracer, FansThatCastNothing) {
  Scene scene;
  scene.Draw(scene.AddBody(0, 1), 0, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(0.5, 0.5, 0, 0), 0)).model, nullptr);
  EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(0.5, 0.5, 0, 0), 0)).range, 0);
  EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(nan, 0.5, 0, 0), 5)).model, nullptr);
  EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(nan, 0.5, 0, 0), 5)).range, 5);
  EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(2e9, 0.5, 0, 0), 5)).model, nullptr);
}

TEST(Tracer, CountsRaysAndHits) {
  Scene scene;
  for (int i = 0; i < 3; i++) scene.Draw(scene.AddBody(0, 1), 10 + i, 0);
  scene.refused = 3;
  TraceCounters counters;
  const Fan fan = scene.MakeFan(Pose(0.5, 0.5, 0, 0), 20);
  Tracer(scene.grid).Trace(fan, scene.grid.View(0), kAhead, kNoMask, &counters);
  EXPECT_EQ(counters.rays, 1u);
  EXPECT_EQ(counters.potential_hits, 3u);
  EXPECT_EQ(counters.resumed, 0u);
}

// ---- hit lists ----------------------------------------------------------------------------------

std::vector<RayHit> TraceAll(const Scene& scene, const RayBatch& batch, const HitLists& lists,
                             TraceCounters* counters) {
  return test::TraceBatch(scene.grid, batch, lists, 1, counters);
}

/// Makes a batch of fans of all kinds.
void MakeBatch(Scene* scene, RandomSource* random, DirectionTables* tables, RayBatch* batch) {
  for (int i = 0; i < 30; i++) {
    const double range = random->OneIn(8)   ? 1e5
                         : random->OneIn(8) ? std::numeric_limits<double>::infinity()
                                            : random->Real(0, 300);
    Fan fan = scene->MakeFan(
        Pose(random->Real(-90, 90), random->Real(-90, 90), random->Int(-1, 4), random->Real(-4, 4)),
        random->OneIn(20) ? 0 : range, !random->OneIn(4));
    fan.layer = scene->grid.RangerLayer(fan.z, fan.z_test);
    const uint32_t samples = static_cast<uint32_t>(random->Int(1, 30));
    if (random->OneIn(4)) {
      std::vector<double> own;
      for (uint32_t j = 0; j < samples; j++) own.push_back(random->Real(-3, 3));
      test::AddTurned(batch, fan, own, SelfMask());
    } else {
      fan.record.first_direction = tables->Find(random->Int(0, 3), samples);
      batch->Add(fan, samples, SelfMask());
    }
  }
  batch->Close(*tables);
}

TEST(TracerLists, GiveTheSameBitsAsTracingWithoutLists) {
  RandomSource random(2);
  for (int round = 0; round < 40; round++) {
    Scene scene;
    Fill(&scene, &random, 80, random.Int(5, 6000));
    scene.refused = random.Next() & random.Next() & 0xfffff;
    if (random.OneIn(3)) scene.refused = 0xffffe;  // nearly all, which needs long lists
    scene.refused |= scene.hidden;
    DirectionTables tables;
    RayBatch batch;
    MakeBatch(&scene, &random, &tables, &batch);
    TraceCounters plain;
    const std::vector<RayHit> expected = TraceAll(scene, batch, HitLists(), &plain);
    EXPECT_EQ(plain.resumed, 0u);
    EXPECT_EQ(plain.rays, batch.ray_count());
    for (const uint32_t per_ray : {1u, 2u, 3u, 4u, 50u}) {
      const std::vector<uint32_t> lists = test::ListHits(scene.grid, batch, per_ray);
      TraceCounters counters;
      const std::vector<RayHit> found =
          TraceAll(scene, batch, HitLists{lists.data(), per_ray}, &counters);
      for (size_t i = 0; i < found.size(); i++) {
        ASSERT_EQ(found[i].model, expected[i].model);
        ASSERT_EQ(BitsOf(found[i].range), BitsOf(expected[i].range));
      }
      // The number of examined cells must be equal.
      EXPECT_EQ(counters.rays, plain.rays);
      EXPECT_EQ(counters.potential_hits, plain.potential_hits);
    }
  }
}

TEST(TracerLists, MatchTheReferenceWalk) {
  RandomSource random(3);
  for (int round = 0; round < 10; round++) {
    Scene scene;
    Fill(&scene, &random, 80, 1000);
    scene.refused = (random.Next() & 0xfffff) | scene.hidden;
    DirectionTables tables;
    RayBatch batch;
    MakeBatch(&scene, &random, &tables, &batch);
    const std::vector<uint32_t> lists = test::ListHits(scene.grid, batch, 2);
    TraceCounters counters;
    const std::vector<RayHit> found = TraceAll(scene, batch, HitLists{lists.data(), 2}, &counters);
    EXPECT_GT(counters.resumed, 0u);
    for (const Fan& fan : batch.fans()) {
      if (!fan.single_leg()) continue;
      for (uint32_t i = 0; i < fan.record.samples; i++)
        ExpectSame(found[fan.record.first_ray + i], scene.Expected(fan, batch.DirectionsOf(fan)[i]),
                   "a ray of a fan");
    }
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(TracerLists, ShortListsAreTrusted) {
  Scene scene;
  for (int i = 0; i < 3; i++) scene.Draw(scene.AddBody(0, 1), 10 * (i + 1), 0);
  const Fan fan = scene.MakeFan(Pose(0.5, 0.5, 0, 0), 50);
  DirectionTables tables;
  RayBatch batch;
  batch.Add(fan, 1, SelfMask());
  batch.Close(tables);
  const auto trace = [&](std::vector<uint32_t> list, TraceCounters* counters) {
    const auto per_ray = static_cast<uint32_t>(list.size());
    list.insert(list.begin(), 0);  // 0: the body is unknown
    return TraceAll(scene, batch, HitLists{list.data(), per_ray}, counters)[0].model;
  };
  TraceCounters counters;
  // The end of a list means that there are no further hits, so the host examines nothing.
  EXPECT_EQ(trace({RAY_NO_HIT}, &counters), nullptr);
  EXPECT_EQ(counters.potential_hits, 0u);
  scene.refused = 1;
  EXPECT_EQ(trace({ray_pack(10, 0), RAY_NO_HIT, ray_pack(20, 0)}, &counters), nullptr);
  EXPECT_EQ(counters.potential_hits, 1u);
  EXPECT_EQ(counters.resumed, 0u);
  // After a full list, the host continues the walk.
  EXPECT_EQ(trace({ray_pack(10, 0)}, &counters), ModelOf(1));
  EXPECT_EQ(counters.resumed, 1u);
  scene.refused = 3;
  EXPECT_EQ(trace({ray_pack(10, 0), ray_pack(20, 0)}, &counters), ModelOf(2));
  EXPECT_EQ(counters.resumed, 2u);
}

// ---- self-masks
// ------------------------------------------------------------------------------------

TEST(TracerSelfMasks, ExamineLessWithEqualResults) {
  RandomSource random(4);
  uint64_t with_looks = 0, without_looks = 0;
  for (int round = 0; round < 60; round++) {
    Scene scene;
    Fill(&scene, &random, 60, 1000);
    const int me = scene.AddBody(0, 3);
    scene.refused = uint64_t{1} << me;
    std::vector<grid::CellRef> own;
    for (int i = 0; i < 40; i++) {
      own.push_back(scene.Draw(me, i / 2, 20));
      own.push_back(scene.Draw(me, i / 2, -20 + i));
      own.push_back(scene.Draw(me, 0, i - 20));
    }
    const std::vector<grid::CellSet> parts = test::CellSetsOf(scene.grid, own);
    DirectionTables tables;
    Fan fan = scene.MakeFan(Pose(random.Real(0, 20), random.Real(-20, 20), 1, 0), 60);
    fan.record.first_direction = tables.Find(6, 100);
    RayBatch with, without;
    with.Add(fan, 100, with.MakeSelfMask(scene.grid, {{&parts}}, ModelOf(me), false));
    without.Add(fan, 100, SelfMask());
    with.Close(tables);
    without.Close(tables);
    ASSERT_NE(with.SelfMaskOf(with.fans()[0]).width, 0u);
    TraceCounters counters_with, counters_without;
    const std::vector<RayHit> a = TraceAll(scene, with, HitLists(), &counters_with);
    const std::vector<RayHit> b = TraceAll(scene, without, HitLists(), &counters_without);
    for (size_t i = 0; i < a.size(); i++) {
      ASSERT_EQ(a[i].model, b[i].model);
      ASSERT_EQ(BitsOf(a[i].range), BitsOf(b[i].range));
    }
    with_looks += counters_with.potential_hits;
    without_looks += counters_without.potential_hits;
  }
  EXPECT_LT(with_looks, without_looks);
}

// ---- long rays ----------------------------------------------------------------------------------

TEST(TracerLegs, HitBeyondTheFirstLeg) {
  RandomSource random(5);
  for (int i = 0; i < 2000; i++) {
    Scene scene;
    const int body = scene.AddBody(0, 1);
    const double heading = random.OneIn(4) ? random.Int(-2, 2) * M_PI / 2 : random.Real(-4, 4);
    const double distance = random.Real(1, 120000);
    const double x = random.Real(-1e6, 1e6), y = random.Real(-1e6, 1e6);
    // Draw a cross, so that the ray hits some part of it.
    const int32_t cx = static_cast<int32_t>(std::floor(x + distance * std::cos(heading)));
    const int32_t cy = static_cast<int32_t>(std::floor(y + distance * std::sin(heading)));
    for (int32_t j = -5; j <= 5; j++) scene.Draw(body, cx + j, cy), scene.Draw(body, cx, cy + j);
    const double range = distance + random.Real(10, 100000);
    const Fan fan = scene.MakeFan(Pose(x, y, 0, heading), range);
    const RayHit found = TraceOne(scene, fan);
    ASSERT_NE(found.model, nullptr) << i;
    EXPECT_NEAR(found.range, distance, 9);
    ExpectSame(found, scene.Expected(fan, kAhead.fixed_point), "a long ray");
    // Infinite rays hit it, too.
    const Fan endless = scene.MakeFan(Pose(x, y, 0, heading), 1.0 / 0.0);
    ASSERT_NE(TraceOne(scene, endless).model, nullptr);
    EXPECT_NEAR(TraceOne(scene, endless).range, distance, 9);
    if (::testing::Test::HasFailure()) return;
  }
}

TEST(TracerLegs, WallsAtSeamsAreHit) {
  Scene scene;
  const int body = scene.AddBody(0, 1);
  const double range = 3.0 * RAY_LEG_CELLS;
  for (const int32_t at : {RAY_LEG_CELLS - 1, RAY_LEG_CELLS, RAY_LEG_CELLS + 1}) {
    scene.cells.clear();
    std::vector<grid::CellRef> drawn;
    for (int32_t y = -2; y <= 2; y++)
      for (const int32_t x : {at, -at - 1}) drawn.push_back(scene.Draw(body, x, y));
    // If the ray starts at a cell's corner, the seam of legs is on a border.
    for (const double start : {0.0, 0.5}) {
      const RayHit right = TraceOne(scene, scene.MakeFan(Pose(start, start, 0, 0), range));
      EXPECT_NEAR(right.range, at + 0.5 - start, 1e-9);
      const RayHit left = TraceOne(scene, scene.MakeFan(Pose(-start, start, 0, M_PI), range));
      EXPECT_NEAR(left.range, at + 0.5 - start, 1e-9);
    }
    for (const grid::CellRef cell : drawn) test::EraseCell(&scene.grid, cell, scene.ids[0]);
  }
}

TEST(TracerLegs, EndlessRays) {
  Scene scene;
  const int body = scene.AddBody(0, 1);
  scene.Draw(body, 900000000, 0);
  scene.Draw(body, -900000000, 0);
  const double endless = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(TraceOne(scene, scene.MakeFan(Pose(0.5, 0.5, 0, 0), endless)).range, 9e8, 1);
  EXPECT_NEAR(TraceOne(scene, scene.MakeFan(Pose(-0.5, 0.5, 0, M_PI), endless)).range, 9e8, 1);
  // A ray crosses the grid from one end to the other.
  EXPECT_NEAR(TraceOne(scene, scene.MakeFan(Pose(1e9, 0.5, 0, M_PI), endless)).range, 1e8, 1);
  // Without obstacles, the result is the fan's range, and the search ends.
  for (const double heading : {1.0, M_PI / 2, 1e-9, -2.0, M_PI / 2 + 1e-9}) {
    const RayHit hit = TraceOne(scene, scene.MakeFan(Pose(0.5, 5.5, 0, heading), endless));
    EXPECT_EQ(hit.model, nullptr) << heading;
    EXPECT_EQ(hit.range, endless);
  }
}

TEST(TracerLegs, EmptyGridsAndRaysThatLeadAway) {
  Scene scene;
  const double endless = std::numeric_limits<double>::infinity();
  for (const double range : {50000.0, 1e300, endless})
    for (const double heading : {0.0, 1.0, 2.0, M_PI, -1.0})
      EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(3, 4, 0, heading), range)).range, range);
  scene.Draw(scene.AddBody(0, 1), 1000, 1000);
  for (const double range : {50000.0, 1e300, endless})
    EXPECT_EQ(TraceOne(scene, scene.MakeFan(Pose(3, 4, 0, -2), range)).range, range);
}

}  // namespace
}  // namespace Stg::internal::sensing
