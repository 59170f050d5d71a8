// SPDX-License-Identifier: GPL-2.0-or-later
//
// The vectorized walk and the scalar walk give bit-equal hits, cells and middles. It is tested with
// this processor's vectors, if there are any, and with portable lanes.

#include "sensing/simd/wide_walk.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "sensing/first_hits.hh"
#include "support/draw_cells.hh"
#include "support/plain_walk.hh"
#include "support/random_source.hh"
#include "support/terrain.hh"
#include "support/walk_kinds.hh"

namespace Stg::internal::sensing {
namespace {

using test::kLongest;
using test::kNoMask;
using test::Place;
using test::PlainRay;
using test::RandomSelfMask;
using test::RandomSource;
using test::Terrain;

// ---- groups of rays -----------------------------------------------------------------------------

/// A group of rays and the data that it points to.
class Rays {
 public:
  explicit Rays(const ray_grid_t& view, const ray_mask_t& mask = kNoMask)
      : view_(view), mask_(mask) {}

  /// Adds a slice of rays with these displacements, all from the start of the first one.
  void Add(const std::vector<PlainRay>& rays) {
    FanRecord fan = StartOf(rays[0]);
    fan.cosine = 1 << 30;
    std::vector<Direction> directions;
    for (const PlainRay& ray : rays)
      directions.push_back({static_cast<int32_t>(ray.dx), static_cast<int32_t>(ray.dy)});
    Add(fan, std::move(directions));
  }
  /// Adds a slice of rays with the length of `ahead`, over a field of view around it.
  void AddFan(const PlainRay& ahead, double fov, uint32_t count) {
    FanRecord fan = StartOf(ahead);
    fan.cosine = static_cast<int32_t>(ahead.dx);
    fan.sine = static_cast<int32_t>(ahead.dy);
    std::vector<Direction> directions;
    for (uint32_t i = 0; i < count; i++)
      directions.push_back(MakeDirection(SampleBearing(fov, count, i)));
    Add(fan, std::move(directions));
  }
  uint32_t count() const { return count_; }

  /// The group; valid until a slice is added.
  RayGroup Group() {
    slices_.clear();
    for (size_t i = 0; i < fans_.size(); i++)
      slices_.push_back({&fans_[i], directions_[i].data(),
                         static_cast<uint32_t>(directions_[i].size()), 1.5 + static_cast<double>(i),
                         nullptr});
    return {&view_, &mask_, slices_.data(), static_cast<uint32_t>(slices_.size()), count_, 0};
  }
  /// The group with hit lists as from a device; words(ray) returns the words of a ray.
  template <typename F>
  RayGroup Walked(uint32_t words_per_ray, F words) {
    RayGroup group = Group();
    group.words_per_ray = words_per_ray;
    walked_.clear();
    for (uint32_t slice = 0, ray = 0; slice < slices_.size(); slice++) {
      std::vector<uint32_t>& all = walked_.emplace_back();
      for (uint32_t k = 0; k < slices_[slice].count; k++, ray++)
        for (const uint32_t word : words(ray)) all.push_back(word);
      all.shrink_to_fit();
      slices_[slice].walked = all.data();
    }
    return group;
  }

 private:
  static FanRecord StartOf(const PlainRay& ray) {
    FanRecord fan{};
    fan.x = static_cast<int32_t>(ray.x);
    fan.y = static_cast<int32_t>(ray.y);
    fan.fraction = static_cast<uint32_t>(ray.fx) | static_cast<uint32_t>(ray.fy) << 16;
    return fan;
  }
  void Add(const FanRecord& fan, std::vector<Direction> directions) {
    count_ += static_cast<uint32_t>(directions.size());
    fans_.push_back(fan);
    directions.shrink_to_fit();  // so that sanitizers detect reads past the end
    directions_.push_back(std::move(directions));
  }

