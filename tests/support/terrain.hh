// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random terrains and rays for tests of the ray walk.

#ifndef STAGE_TESTS_SUPPORT_TERRAIN_HH
#define STAGE_TESTS_SUPPORT_TERRAIN_HH

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/grid.hh"
#include "kernels/ray_walk.h"
#include "support/draw_cells.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"

namespace Stg::test {

inline constexpr int64_t kLongest = int64_t{RAY_LEG_CELLS} << 16;
inline constexpr ray_mask_t kNoMask{nullptr, 0, 0, 0, 0};

/// Occupied cells, in a grid and in a bitmap for the reference walk.
class Terrain {
 public:
  static constexpr int kSide = 320;  // more than five regions

  Terrain(int x, int y) : x_(x), y_(y), picture_(kSide * kSide, false) {
    for (grid::BodyId& id : bodies_) id = grid_.AddBody(grid::Body());
  }

  /// Occupies a cell; coordinates are relative to the corner of the bitmap.
  void Add(int x, int y) {
    if (x < 0 || y < 0 || x >= kSide || y >= kSide) return;
    const size_t place = static_cast<size_t>(y * kSide + x);
    if (picture_[place]) return;
    picture_[place] = true;
    cells_.push_back({x_ + x, y_ + y});
    DrawCell(&grid_, x_ + x, y_ + y, bodies_[0]);
    if (x / 8 % 3 == y / 8 % 3 && (x + y) % 2 == 0) DrawCell(&grid_, x_ + x, y_ + y, bodies_[1]);
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

  const grid::Grid& grid() const { return grid_; }
  const std::vector<point_int_t>& cells() const { return cells_; }
  int x() const { return x_; }
  int y() const { return y_; }

  enum Box { kOfGrid, kTight, kNone };
  /// A view with the grid's bounding box (whole regions), the smallest one, or an unlimited one.
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
  /// The first body is in all occupied cells, the second one also in some cells of some tiles.
  grid::BodyId bodies_[2];
  std::vector<bool> picture_;
  std::vector<point_int_t> cells_;
  int low_x_ = std::numeric_limits<int>::max(), low_y_ = low_x_;
  int high_x_ = std::numeric_limits<int>::min(), high_y_ = high_x_;
};

/// A self-mask of random tiles.
struct RandomSelfMask {
  std::vector<uint64_t> words;
  ray_mask_t mask = kNoMask;

  RandomSelfMask(RandomSource* random, const Terrain& terrain) {
    mask.x = (terrain.x() >> RAY_TILE_SHIFT) + random->Int(-2, Terrain::kSide / 8);
    mask.y = (terrain.y() >> RAY_TILE_SHIFT) + random->Int(-2, Terrain::kSide / 8);
    mask.width = static_cast<ray_uint>(random->Int(1, 16));
    mask.height = static_cast<ray_uint>(random->Int(1, 16));
    for (ray_uint i = 0; i < mask.width * mask.height; i++)
      words.push_back(random->OneIn(3) ? ~uint64_t{0} : random->Next());
    mask.tiles = words.data();
  }
};

/// Origins at critical places: across borders of superregions and at the ends of the grid.
struct Place {
  int x, y;
};
inline constexpr int kEnd = grid::kMaxCell;
inline constexpr Place kBadPlaces[] = {
    {-160, -160},           {1024 - 100, 7},
    {5000, -40960 - 17},    {kEnd - Terrain::kSide, kEnd - Terrain::kSide},
    {-kEnd + 1, -kEnd + 1}, {-kEnd + 1, kEnd - Terrain::kSide}};

inline int64_t Clamp(int64_t displacement) { return std::clamp(displacement, -kLongest, kLongest); }

/// A random ray, often one of the critical cases below.
inline PlainRay RandomRay(RandomSource* random, const Terrain& terrain) {
  PlainRay r;
  r.x = terrain.x() + random->Between(-20, Terrain::kSide + 20);
  r.y = terrain.y() + random->Between(-20, Terrain::kSide + 20);
  r.fx = random->OneIn(4) ? 0 : random->Between(0, 65535);
  r.fy = random->OneIn(4) ? 0 : random->Between(0, 65535);
  // Most rays have some tens of cells, which covers most places per unit of time.
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
    case 2:  // through some corners
      r.fx = random->Between(0, 3) << 14;
      r.fy = random->Between(0, 3) << 14;
      r.dx = random->Between(-12, 12) << 16;
      r.dy = random->Between(-12, 12) << 16;
      if (const int64_t times = random->Between(1, 10); true) r.dx *= times, r.dy *= times;
      break;
    case 3:  // ends exactly on a border, or 1/65536 cell beside it
      r.dx = (random->Between(-60, 60) << 16) - r.fx + random->Between(-1, 1);
      if (random->OneIn(2)) r.dy = (random->Between(-60, 60) << 16) - r.fy + random->Between(-1, 1);
      break;
    case 4:  // a tiny displacement
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

/// A ray of maximum length towards the terrain, from a random cell within that distance.
inline PlainRay LongRay(RandomSource* random, const Terrain& terrain) {
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
    case 2:  // maximum length along both axes: longer than any ray of a fan
      r.dx = random->Sign() * kLongest, r.dy = random->Sign() * kLongest;
      break;
    default:
      break;
  }
  return r;
}

}  // namespace Stg::test

#endif
