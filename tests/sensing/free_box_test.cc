// SPDX-License-Identifier: GPL-2.0-or-later
//
// The empty boxes around the starts of rays, compared with single cells. wide_walk_test.cc tests
// that rays that skip such a box have the same hits.

#include "sensing/free_box.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "support/random_source.hh"
#include "support/terrain.hh"

namespace Stg::internal::sensing {
namespace {

using grid::CellBox;
using test::kNoMask;
using test::Place;
using test::RandomSelfMask;
using test::RandomSource;
using test::Terrain;

class Starts {
 public:
  explicit Starts(const std::vector<point_int_t>& cells) : fans_(cells.size()) {
    for (size_t i = 0; i < cells.size(); i++) {
      fans_[i].x = cells[i].x;
      fans_[i].y = cells[i].y;
      slices_.push_back({&fans_[i], &ahead_, 1, 1, nullptr});
    }
  }
  FreeBoxes Find(const ray_grid_t& view, const ray_mask_t& mask) const {
    const auto count = static_cast<uint32_t>(slices_.size());
    return FindFreeBoxes({&view, &mask, slices_.data(), count, count, 0});
  }

 private:
  const Direction ahead_{1 << 30, 0};
  std::vector<FanRecord> fans_;
  std::vector<FanSlice> slices_;
};

/// True if a ray would stop in the cell.
bool Stops(const Terrain& terrain, const ray_mask_t& mask, int64_t x, int64_t y) {
  if (!terrain.Has(x, y)) return false;
  const int64_t i = (x >> RAY_TILE_SHIFT) - mask.x, k = (y >> RAY_TILE_SHIFT) - mask.y;
  if (i < 0 || k < 0 || i >= mask.width || k >= mask.height) return true;
  return (mask.tiles[k * mask.width + i] >> ((x & 7) | (y & 7) << 3) & 1) == 0;
}

bool AnyIn(const Terrain& terrain, const ray_mask_t& mask, const CellBox& box) {
  for (int64_t y = box.min_y; y <= box.max_y; y++)
    for (int64_t x = box.min_x; x <= box.max_x; x++)
      if (Stops(terrain, mask, x, y)) return true;
  return false;
}

CellBox TileOf(const point_int_t& cell) {
  return {cell.x & ~7, cell.y & ~7, cell.x | 7, cell.y | 7};
}
bool IsIn(const CellBox& a, const CellBox& b) {
  return a.min_x >= b.min_x && a.min_y >= b.min_y && a.max_x <= b.max_x && a.max_y <= b.max_y;
}
CellBox Around(const CellBox& a, const CellBox& b) {
  return {std::min(a.min_x, b.min_x), std::min(a.min_y, b.min_y), std::max(a.max_x, b.max_x),
          std::max(a.max_y, b.max_y)};
}

/// The tiles beyond the box on the negative side (`back`) or the positive side.
CellBox BeyondX(const CellBox& box, bool back) {
  return back ? CellBox{box.min_x - 8, box.min_y, box.min_x - 1, box.max_y}
              : CellBox{box.max_x + 1, box.min_y, box.max_x + 8, box.max_y};
}
CellBox BeyondY(const CellBox& box, bool back) {
  return back ? CellBox{box.min_x, box.min_y - 8, box.max_x, box.min_y - 1}
              : CellBox{box.min_x, box.max_y + 1, box.max_x, box.max_y + 8};
}

/// The area that is examined around a cell: its region and the adjacent ones.
CellBox Surroundings(const point_int_t& cell) {
  const int32_t x = (cell.x & ~63) - 64, y = (cell.y & ~63) - 64;
  return {x, y, x + 191, y + 191};
}

/// Checks that boxes contain the starts, are empty and are maximal. Returns their number.
int Check(const Terrain& terrain, const ray_mask_t& mask, const std::vector<point_int_t>& starts) {
  const FreeBoxes boxes = Starts(starts).Find(terrain.View(Terrain::kOfGrid), mask);
  const CellBox first = TileOf(starts[0]), looked_at = Surroundings(starts[0]);
  CellBox wanted = first;
  for (const point_int_t& start : starts) wanted = Around(wanted, TileOf(start));
  if (!IsIn(wanted, looked_at) || AnyIn(terrain, mask, wanted)) wanted = first;
  const bool none = AnyIn(terrain, mask, wanted);
  int found = 0;
  for (const bool back_y : {false, true}) {
    for (const bool back_x : {false, true}) {
      const CellBox& box = boxes.towards[back_y][back_x];
      EXPECT_EQ(box.max_x < box.min_x, none);
      if (none) continue;
      found++;
      EXPECT_TRUE(IsIn(wanted, box));
      EXPECT_FALSE(AnyIn(terrain, mask, box));
      // The box extends only in the directions of the rays, and as far as possible.
      EXPECT_EQ(back_x ? box.max_x : box.min_x, back_x ? wanted.max_x : wanted.min_x);
      EXPECT_EQ(back_y ? box.max_y : box.min_y, back_y ? wanted.max_y : wanted.min_y);
      for (const CellBox& beyond : {BeyondX(box, back_x), BeyondY(box, back_y)})
        EXPECT_TRUE(!IsIn(beyond, looked_at) || AnyIn(terrain, mask, beyond));
    }
  }
  return found;
}

class FreeBoxAt : public ::testing::TestWithParam<Place> {
 protected:
  Terrain terrain_{GetParam().x, GetParam().y};
  RandomSource random_{11};