  ray_grid_t view_;
  ray_mask_t mask_;
  std::vector<FanRecord> fans_;
  std::vector<std::vector<Direction>> directions_;
  std::vector<FanSlice> slices_;
  std::vector<std::vector<uint32_t>> walked_;
  uint32_t count_ = 0;
};

/// Sets a displacement that ends exactly on borders of cells or 1/65536 cell beside them.
void EndOnBorders(RandomSource* random, PlainRay* ray) {
  ray->dx = (random->Between(-60, 60) << 16) - ray->fx + random->Between(-1, 1);
  if (random->OneIn(2))
    ray->dy = (random->Between(-60, 60) << 16) - ray->fy + random->Between(-1, 1);
}

/// Adds a random slice of up to `most` rays.
void AddRandomPart(RandomSource* random, const Terrain& terrain, uint32_t most, Rays* rays) {
  const uint32_t limit = random->OneIn(3) ? most : std::min(most, 12u);
  const auto count = static_cast<uint32_t>(random->Int(1, static_cast<int>(limit)));
  const auto random_ray = [&] {
    return random->OneIn(20) ? test::LongRay(random, terrain) : test::RandomRay(random, terrain);
  };
  const PlainRay first = random_ray();
  // Rotated rays must not become longer than a leg.
  const double length = std::hypot(static_cast<double>(first.dx), static_cast<double>(first.dy));
  if (random->OneIn(3) && length <= static_cast<double>(kLongest)) {
    rays->AddFan(first, random->Pick<double>({0, 0.01, 1.5, M_PI, 6}), count);
    return;
  }
  std::vector<PlainRay> slice = {first};
  while (slice.size() < count) {
    PlainRay ray = random_ray();
    ray.fx = first.fx;
    ray.fy = first.fy;
    if (random->OneIn(3)) EndOnBorders(random, &ray);
    slice.push_back(ray);
  }
  rays->Add(slice);
}

Rays RandomRays(RandomSource* random, const Terrain& terrain, const ray_grid_t& view,
                const ray_mask_t& mask) {
  Rays rays(view, mask);
  const uint32_t count = random->OneIn(4)
                             ? RayGroup::kMaxRays
                             : static_cast<uint32_t>(random->Int(1, RayGroup::kMaxRays));
  const bool small_parts = random->OneIn(4);
  while (rays.count() < count)
    AddRandomPart(random, terrain, small_parts ? 1 : count - rays.count(), &rays);
  return rays;
}

// ---- expected hits ------------------------------------------------------------------------------

struct Found {
  uint32_t hit = RAY_NO_HIT;
  grid::BodyList bodies = WideHits::kNothing;
  double range = 0;

  bool operator==(const Found& other) const {
    return hit == other.hit && bodies == other.bodies &&
           std::bit_cast<uint64_t>(range) == std::bit_cast<uint64_t>(other.range);
  }
};
void PrintTo(const Found& found, std::ostream* out) {
  *out << "hit " << found.hit << " bodies " << found.bodies << " range " << found.range;
}

/// The expected hits and bodies by ray_next(), and ranges by FirstHits without lanes.
std::vector<Found> OneByOne(const grid::Grid& grid, const RayGroup& group) {
  const auto scalar = std::make_unique<FirstHits>(grid, WideWalk{});
  std::vector<double> ranges(group.count);
  scalar->Walk(group, ranges.data());
  std::vector<Found> all;
  for (uint32_t slice = 0; slice < group.slice_count; slice++) {
    const auto& [fan, directions, count, leg_length, walked] = group.slices[slice];
    for (uint32_t k = 0; k < count; k++) {
      const Direction d = directions[k];
      ray_t ray;
      ray_begin(&ray, group.grid, fan->x, fan->y, static_cast<int>(fan->fraction & 0xffff),
                static_cast<int>(fan->fraction >> 16),
                ray_rotate_x(fan->cosine, fan->sine, d.cosine, d.sine),
                ray_rotate_y(fan->cosine, fan->sine, d.cosine, d.sine));
      const auto i = static_cast<uint32_t>(all.size());
      Found found{.range = leg_length};
      if (ray_next(group.grid, group.mask, &ray)) {
        found = {ray_pack(ray.u, ray.v), grid.ListIn(grid.CellAt(ray.region, ray.tile, ray.bit)),
                 ranges[i]};
        EXPECT_NE(found.bodies, 0u);
      }
      EXPECT_EQ((Found{scalar->Packed(i), scalar->Bodies(i), ranges[i]}), found);
      all.push_back(found);
    }
  }
  return all;
}

/// Arrays for the results, with guard elements at the end that must not change.
class Results {
 public:
  explicit Results(uint32_t count)
      : count_(count),
        hits_(WideHits::kCapacity),
        bodies_(WideHits::kCapacity),
        ranges_(count + kGuards, -7) {}

  WideHits Room() { return {hits_.data(), bodies_.data(), ranges_.data(), ends_}; }
  void Expect(const std::vector<Found>& expected) const {
    ASSERT_EQ(expected.size(), count_);
    for (uint32_t i = 0; i < count_; i++)
      ASSERT_EQ((Found{hits_[i], bodies_[i], ranges_[i]}), expected[i]) << i << " of " << count_;
    for (uint32_t i = count_; i < count_ + kGuards; i++) ASSERT_EQ(ranges_[i], -7);
    for (uint32_t i = 0; i + 1 < count_; i++)
      ASSERT_EQ(ends_[i / 64] >> i % 64 & 1, bodies_[i] != bodies_[i + 1]) << i;
  }

