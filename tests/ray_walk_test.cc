// SPDX-License-Identifier: GPL-2.0-or-later
//
// The ray walk against a plain one: the same hits in the same order, whatever is skipped.

#include "kernels/ray_walk.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"

namespace Stg {
namespace {

using test::PlainRay;
using test::RandomSource;
using Hits = std::vector<std::pair<int, int>>;  // (u, v)

constexpr int64_t kLongest = int64_t{RAY_LEG_CELLS} << 16;
const ray_window_t kNoWindow{nullptr, 0, 0, 0, 0};

/// Occupied cells: a grid, and beside it a picture that the plain walk reads.
class Terrain {
 public:
  static constexpr int kSide = 320;  // more than five regions

  Terrain(int x, int y) : x_(x), y_(y), picture_(kSide * kSide, false) {
    grid::Body body;
    body_ = grid_.AddBody(body);
  }

  /// Coordinates count from the corner of the picture.
  void Add(int x, int y) {
    if (x < 0 || y < 0 || x >= kSide || y >= kSide) return;
    const size_t place = static_cast<size_t>(y * kSide + x);
    if (picture_[place]) return;
    picture_[place] = true;
    cells_.push_back({x_ + x, y_ + y});
    grid_.Insert(x_ + x, y_ + y, body_);
    low_x_ = std::min(low_x_, x_ + x);
    low_y_ = std::min(low_y_, y_ + y);
    high_x_ = std::max(high_x_, x_ + x);
    high_y_ = std::max(high_y_, y_ + y);
  }

  void AddDust(RandomSource* random, int count) {
    for (int i = 0; i < count; i++) Add(random->Int(0, kSide - 1), random->Int(0, kSide - 1));
  }
  void AddFrames(RandomSource* random, int count) {
    for (int i = 0; i < count; i++) {
      const int x = random->Int(0, kSide), y = random->Int(0, kSide);
      const int w = random->Int(1, 40), h = random->Int(1, 40);
      for (int j = 0; j < w; j++) Add(x + j, y), Add(x + j, y + h);
      for (int j = 0; j < h; j++) Add(x, y + j), Add(x + w, y + j);
    }
  }

  bool Has(int64_t x, int64_t y) const {
    x -= x_;
    y -= y_;
    return x >= 0 && y >= 0 && x < kSide && y < kSide &&
           picture_[static_cast<size_t>(y * kSide + x)];
  }

  const std::vector<point_int_t>& cells() const { return cells_; }
  int x() const { return x_; }
  int y() const { return y_; }

  enum Box { kOfGrid, kTight, kNone };
  /// With the grid's box (whole regions), the smallest, or one that leaves nothing out.
  ray_grid_t View(Box box) const {
    ray_grid_t view = grid_.View(grid::kEverything);
    if (box == kTight) {
      view.min_x = low_x_;
      view.min_y = low_y_;
      view.max_x = high_x_;
      view.max_y = high_y_;
    } else if (box == kNone) {
      view.min_x = view.min_y = std::numeric_limits<int>::min();
      view.max_x = view.max_y = std::numeric_limits<int>::max();
    }
    return view;
  }

 private:
  int x_, y_;
  grid::Grid grid_;
  grid::BodyId body_;
  std::vector<bool> picture_;
  std::vector<point_int_t> cells_;
  int low_x_ = std::numeric_limits<int>::max(), low_y_ = low_x_;
  int high_x_ = std::numeric_limits<int>::min(), high_y_ = high_x_;
};

/// A window of random tiles.
struct RandomWindow {
  std::vector<uint64_t> words;
  ray_window_t window = kNoWindow;