  point_int_t AnyCell() {
    return {terrain_.x() + random_.Int(-20, Terrain::kSide + 20),
            terrain_.y() + random_.Int(-20, Terrain::kSide + 20)};
  }
  /// Checks boxes at many places.
  void CheckMany() {
    int found = 0;
    for (int i = 0; i < 150; i++) {
      const RandomSelfMask hidden(&random_, terrain_);
      const ray_mask_t& mask = random_.OneIn(2) ? hidden.mask : kNoMask;
      std::vector<point_int_t> starts = {AnyCell()};
      const int others = random_.OneIn(2) ? 0 : random_.Int(1, 5);
      for (int k = 0; k < others; k++) {
        const int reach = random_.OneIn(9) ? 300 : 12;
        starts.push_back(
            {starts[0].x + random_.Int(-reach, reach), starts[0].y + random_.Int(-reach, reach)});
      }
      found += Check(terrain_, mask, starts);
      ASSERT_FALSE(HasFailure()) << i << ": (" << starts[0].x << ", " << starts[0].y << ")";
    }
    EXPECT_GT(found, 150) << "these places are not a strong test";
  }
};
INSTANTIATE_TEST_SUITE_P(Everywhere, FreeBoxAt, ::testing::ValuesIn(test::kBadPlaces));

TEST_P(FreeBoxAt, SparseCells) {
  terrain_.AddDust(&random_, 40);
  CheckMany();
}

TEST_P(FreeBoxAt, SomeCells) {
  terrain_.AddDust(&random_, 600);
  CheckMany();
}

TEST_P(FreeBoxAt, Frames) {
  terrain_.AddFrames(&random_, 12);
  CheckMany();
}

TEST(FreeBox, IsThreeRegionsWideWhereThereIsNothing) {
  const Terrain terrain(0, 0);
  const FreeBoxes boxes = Starts({{100, 100}}).Find(terrain.View(Terrain::kOfGrid), kNoMask);
  const CellBox& onward = boxes.towards[0][0];
  EXPECT_EQ(onward.min_x, 96);
  EXPECT_EQ(onward.max_x, 191);
  const CellBox& back = boxes.towards[1][1];
  EXPECT_EQ(back.min_x, 0);
  EXPECT_EQ(back.max_y, 103);
}

TEST(FreeBox, HasNoCellsWhereSomethingStands) {
  Terrain terrain(0, 0);
  terrain.Add(99, 97);
  const FreeBoxes boxes = Starts({{100, 100}}).Find(terrain.View(Terrain::kOfGrid), kNoMask);
  EXPECT_LT(boxes.towards[0][0].max_x, boxes.towards[0][0].min_x);
}

}  // namespace
}  // namespace Stg::internal::sensing