 private:
  static constexpr uint32_t kGuards = 16;
  const uint32_t count_;
  std::vector<uint32_t> hits_, bodies_;
  std::vector<double> ranges_;
  uint64_t ends_[WideHits::kEndWords];
};

/// Checks the walk of the group, and hit lists of a device that supplies the bodies of all hits, of
/// every third, or of none. Everything is done twice, because no state may be left over.
void Check(const WideWalk& wide, const grid::Grid& grid, Rays* rays, size_t* hits = nullptr) {
  const std::vector<Found> expected = OneByOne(grid, rays->Group());
  if (hits)
    for (const Found& found : expected) *hits += found.hit != RAY_NO_HIT;
  for (uint32_t time = 0; time < 6; time++) {
    const RayGroup group = rays->Group();
    Results walked(group.count), looked(group.count);
    wide.walk(group, grid.tables(), walked.Room());
    ASSERT_NO_FATAL_FAILURE(walked.Expect(expected)) << "walked";
    const auto is_known = [&](uint32_t ray) {
      // A real device supplies no body if a tile has several; supplying it must not matter.
      return time % 3 == 0 || (time % 3 == 1 && ray % 3 == 0);
    };
    const RayGroup by_device = rays->Walked(2 + time / 3, [&](uint32_t ray) {
      std::vector<uint32_t> words(2 + time / 3, 0x5a5a5a5a);
      words[0] = is_known(ray) ? expected[ray].bodies : 0;
      words[1] = expected[ray].hit;
      return words;
    });
    wide.evaluate(by_device, grid.tables(), looked.Room());
    ASSERT_NO_FATAL_FAILURE(looked.Expect(expected)) << "looked";
  }
}

// ---- kinds of lanes -----------------------------------------------------------------------------

class WideWalkAt : public ::testing::TestWithParam<std::tuple<WideWalk, Place>> {
 protected:
  static Terrain MakeTerrain() {
    const auto [x, y] = std::get<Place>(GetParam());
    return {x, y};
  }
};
INSTANTIATE_TEST_SUITE_P(Everywhere, WideWalkAt,
                         ::testing::Combine(::testing::ValuesIn(test::WalkKinds()),
                                            ::testing::ValuesIn(test::kBadPlaces)),
                         [](const auto& test) {
                           return std::string(std::get<0>(test.param).name) + "_" +
                                  std::to_string(test.index);
                         });

class WideWalkOf : public ::testing::TestWithParam<WideWalk> {};
INSTANTIATE_TEST_SUITE_P(AnyKind, WideWalkOf, ::testing::ValuesIn(test::WalkKinds()),
                         [](const auto& test) { return std::string(test.param.name); });

void CheckMany(const WideWalk& wide, const Terrain& terrain, uint64_t seed, int groups) {
  RandomSource random(seed);
  size_t hits = 0;
  for (int i = 0; i < groups; i++) {
    const ray_grid_t view = terrain.View(static_cast<Terrain::Box>(random.Int(0, 2)));
    const RandomSelfMask hidden(&random, terrain);
    const ray_mask_t& mask = random.OneIn(2) ? hidden.mask : kNoMask;
    Rays rays = RandomRays(&random, terrain, view, mask);
    ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays, &hits)) << "group " << i;
  }
  EXPECT_GT(hits, static_cast<size_t>(groups) * 5) << "too few rays hit anything";
}

TEST_P(WideWalkAt, SparseCells) {
  const WideWalk& wide = std::get<WideWalk>(GetParam());
  Terrain terrain = MakeTerrain();
  RandomSource random(1);
  terrain.AddDust(&random, 40);
  CheckMany(wide, terrain, 2, 80);
}

TEST_P(WideWalkAt, SomeCells) {
  const WideWalk& wide = std::get<WideWalk>(GetParam());
  Terrain terrain = MakeTerrain();
  RandomSource random(3);
  terrain.AddDust(&random, 1500);
  CheckMany(wide, terrain, 4, 80);
}

TEST_P(WideWalkAt, ManyCells) {
  const WideWalk& wide = std::get<WideWalk>(GetParam());
  Terrain terrain = MakeTerrain();
  RandomSource random(5);
  terrain.AddDust(&random, Terrain::kSide * Terrain::kSide / 3);
  CheckMany(wide, terrain, 6, 80);
}

TEST_P(WideWalkAt, Frames) {
  const WideWalk& wide = std::get<WideWalk>(GetParam());
  Terrain terrain = MakeTerrain();
  RandomSource random(7);
  terrain.AddFrames(&random, 30);
  CheckMany(wide, terrain, 8, 80);
}