  RandomWindow(RandomSource* random, const Terrain& terrain) {
    window.x = (terrain.x() >> RAY_TILE_SHIFT) + random->Int(-2, Terrain::kSide / 8);
    window.y = (terrain.y() >> RAY_TILE_SHIFT) + random->Int(-2, Terrain::kSide / 8);
    window.width = static_cast<ray_uint>(random->Int(1, 16));
    window.height = static_cast<ray_uint>(random->Int(1, 16));
    for (ray_uint i = 0; i < window.width * window.height; i++)
      words.push_back(random->OneIn(3) ? ~uint64_t{0} : random->Next());
    window.tiles = words.data();
  }
};

bool IsHidden(const ray_window_t& window, int64_t x, int64_t y) {
  const int64_t tx = (x >> 3) - window.x, ty = (y >> 3) - window.y;
  if (tx < 0 || ty < 0 || tx >= window.width || ty >= window.height) return false;
  return window.tiles[ty * window.width + tx] >> ((x & 7) + 8 * (y & 7)) & 1;
}

ray_t Begin(const ray_grid_t& view, const PlainRay& r) {
  const auto narrow = [](int64_t value) { return static_cast<int>(value); };
  ray_t ray;
  ray_begin(&ray, &view, narrow(r.x), narrow(r.y), narrow(r.fx), narrow(r.fy), narrow(r.dx),
            narrow(r.dy));
  return ray;
}

Hits Remaining(const ray_grid_t& view, const ray_window_t& window, ray_t ray) {
  Hits hits;
  while (ray_next(&view, &window, &ray)) {
    hits.emplace_back(ray.u, ray.v);
    if (hits.size() > 2 * RAY_LEG_CELLS + 3) {
      ADD_FAILURE() << "the walk does not get on";
      break;
    }
    const int x = ray.x0 + ray.sx * ray.u, y = ray.y0 + ray.sy * ray.v;
    EXPECT_EQ(ray.tile, grid::Grid::TileOf(x, y));
    EXPECT_EQ(ray.bit, grid::Grid::BitOf(x, y));
    EXPECT_TRUE(view.tiles[ray.region * 64 + ray.tile] >> ray.bit & 1);
  }
  return hits;
}

Hits ExpectedHits(const Terrain& terrain, const ray_window_t& window, const PlainRay& ray) {
  Hits hits;
  test::WalkPlainly(ray, [&](int64_t u, int64_t v, int64_t x, int64_t y) {
    if (terrain.Has(x, y) && !IsHidden(window, x, y))
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

/// All that is to be said about one ray. False if something is wrong.
bool Check(const Terrain& terrain, const ray_grid_t& view, const ray_window_t& window,
           const PlainRay& r, RandomSource* random, size_t* hits = nullptr) {
  const Hits expected = ExpectedHits(terrain, window, r);
  if (hits) *hits += expected.size();
  const Hits found = Remaining(view, window, Begin(view, r));
  EXPECT_EQ(found, expected) << Text(r);
  if (found != expected) return false;
  if (expected.empty()) return true;
  // From any hit, a fresh walk finds the rest.
  const size_t i = static_cast<size_t>(random->Next() % expected.size());
  ray_t resumed = Begin(view, r);
  const ray_uint packed = ray_pack(expected[i].first, expected[i].second);
  EXPECT_NE(packed, RAY_NO_HIT);
  ray_resume(&resumed, ray_packed_u(packed), ray_packed_v(packed));
  const Hits rest = Remaining(view, window, resumed);
  const Hits expected_rest(expected.begin() + static_cast<std::ptrdiff_t>(i) + 1, expected.end());
  EXPECT_EQ(rest, expected_rest) << Text(r) << " resumed at hit " << i;
  return rest == expected_rest;
}

int64_t Clamp(int64_t displacement) { return std::clamp(displacement, -kLongest, kLongest); }

/// Rays of every kind that could matter.
PlainRay RandomRay(RandomSource* random, const Terrain& terrain) {
  PlainRay r;
  r.x = terrain.x() + random->Between(-20, Terrain::kSide + 20);
  r.y = terrain.y() + random->Between(-20, Terrain::kSide + 20);
  r.fx = random->OneIn(4) ? 0 : random->Between(0, 65535);
  r.fy = random->OneIn(4) ? 0 : random->Between(0, 65535);
  // Mostly some tens of cells: these look at the most places for the time that they take.
  const int64_t reach = int64_t{1} << random->Int(14, 24);
  r.dx = random->Between(-reach, reach);
  r.dy = random->Between(-reach, reach);
  switch (random->Int(0, 9)) {
    case 0:  // along an axis
      (random->OneIn(2) ? r.dx : r.dy) = 0;
      if (random->OneIn(50)) r.dx = r.dy = 0;
      break;
    case 1:  // through corners, diagonally
      r.fx = r.fy = random->Between(0, 65535) & -random->Int(0, 1);
      r.dx = random->Sign() * (random->Between(0, 100) << 16);
      r.dy = random->Sign() * std::abs(r.dx);
      break;
    case 2:  // through corners now and then
      r.fx = random->Between(0, 3) << 14;
      r.fy = random->Between(0, 3) << 14;
      r.dx = random->Between(-12, 12) << 16;
      r.dy = random->Between(-12, 12) << 16;
      if (const int64_t times = random->Between(1, 10); true) r.dx *= times, r.dy *= times;
      break;
    case 3:  // ends exactly on a border, or a hair beside it
      r.dx = (random->Between(-60, 60) << 16) - r.fx + random->Between(-1, 1);
      if (random->OneIn(2)) r.dy = (random->Between(-60, 60) << 16) - r.fy + random->Between(-1, 1);
      break;
    case 4:  // hardly any displacement
      r.dx = random->Between(-3, 3);
      r.dy = random->Between(-3, 3);
      r.fx = random->OneIn(2) ? random->Between(0, 2) : random->Between(65533, 65535);
      break;
    case 5:  // nearly parallel to an axis
      (random->OneIn(2) ? r.dx : r.dy) = random->Between(-2, 2);
      break;
    case 6: {  // from one occupied cell to another, or just past it
      if (terrain.cells().empty()) break;
      const point_int_t& from = random->Pick(terrain.cells());
      const point_int_t& to = random->Pick(terrain.cells());
      r.x = from.x;
      r.y = from.y;
      r.dx = ((int64_t{to.x} - from.x) << 16) + random->Between(-65536, 65536);
      r.dy = ((int64_t{to.y} - from.y) << 16) + random->Between(-65536, 65536);
      break;
    }
    default:
      break;
  }
  r.dx = Clamp(r.dx);
  r.dy = Clamp(r.dy);
  return r;
}

/// The longest rays, from anywhere within their reach, towards the terrain.
PlainRay LongRay(RandomSource* random, const Terrain& terrain) {
  const int64_t to_x = terrain.x() + random->Between(0, Terrain::kSide);
  const int64_t to_y = terrain.y() + random->Between(0, Terrain::kSide);
  PlainRay r;
  r.x = to_x + random->Between(-RAY_LEG_CELLS, RAY_LEG_CELLS);
  r.y = to_y + random->Between(-RAY_LEG_CELLS, RAY_LEG_CELLS);
  r.fx = random->Pick<int64_t>({0, 1, 32768, 65535});
  r.fy = random->Pick<int64_t>({0, 1, 32768, 65535});
  const double dx = static_cast<double>(to_x - r.x), dy = static_cast<double>(to_y - r.y);
  const double stretch = static_cast<double>(kLongest) / (std::hypot(dx, dy) + 1);
  r.dx = Clamp(static_cast<int64_t>(dx * stretch));
  r.dy = Clamp(static_cast<int64_t>(dy * stretch));
  switch (random->Int(0, 5)) {
    case 0:
      r.y = to_y, r.dy = random->Between(-1, 1), r.dx = random->Sign() * kLongest;
      break;
    case 1:
      r.x = to_x, r.dx = random->Between(-1, 1), r.dy = random->Sign() * kLongest;
      break;
    case 2:  // longer than any that a fan makes: both at once
      r.dx = random->Sign() * kLongest, r.dy = random->Sign() * kLongest;
      break;
    default:
      break;
  }
  return r;
}

/// Places that lie badly: across borders of superregions, at the ends of the grid.
struct Place {
  int x, y;
};
class RayWalkAt : public ::testing::TestWithParam<Place> {};

constexpr int kEnd = 1 << 30;
INSTANTIATE_TEST_SUITE_P(Everywhere, RayWalkAt,
                         ::testing::Values(Place{-160, -160}, Place{1024 - 100, 7},
                                           Place{5000, -40960 - 17},
                                           Place{kEnd - Terrain::kSide, kEnd - Terrain::kSide},
                                           Place{-kEnd + 1, -kEnd + 1},
                                           Place{-kEnd + 1, kEnd - Terrain::kSide}));

void CheckMany(const Terrain& terrain, uint64_t seed, int rays, int long_rays) {
  RandomSource random(seed);
  size_t hits = 0;
  for (int i = 0; i < rays + long_rays; i++) {
    const PlainRay ray = i < rays ? RandomRay(&random, terrain) : LongRay(&random, terrain);
    const ray_grid_t view = terrain.View(static_cast<Terrain::Box>(random.Int(0, 2)));
    if (random.OneIn(3)) {
      const RandomWindow hidden(&random, terrain);
      ASSERT_TRUE(Check(terrain, view, hidden.window, ray, &random, &hits));
    } else {
      ASSERT_TRUE(Check(terrain, view, kNoWindow, ray, &random, &hits));
    }
  }
  EXPECT_GT(hits, static_cast<size_t>(rays) / 10) << "these rays prove little";
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
  terrain.AddDust(&random, Terrain::kSide * Terrain::kSide);  // about two of three
  CheckMany(terrain, 6, 20000, 20);
}

TEST_P(RayWalkAt, Frames) {
  Terrain terrain(GetParam().x, GetParam().y);
  RandomSource random(7);
  terrain.AddFrames(&random, 30);
  CheckMany(terrain, 8, 30000, 100);
}

TEST(RayWalk, HitsInTheLastRowsOfTheBoxAreFound) {
  // The start's column is the last occupied one: no border in x is worth crossing, yet the ray runs
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
            EXPECT_TRUE(Check(terrain, view, kNoWindow, {x, y, f, f, d, 0}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoWindow, {x, y, f, f, 0, d}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoWindow, {x, y, f, f, d, d}, &random));
            EXPECT_TRUE(Check(terrain, view, kNoWindow, {x, y, f, f, d, -d}, &random));
          }
  }
}

TEST(RayWalk, AtACornerYGoesFirst) {
  Terrain terrain(0, 0);
  for (int x = 0; x < 3; x++)
    for (int y = 0; y < 3; y++) terrain.Add(x, y);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const PlainRay diagonal{0, 0, 0, 0, 2 << 16, 2 << 16};
  EXPECT_EQ(Remaining(view, kNoWindow, Begin(view, diagonal)),
            (Hits{{0, 0}, {0, 1}, {1, 1}, {1, 2}, {2, 2}}));
}

TEST(RayWalk, ABorderReachedExactlyIsCrossed) {
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const auto hits = [&](const PlainRay& ray) {
    return Remaining(view, kNoWindow, Begin(view, ray)).size();
  };
  EXPECT_EQ(hits({3, 5, 100, 9, (7 << 16) - 100, 0}), 1u);
  EXPECT_EQ(hits({3, 5, 100, 9, (7 << 16) - 101, 0}), 0u);
  // Leftwards a border belongs to the cell on its right: at its end the ray is in the next cell.
  EXPECT_EQ(hits({20, 5, 100, 9, -(9 << 16) - 100, 0}), 1u);
  EXPECT_EQ(hits({20, 5, 100, 9, -(9 << 16) - 99, 0}), 0u);
}

TEST(RayWalk, TheStartCellIsPartOfTheRay) {
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  EXPECT_EQ(Remaining(view, kNoWindow, Begin(view, {10, 5, 0, 0, 0, 0})), (Hits{{0, 0}}));
  EXPECT_EQ(Remaining(view, kNoWindow, Begin(view, {10, 5, 0, 0, -5, -5})), (Hits{{0, 0}}));
}

TEST(RayWalk, NothingOccupied) {
  const grid::Grid grid;
  const ray_grid_t view = grid.View(grid::kEverything);
  for (const int64_t at : {-5000, -1, 0, 1, 5000})
    for (const int64_t d : {-kLongest, int64_t{0}, kLongest})
      EXPECT_TRUE(Remaining(view, kNoWindow, Begin(view, {at, at, 0, 0, d, d / 3})).empty());
}

TEST(RayWalk, AnEmptyWindowHidesNothing) {
  Terrain terrain(0, 0);
  terrain.Add(3, 3);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const PlainRay ray{0, 3, 0, 0, 20 << 16, 0};
  const uint64_t all = ~uint64_t{0};
  EXPECT_EQ(Remaining(view, {&all, 0, 0, 0, 0}, Begin(view, ray)).size(), 1u);
  EXPECT_EQ(Remaining(view, {&all, 0, 0, 1, 1}, Begin(view, ray)).size(), 0u);
}

// Cells that a ray does not cross change nothing about it, though it is walked in other leaps.
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
      rays.push_back(RandomRay(&random, plain));
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
      ASSERT_EQ(Remaining(before, kNoWindow, Begin(before, ray)),
                Remaining(after, kNoWindow, Begin(after, ray)))
          << Text(ray);
  }
}

// ---- parts --------------------------------------------------------------------------------------

TEST(RayParts, RotationRoundsToNearest) {
  RandomSource random(13);
  const auto rounded = [](test::WideInt product) {
    return static_cast<int>((product + (1 << 29)) >> 30);
  };
  for (int i = 0; i < 100000; i++) {
    const double heading = random.Real(-4, 4), bearing = random.Real(-4, 4);
    const double length = i % 2 ? static_cast<double>(kLongest) : random.Real(0, 1e6);
    const int cosine = static_cast<int>(length * std::cos(heading));
    const int sine = static_cast<int>(length * std::sin(heading));
    const int c = static_cast<int>(0x1p30 * std::cos(bearing));
    const int s = static_cast<int>(0x1p30 * std::sin(bearing));
    using test::WideInt;
    ASSERT_EQ(ray_rotate_x(cosine, sine, c, s), rounded(WideInt{cosine} * c - WideInt{sine} * s));
    ASSERT_EQ(ray_rotate_y(cosine, sine, c, s), rounded(WideInt{sine} * c + WideInt{cosine} * s));
  }
  const int one = 1 << 30;
  EXPECT_EQ(ray_rotate_x(123456, -789, one, 0), 123456);
  EXPECT_EQ(ray_rotate_y(123456, -789, one, 0), -789);
  EXPECT_EQ(ray_rotate_x(123456, -789, 0, one), 789);
  EXPECT_EQ(ray_rotate_y(123456, -789, 0, one), 123456);
}

TEST(RayParts, PackedHitsComeBack) {
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
