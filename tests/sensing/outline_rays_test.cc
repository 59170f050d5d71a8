// SPDX-License-Identifier: GPL-2.0-or-later
//
// Exact rays in a tile: vectorized and scalar results are bit-equal, and a ray that is reported to
// end in a tile does not reach another one.

#include "sensing/outline_rays.hh"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "sensing/crossing.hh"
#include "sensing/simd/wide_walk.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"
#include "support/walk_kinds.hh"

namespace Stg::internal::sensing {
namespace {

using test::PlainRay;
using test::RandomSource;

constexpr double kCellsPerMetre = 50;

/// A fan, its rays, and a hit of each ray.
struct Rays {
  Fan fan;
  std::vector<Direction> directions;
  std::vector<SineCosine> unit_vectors;
  std::vector<uint32_t> hits;

  OutlineRays View() const {
    return {&fan, directions.data(), unit_vectors.data(), hits.data(),
            static_cast<uint32_t>(directions.size())};
  }
  PlainRay PlainRayOf(size_t i) const {
    const FanRecord& r = fan.record;
    const Direction& d = directions[i];
    return {r.x,
            r.y,
            r.fraction & 0xffff,
            r.fraction >> 16,
            ray_rotate_x(r.cosine, r.sine, d.cosine, d.sine),
            ray_rotate_y(r.cosine, r.sine, d.cosine, d.sine)};
  }
};

/// A random cell on the ray, packed by ray_pack().
uint32_t RandomHit(RandomSource* random, const PlainRay& ray) {
  int64_t left = random->Int(0, 200);
  uint32_t hit = 0;
  test::WalkPlainly(ray, [&](int64_t u, int64_t v, int64_t, int64_t) {
    hit = ray_pack(static_cast<int>(u), static_cast<int>(v));
    return left-- == 0;
  });
  return hit;
}

Rays RandomRays(RandomSource* random) {
  Rays rays;
  const double far = random->Pick<double>({1, 30, 1e4, 2e7});
  const Pose origin(random->Real(-far, far), random->Real(-far, far), 0, random->Real(-4, 4));
  PlaceFan(&rays.fan, origin, random->Real(0.01, 8), kCellsPerMetre);
  const auto count = static_cast<uint32_t>(random->Int(1, random->OneIn(5) ? 256 : 12));
  const double fov = random->Pick<double>({0, 0.02, 1, 2 * M_PI});
  for (uint32_t i = 0; i < count; i++) {
    // Some go along the axes.
    const double bearing = random->OneIn(8)
                               ? random->Int(-2, 2) * M_PI / 2 - (random->OneIn(2) ? origin.a : 0)
                               : SampleBearing(fov, count, i);
    rays.unit_vectors.push_back(UnitVectorOf(bearing));
    rays.directions.push_back(MakeDirection(rays.unit_vectors.back()));
    rays.hits.push_back(RandomHit(random, rays.PlainRayOf(i)));
  }
  rays.fan.record.samples = count;
  rays.hits.resize(count + 16, 0xdeadbeef);
  return rays;
}

/// A random corner near the ends of rays, at the start, or on a ray.
point_t RandomCorner(RandomSource* random, const Rays& rays) {
  const Fan& fan = rays.fan;
  if (random->OneIn(20)) return {fan.x, fan.y};
  const auto i =
      static_cast<size_t>(random->Int(0, static_cast<int>(rays.unit_vectors.size()) - 1));
  const Line line = LineOf(fan, rays.unit_vectors[i]);
  const double along = random->Real(-0.2, 1.2) * fan.range;
  const double beside = random->OneIn(4) ? 0 : random->Real(-0.5, 0.5);
  return {fan.x + along * line.direction.cosine - beside * line.direction.sine,
          fan.y + along * line.direction.sine + beside * line.direction.cosine};
}

struct SomeOutlines {
  std::vector<std::vector<point_t>> corners;
  std::vector<OutlineEdges> edges;
};

Outlines ViewOf(const std::vector<OutlineEdges>& edges) {
  return {edges.data(), static_cast<uint32_t>(edges.size())};
}

SomeOutlines RandomOutlines(RandomSource* random, const Rays& rays) {
  SomeOutlines outlines;
  for (int count = random->Int(1, 4); count > 0; count--) {
    std::vector<point_t> corners;
    const int edges = random->Int(1, 8);
    for (int i = 0; i <= edges; i++) corners.push_back(RandomCorner(random, rays));
    if (random->OneIn(6)) corners[1] = corners[0];  // an edge without length
    if (random->OneIn(6) && !outlines.corners.empty()) corners = outlines.corners.back();
    outlines.corners.push_back(corners);
  }
  for (const std::vector<point_t>& corners : outlines.corners) {
    const uint64_t all = (uint64_t{1} << (corners.size() - 1)) - 1;
    const auto some = static_cast<uint32_t>(random->Next() & all);
    outlines.edges.push_back({corners.data(), some == 0 ? 1 : some});
  }
  return outlines;
}

/// Arrays for the results.
struct Met {
  explicit Met(size_t count) : ranges(count + 16, -7), which(count + 16, 77) {}
  std::vector<double> ranges;
  std::vector<uint32_t> which;
  OutlineHits hits{ranges.data(), which.data(), {}};
};

class OutlineRaysIn : public ::testing::TestWithParam<WideWalk> {};
std::vector<WideWalk> KindsThatMeetOutlines() {
  std::vector<WideWalk> kinds = test::WalkKinds();
  std::erase_if(kinds, [](const WideWalk& kind) { return kind.meet == nullptr; });
  return kinds;
}
INSTANTIATE_TEST_SUITE_P(AnyKind, OutlineRaysIn, ::testing::ValuesIn(KindsThatMeetOutlines()),
                         [](const auto& test) { return std::string(test.param.name); });

TEST_P(OutlineRaysIn, LanesEqualSingleRays) {
  RandomSource random(7);
  size_t met = 0, resolved = 0, behind = 0;
  for (int round = 0; round < 4000; round++) {
    const Rays rays = RandomRays(&random);
    const SomeOutlines outlines = RandomOutlines(&random, rays);
    Met one_by_one(rays.unit_vectors.size()), in_lanes(rays.unit_vectors.size());
    MeetOneByOne(rays.View(), ViewOf(outlines.edges), &one_by_one.hits);
    GetParam().meet(rays.View(), ViewOf(outlines.edges), &in_lanes.hits);
    for (uint32_t i = 0; i < rays.unit_vectors.size(); i++) {
      const double range = one_by_one.ranges[i];
      ASSERT_EQ(std::bit_cast<uint64_t>(in_lanes.ranges[i]), std::bit_cast<uint64_t>(range))
          << "round " << round << " ray " << i << ": " << in_lanes.ranges[i] << " " << range;
      ASSERT_EQ(in_lanes.which[i], one_by_one.which[i]) << "round " << round << " ray " << i;
      const bool is_resolved = one_by_one.hits.resolved.FirstOther(i) != i;
      ASSERT_EQ(in_lanes.hits.resolved.FirstOther(i) != i, is_resolved)
          << "round " << round << " ray " << i << " meets something at " << range;
      met += std::isfinite(range);
      resolved += is_resolved;
      behind += range == 0;
    }
  }
  // Check that each case occurred often enough.
  EXPECT_GT(met, 10000u);
  EXPECT_GT(resolved, 1000u);
  EXPECT_GT(behind, 1000u);
}

TEST(OutlineRays, HitTheFirstOfCoincidentOutlines) {
  RandomSource random(9);
  for (int round = 0; round < 500; round++) {
    const Rays rays = RandomRays(&random);
    const SomeOutlines once = RandomOutlines(&random, rays);
    std::vector<OutlineEdges> twice = once.edges;
    twice.insert(twice.end(), once.edges.begin(), once.edges.end());
    Met of_once(rays.unit_vectors.size()), of_twice(rays.unit_vectors.size());
    MeetOneByOne(rays.View(), ViewOf(once.edges), &of_once.hits);
    MeetOneByOne(rays.View(), ViewOf(twice), &of_twice.hits);
    EXPECT_EQ(of_once.which, of_twice.which);
    EXPECT_EQ(of_once.ranges, of_twice.ranges);
  }
}

/// The tiles on a ray from its hit up to the fraction `share` of its leg.
std::set<std::pair<int64_t, int64_t>> TilesFrom(const PlainRay& ray, uint32_t hit, double share) {
  const auto limit = [&](int64_t size) {
    return BorderLimit(share, static_cast<int>(std::abs(size)));
  };
  const int64_t limit_x = limit(ray.dx), limit_y = limit(ray.dy);
  const int64_t ox = ray.dx < 0 ? 65536 - ray.fx : ray.fx,
                oy = ray.dy < 0 ? 65536 - ray.fy : ray.fy;
  std::set<std::pair<int64_t, int64_t>> tiles;
  test::WalkPlainly(ray, [&](int64_t u, int64_t v, int64_t x, int64_t y) {
    const bool is_there = u >= ray_packed_u(hit) && v >= ray_packed_v(hit);
    const bool is_behind = u * 65536 - ox > limit_x || v * 65536 - oy > limit_y;
    if (is_there && !is_behind) tiles.insert({x >> 3, y >> 3});
    return is_behind;
  });
  return tiles;
}

TEST(LegEnd, LimitsTheTilesOfTheWalk) {
  RandomSource random(3);
  size_t in_tile = 0, in_next = 0, elsewhere = 0;
  for (int round = 0; round < 3000; round++) {
    const Rays rays = RandomRays(&random);
    for (size_t i = 0; i < rays.unit_vectors.size(); i++) {
      const PlainRay ray = rays.PlainRayOf(i);
      const uint32_t hit = rays.hits[i];
      const double share = random.OneIn(9) ? 1 : random.Real(0, 1.001);
      auto tiles = TilesFrom(ray, hit, std::min(share, 1.0));
      const int64_t x = ray.x + (ray.dx < 0 ? -1 : 1) * ray_packed_u(hit);
      const int64_t y = ray.y + (ray.dy < 0 ? -1 : 1) * ray_packed_v(hit);
      tiles.erase({x >> 3, y >> 3});
      const LegEnd end = FindLegEnd(rays.fan.record, rays.directions[i], hit, std::min(share, 1.0));
      if (end.tiles == 1) tiles.erase({end.x >> 3, end.y >> 3});
      ASSERT_TRUE(end.tiles == 2 || tiles.empty());
      in_tile += end.tiles == 0;
      in_next += end.tiles == 1;
      elsewhere += end.tiles == 2;
    }
  }
  EXPECT_GT(in_tile, 1000u);
  EXPECT_GT(in_next, 1000u);
  EXPECT_GT(elsewhere, 1000u);
}

}  // namespace
}  // namespace Stg::internal::sensing