// ---- special cases ------------------------------------------------------------------------------

TEST_P(WideWalkOf, EveryNumberOfRaysInPartsOfEveryKind) {
  const WideWalk& wide = GetParam();
  Terrain terrain(-160, -160);
  RandomSource random(9);
  terrain.AddDust(&random, 3000);
  const ray_grid_t view = terrain.View(Terrain::kTight);
  // All small and all large counts; between them, counts with all remainders modulo 8.
  std::vector<uint32_t> counts;
  for (uint32_t count = 1; count <= RayGroup::kMaxRays; count += count < 72 || count > 245 ? 1 : 5)
    counts.push_back(count);
  ASSERT_EQ(counts.back(), RayGroup::kMaxRays);
  for (const uint32_t count : counts) {
    for (const uint32_t per_part : {1u, 7u, 8u, 9u, 60u, count}) {
      Rays rays(view);
      while (rays.count() < count)
        rays.AddFan(test::RandomRay(&random, terrain), 3, std::min(per_part, count - rays.count()));
      ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays)) << count << " by " << per_part;
    }
  }
}

// Short rays beside rays of thousands of cells: lanes become inactive at very different times.
TEST_P(WideWalkOf, SuperregionsOneAfterTheOther) {
  const WideWalk& wide = GetParam();
  RandomSource random(10);
  for (const int walls : {3, 30, 1000}) {
    grid::Grid grid;
    const grid::BodyId body = grid.AddBody(grid::Body());
    for (int i = 0; i < walls; i++) {
      const int x = random.Int(-6000, 6000), y = random.Int(-6000, 6000),
                length = random.Int(1, 300);
      const bool upwards = random.OneIn(2);
      for (int k = 0; k < length; k++)
        test::DrawCellOnce(&grid, upwards ? x : x + k, upwards ? y + k : y, body);
    }
    const ray_grid_t view = grid.View(grid::kEverything);
    size_t hits = 0;
    for (int round = 0; round < 60; round++) {
      Rays rays(view);
      while (rays.count() < 100) {
        const auto at = [&] { return random.Between(-7000, 7000); };
        const int64_t reach = int64_t{1} << random.Int(16, 30);
        const auto way = [&] { return random.Between(-reach, reach); };
        rays.Add({{at(), at(), random.Between(0, 65535), 0, way(), way()},
                  {0, 0, 0, 0, way(), random.Between(-1, 1)}});
      }
      ASSERT_NO_FATAL_FAILURE(Check(wide, grid, &rays, &hits));
    }
    EXPECT_GT(hits, 0u);
  }
}

// Starts are in the last occupied rows, so hardly any border needs to be crossed.
TEST_P(WideWalkOf, HitsInTheLastRowsOfTheBoxAreFound) {
  const WideWalk& wide = GetParam();
  Terrain terrain(0, 0);
  for (const int x : {0, 63})
    for (const int y : {0, 63}) terrain.Add(x, y);
  for (const Terrain::Box box : {Terrain::kTight, Terrain::kOfGrid, Terrain::kNone}) {
    for (const int64_t x : {0, 63})
      for (const int64_t y : {0, 63})
        for (const int64_t f : {0, 1, 32768, 65535}) {
          Rays rays(terrain.View(box));
          for (const int64_t d : {-100 << 16, -1, 0, 1, 100 << 16})
            rays.Add(
                {{x, y, f, f, d, 0}, {x, y, f, f, 0, d}, {x, y, f, f, d, d}, {x, y, f, f, d, -d}});
          ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays));
        }
  }
}

TEST_P(WideWalkOf, ABorderReachedExactlyIsCrossed) {
  const WideWalk& wide = GetParam();
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  Rays rays(terrain.View(Terrain::kOfGrid));
  rays.Add({{3, 5, 100, 9, (7 << 16) - 100, 0}});
  rays.Add({{3, 5, 100, 9, (7 << 16) - 101, 0}});
  rays.Add({{20, 5, 100, 9, -(9 << 16) - 100, 0}});
  rays.Add({{20, 5, 100, 9, -(9 << 16) - 99, 0}});
  Results results(4);
  wide.walk(rays.Group(), terrain.grid().tables(), results.Room());
  const uint32_t* hits = results.Room().hits;
  EXPECT_EQ(hits[0], ray_pack(7, 0));
  EXPECT_EQ(hits[1], RAY_NO_HIT);
  EXPECT_EQ(hits[2], ray_pack(10, 0));
  EXPECT_EQ(hits[3], RAY_NO_HIT);
  ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays));
}

