// SPDX-License-Identifier: GPL-2.0-or-later
//
// The ray walk, which skips empty space, gives the same hits in the same order as the reference
// walk.

#include "kernels/ray_walk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"
#include "support/terrain.hh"

namespace Stg {
namespace {

using test::kLongest;
using test::kNoMask;
using test::Place;
using test::PlainRay;
using test::RandomSelfMask;
using test::RandomSource;
using test::Terrain;
using Hits = std::vector<std::pair<int, int>>;  // (u, v)

bool IsHidden(const ray_mask_t& mask, int64_t x, int64_t y) {
  const int64_t tx = (x >> 3) - mask.x, ty = (y >> 3) - mask.y;
  if (tx < 0 || ty < 0 || tx >= mask.width || ty >= mask.height) return false;
  return mask.tiles[ty * mask.width + tx] >> ((x & 7) + 8 * (y & 7)) & 1;
}

ray_t Begin(const ray_grid_t& view, const PlainRay& r) {
  const auto narrow = [](int64_t value) { return static_cast<int>(value); };
  ray_t ray;
  ray_begin(&ray, &view, narrow(r.x), narrow(r.y), narrow(r.fx), narrow(r.fy), narrow(r.dx),
            narrow(r.dy));
  return ray;
}

Hits Remaining(const ray_grid_t& view, const ray_mask_t& mask, ray_t ray) {
  Hits hits;
  while (ray_next(&view, &mask, &ray)) {
    hits.emplace_back(ray.u, ray.v);
    if (hits.size() > 2 * RAY_LEG_CELLS + 3) {
      ADD_FAILURE() << "the walk makes no progress";
      break;
    }
    const int x = ray.x0 + ray.sx * ray.u, y = ray.y0 + ray.sy * ray.v;
    EXPECT_EQ(ray.tile, grid::Grid::TileOf(x, y));
    EXPECT_EQ(ray.bit, grid::Grid::BitOf(x, y));
    EXPECT_TRUE(view.tiles[ray.region * 64 + ray.tile] >> ray.bit & 1);
  }
  return hits;
}

Hits ExpectedHits(const Terrain& terrain, const ray_mask_t& mask, const PlainRay& ray) {
  Hits hits;
  test::WalkPlainly(ray, [&](int64_t u, int64_t v, int64_t x, int64_t y) {
    if (terrain.Has(x, y) && !IsHidden(mask, x, y))
      hits.emplace_back(static_cast<int>(u), static_cast<int>(v));
    return false;
  });
  return hits;
}

std::string Text(const PlainRay& r) {
  std::string text = "ray";
  for (const int64_t value : {r.x, r.y, r.fx, r.fy, r.dx, r.dy})
    text += " " + std::to_string(value);
  return text;
}

/// Checks one ray in all respects. Returns false if something is wrong.
bool Check(const Terrain& terrain, const ray_grid_t& view, const ray_mask_t& mask,
           const PlainRay& r, RandomSource* random, size_t* hits = nullptr) {
  const Hits expected = ExpectedHits(terrain, mask, r);
  if (hits) *hits += expected.size();
  const Hits found = Remaining(view, mask, Begin(view, r));
  EXPECT_EQ(found, expected) << Text(r);
  if (found != expected) return false;
  if (expected.empty()) return true;
  // A walk that resumes at any hit finds the remaining ones.
  const size_t i = static_cast<size_t>(random->Next() % expected.size());
  ray_t resumed = Begin(view, r);
  const ray_uint packed = ray_pack(expected[i].first, expected[i].second);
  EXPECT_NE(packed, RAY_NO_HIT);
  ray_resume(&resumed, ray_packed_u(packed), ray_packed_v(packed));
  const Hits rest = Remaining(view, mask, resumed);
  const Hits expected_rest(expected.begin() + static_cast<std::ptrdiff_t>(i) + 1, expected.end());
  EXPECT_EQ(rest, expected_rest) << Text(r) << " resumed at hit " << i;
  return rest == expected_rest;
}

class RayWalkAt : public ::testing::TestWithParam<Place> {};

INSTANTIATE_TEST_SUITE_P(Everywhere, RayWalkAt, ::testing::ValuesIn(test::kBadPlaces));

void CheckMany(const Terrain& terrain, uint64_t seed, int rays, int long_rays) {
  RandomSource random(seed);
  size_t hits = 0;
  for (int i = 0; i < rays + long_rays; i++) {
    const PlainRay ray =
        i < rays ? test::RandomRay(&random, terrain) : test::LongRay(&random, terrain);
    const ray_grid_t view = terrain.View(static_cast<Terrain::Box>(random.Int(0, 2)));
    if (random.OneIn(3)) {
      const RandomSelfMask hidden(&random, terrain);
      ASSERT_TRUE(Check(terrain, view, hidden.mask, ray, &random, &hits));
    } else {
      ASSERT_TRUE(Check(terrain, view, kNoMask, ray, &random, &hits));
    }
  }
  EXPECT_GT(hits, static_cast<size_t>(rays) / 10) << "too few rays hit anything";
}

TEST_P(RayWalkAt, SparseCells) {
  Terrain terrain(GetParam().x, GetParam().y);
  RandomSource random(1);
  terrain.AddDust(&random, 40);
  CheckMany(terrain, 2, 70000, 100);
}

TEST_P(RayWalkAt, SomeCells) {
  Terrain terrain(GetParam().x, GetParam().y);
  RandomSource random(3);
  terrain.AddDust(&random, 1500);
  CheckMany(terrain, 4, 70000, 100);
}

TEST_P(RayWalkAt, ManyCells) {
  Terrain terrain(GetParam().x, GetParam().y);
  RandomSource random(5);
  terrain.AddDust(&random, Terrain::kSide * Terrain::kSide);  // occupies about two thirds
  CheckMany(terrain, 6, 20000, 20);
}

TEST_P(RayWalkAt, Frames) {
  Terrain terrain(GetParam().x, GetParam().y);
  RandomSource random(7);
  terrain.AddFrames(&random, 30);
  CheckMany(terrain, 8, 30000, 100);
}

TEST(RayWalk, HitsInTheLastRowsOfTheBoxAreFound) {
  // The start is in the last occupied column: no border in x needs to be crossed, but the ray runs
  // along occupied cells.
  Terrain terrain(0, 0);
  for (const int x : {0, 63})
    for (const int y : {0, 63}) terrain.Add(x, y);
  RandomSource random(9);
  for (const Terrain::Box box : {Terrain::kTight, Terrain::kOfGrid, Terrain::kNone}) {
    const ray_grid_t view = terrain.View(box);
    for (const int64_t x : {0, 63})
      for (const int64_t y : {0, 63})
        for (const int64_t f : {0, 1, 32768, 65535})
          for (const int64_t d : {-100 << 16, -1, 0, 1, 100 << 16}) {
            EXPECT_TRUE(Check(terrain, view, kNoMask, {x, y, f, f, d, 0}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoMask, {x, y, f, f, 0, d}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoMask, {x, y, f, f, d, d}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoMask, {x, y, f, f, d, -d}, &random));
          }
  }
}

TEST(RayWalk, AtACornerYGoesFirst) {
  Terrain terrain(0, 0);
  for (int x = 0; x < 3; x++)
    for (int y = 0; y < 3; y++) terrain.Add(x, y);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const PlainRay diagonal{0, 0, 0, 0, 2 << 16, 2 << 16};
  EXPECT_EQ(Remaining(view, kNoMask, Begin(view, diagonal)),
            (Hits{{0, 0}, {0, 1}, {1, 1}, {1, 2}, {2, 2}}));
}

TEST(RayWalk, ABorderReachedExactlyIsCrossed) {
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const auto hits = [&](const PlainRay& ray) {
    return Remaining(view, kNoMask, Begin(view, ray)).size();
  };
  EXPECT_EQ(hits({3, 5, 100, 9, (7 << 16) - 100, 0}), 1u);
  EXPECT_EQ(hits({3, 5, 100, 9, (7 << 16) - 101, 0}), 0u);
  // To the left, a border belongs to the cell on its right, so the ray ends in the next cell.
  EXPECT_EQ(hits({20, 5, 100, 9, -(9 << 16) - 100, 0}), 1u);
  EXPECT_EQ(hits({20, 5, 100, 9, -(9 << 16) - 99, 0}), 0u);
}

TEST(RayWalk, TheStartCellIsPartOfTheRay) {
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  EXPECT_EQ(Remaining(view, kNoMask, Begin(view, {10, 5, 0, 0, 0, 0})), (Hits{{0, 0}}));
  EXPECT_EQ(Remaining(view, kNoMask, Begin(view, {10, 5, 0, 0, -5, -5})), (Hits{{0, 0}}));
}

TEST(RayWalk, NothingOccupied) {
  const grid::Grid grid;
  const ray_grid_t view = grid.View(grid::kEverything);
  for (const int64_t at : {-5000, -1, 0, 1, 5000})
    for (const int64_t d : {-kLongest, int64_t{0}, kLongest})
      EXPECT_TRUE(Remaining(view, kNoMask, Begin(view, {at, at, 0, 0, d, d / 3})).empty());
}

TEST(RayWalk, AnEmptySelfMaskHidesNothing) {
  Terrain terrain(0, 0);
  terrain.Add(3, 3);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const PlainRay ray{0, 3, 0, 0, 20 << 16, 0};
  const uint64_t all = ~uint64_t{0};
  EXPECT_EQ(Remaining(view, {&all, 0, 0, 0, 0}, Begin(view, ray)).size(), 1u);
  EXPECT_EQ(Remaining(view, {&all, 0, 0, 1, 1}, Begin(view, ray)).size(), 0u);
}

// Cells beside a ray do not change its hits, although they change what the walk skips.
TEST(RayWalk, ClutterBesideTheRayChangesNothing) {
  RandomSource random(11);
  for (int round = 0; round < 300; round++) {
    Terrain plain(-160, -160);
    plain.AddDust(&random, 300);
    std::vector<PlainRay> rays;
    std::vector<bool> crossed(Terrain::kSide * Terrain::kSide, false);
    const auto inside = [](int64_t x, int64_t y) {
      return x >= -160 && y >= -160 && x < 160 && y < 160;
    };
    const auto place = [](int64_t x, int64_t y) {
      return static_cast<size_t>((y + 160) * Terrain::kSide + x + 160);
    };
    for (int i = 0; i < 10; i++) {
      rays.push_back(test::RandomRay(&random, plain));
      test::WalkPlainly(rays.back(), [&](int64_t, int64_t, int64_t x, int64_t y) {
        if (inside(x, y)) crossed[place(x, y)] = true;
        return false;
      });
    }
    Terrain cluttered(-160, -160);
    for (const point_int_t& cell : plain.cells()) cluttered.Add(cell.x + 160, cell.y + 160);
    const int more = random.Int(1, 20000);
    for (int i = 0; i < more; i++) {
      const int x = random.Int(-160, 159), y = random.Int(-160, 159);
      if (!crossed[place(x, y)]) cluttered.Add(x + 160, y + 160);
    }
    const ray_grid_t before = plain.View(Terrain::kOfGrid);
    const ray_grid_t after = cluttered.View(Terrain::kOfGrid);
    for (const PlainRay& ray : rays)
      ASSERT_EQ(Remaining(before, kNoMask, Begin(before, ray)),
                Remaining(after, kNoMask, Begin(after, ray)))
          << Text(ray);
  }
}

// ---- parts --------------------------------------------------------------------------------------

TEST(RayParts, RotationRoundsToNearest) {
  RandomSource random(13);
  const auto rounded = [](int64_t product) {
    return static_cast<int>((product + (1 << 29)) >> 30);
  };
  for (int i = 0; i < 100000; i++) {
    const double heading = random.Real(-4, 4), bearing = random.Real(-4, 4);
    const double length = i % 2 ? static_cast<double>(kLongest) : random.Real(0, 1e6);
    const int cosine = static_cast<int>(length * std::cos(heading));
    const int sine = static_cast<int>(length * std::sin(heading));
    const int c = static_cast<int>(0x1p30 * std::cos(bearing));
    const int s = static_cast<int>(0x1p30 * std::sin(bearing));
    ASSERT_EQ(ray_rotate_x(cosine, sine, c, s), rounded(int64_t{cosine} * c - int64_t{sine} * s));
    ASSERT_EQ(ray_rotate_y(cosine, sine, c, s), rounded(int64_t{sine} * c + int64_t{cosine} * s));
  }
  const int one = 1 << 30;
  EXPECT_EQ(ray_rotate_x(123456, -789, one, 0), 123456);
  EXPECT_EQ(ray_rotate_y(123456, -789, one, 0), -789);
  EXPECT_EQ(ray_rotate_x(123456, -789, 0, one), 789);
  EXPECT_EQ(ray_rotate_y(123456, -789, 0, one), 123456);
}

TEST(RayParts, PackedHitsRoundTrip) {
  for (const int u : {0, 1, 255, 256, 16384, 16385, 32767})
    for (const int v : {0, 1, 255, 256, 16384, 16385, 32767}) {
      const ray_uint packed = ray_pack(u, v);
      EXPECT_NE(packed, RAY_NO_HIT);
      EXPECT_EQ(ray_packed_u(packed), u);
      EXPECT_EQ(ray_packed_v(packed), v);
    }
}

}  // namespace
}  // namespace Stg