TEST_P(WideWalkOf, TheMiddleOfTheWayThroughTheCell) {
  const WideWalk& wide = GetParam();
  Terrain terrain(0, 0);
  terrain.Add(10, 5);
  Rays rays(terrain.View(Terrain::kOfGrid));
  rays.Add({{10, 5, 0, 0, 0, 0}});                      // no displacement
  rays.Add({{0, 5, 32768, 32768, 20 << 16, 0}});        // along an axis
  rays.Add({{10, 25, 32768, 32768, 0, -(40 << 16)}});   // along the other
  rays.Add({{8, 3, 32768, 32768, 4 << 16, 4 << 16}});   // through corners
  rays.Add({{10, 5, 32768, 32768, 1 << 14, 1 << 14}});  // ends in the cell that it starts in
  Results results(5);
  wide.walk(rays.Group(), terrain.grid().tables(), results.Room());
  const RayGroup group = rays.Group();
  for (uint32_t i = 0; i < 5; i++)
    EXPECT_EQ(results.Room().ranges[i], 0.5 * group.slices[i].leg_length);
  ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays));
}

TEST_P(WideWalkOf, NothingOccupied) {
  const WideWalk& wide = GetParam();
  const grid::Grid grid;
  Rays rays(grid.View(grid::kEverything));
  for (const int64_t at : {-5000, -1, 0, 1, 5000})
    for (const int64_t d : {-kLongest, int64_t{0}, kLongest})
      rays.Add({{at, at, 0, 0, d, d / 3}, {at, at, 0, 0, -d, 0}});
  size_t hits = 0;
  ASSERT_NO_FATAL_FAILURE(Check(wide, grid, &rays, &hits));
  EXPECT_EQ(hits, 0u);
}

TEST_P(WideWalkOf, SelfMasksThatHideAllOrNothing) {
  const WideWalk& wide = GetParam();
  Terrain terrain(-160, -160);
  RandomSource random(11);
  terrain.AddDust(&random, 500);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const std::vector<uint64_t> all(50 * 50, ~uint64_t{0}), none(50 * 50, 0);
  const ray_mask_t masks[] = {{all.data(), -25, -25, 50, 50},
                              {none.data(), -25, -25, 50, 50},
                              {all.data(), -25, -25, 0, 0}};
  size_t hits[3] = {};
  for (int round = 0; round < 100; round++) {
    for (size_t i = 0; i < 3; i++) {
      RandomSource same(static_cast<uint64_t>(round));
      Rays rays = RandomRays(&same, terrain, view, masks[i]);
      ASSERT_NO_FATAL_FAILURE(Check(wide, terrain.grid(), &rays, &hits[i]));
    }
  }
  EXPECT_EQ(hits[0], 0u);
  EXPECT_GT(hits[1], 1000u);
  EXPECT_EQ(hits[2], hits[1]);
}

// FirstHits with and without lanes, including groups that are too small for lanes.
TEST_P(WideWalkOf, FirstHitsAreTheSame) {
  const WideWalk& wide = GetParam();
  Terrain terrain(-160, -160);
  RandomSource random(12);
  terrain.AddDust(&random, 2000);
  const ray_grid_t view = terrain.View(Terrain::kOfGrid);
  const auto first_hits = std::make_unique<FirstHits>(terrain.grid(), wide);
  std::vector<double> ranges(RayGroup::kMaxRays);
  const auto get = [&](uint32_t i) {
    return Found{first_hits->Packed(i), first_hits->Bodies(i), ranges[i]};
  };
  for (int round = 0; round < 300; round++) {
    Rays rays(view);
    const auto count = static_cast<uint32_t>(round % 3 == 0 ? random.Int(1, 5)
                                                            : random.Int(1, RayGroup::kMaxRays));
    while (rays.count() < count) AddRandomPart(&random, terrain, count - rays.count(), &rays);
    const std::vector<Found> expected = OneByOne(terrain.grid(), rays.Group());
    first_hits->Walk(rays.Group(), ranges.data());
    for (uint32_t i = 0; i < count; i++) ASSERT_EQ(get(i), expected[i]);
    // Use lists with a capacity of two hits, of which only the first one counts.
    const RayGroup group = rays.Walked(3, [&](uint32_t ray) {
      const uint32_t body = ray % 2 == 0 ? expected[ray].bodies : 0;
      return std::vector<uint32_t>{body, expected[ray].hit, 0x12345678};
    });
    first_hits->EvaluateDeviceHits(group, ranges.data());
    for (uint32_t i = 0; i < count; i++) ASSERT_EQ(get(i), expected[i]);
  }
}

}  // namespace
}  // namespace Stg::internal::sensing
