// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compares the grid with a map from cells to lists.

#include "grid/grid.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstdint>
#include <limits>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "support/draw_cells.hh"
#include "support/random_source.hh"

namespace Stg::internal::grid {
namespace {

using test::DrawCell;
using test::EraseCell;
using test::RandomSource;
using Cell = std::pair<int32_t, int32_t>;

/// Bodies need a model pointer that is not null; it is never dereferenced.
Model* SomeModel() {
  static int somewhere;
  return reinterpret_cast<Model*>(&somewhere);
}

Body MakeBody(double z_min, double z_max, bool visible = true) {
  Body body;
  body.z_min = z_min;
  body.z_max = z_max;
  body.model = SomeModel();
  body.ranger_visible = visible;
  return body;
}

/// Selects the bodies that a layer should show.
struct LayerRule {
  enum Kind { kAll, kAnyHeight, kHeight } kind;
  double z;
  bool Shows(const Body& body) const {
    if (kind == kAll) return true;
    if (!body.ranger_visible) return false;
    return kind == kAnyHeight || (z >= body.z_min && z <= body.z_max);
  }
};

/// A grid and its expected content.
class Checked {
 public:
  struct Entry {
    CellRef ref;
    Cell cell;
    BodyId body;
  };

  Checked() { layers_[kEverything] = {LayerRule::kAll, 0}; }

  Grid& grid() { return grid_; }
  const std::vector<BodyId>& bodies() const { return bodies_; }
  const std::vector<Entry>& entries() const { return entries_; }
  void ExpectLayer(LayerIndex i, LayerRule rule) { layers_[i] = rule; }

  void AddBody(const Body& body) { bodies_.push_back(grid_.AddBody(body)); }
  /// Does nothing if the body is in the cell already.
  void Insert(Cell cell, BodyId body) {
    const std::vector<BodyId>& list = lists_[cell];
    if (std::count(list.begin(), list.end(), body) > 0) return;
    const CellRef ref = DrawCell(&grid_, cell.first, cell.second, body);
    entries_.push_back({ref, cell, body});
    lists_[cell].push_back(body);
  }
  void Remove(size_t entry) {
    const Entry gone = entries_[entry];
    EraseCell(&grid_, gone.ref, gone.body);
    std::vector<BodyId>& list = lists_[gone.cell];
    list.erase(std::find(list.begin(), list.end(), gone.body));
    if (list.empty()) lists_.erase(gone.cell);
    entries_[entry] = entries_.back();
    entries_.pop_back();
  }
  /// Erases the body where it was rasterized last, and rasterizes it in the cells of `to`.
  void Rasterize(BodyId body, const std::set<Cell>& to) {
    Drawn& drawn = drawn_[body];
    std::vector<CellSet> sets;
    CellSetBuilder maker(&sets);
    for (const auto& [x, y] : to) maker.Add(x, y);
    maker.Finish();
    grid_.Rasterize(body, drawn.sets, sets);
    for (const Cell& cell : drawn.cells) {
      std::erase(lists_[cell], body);
      if (lists_[cell].empty()) lists_.erase(cell);
    }
    for (const Cell& cell : to) lists_[cell].push_back(body);
    drawn = {to, sets};
  }
  /// Number of cells in which bodies were rasterized again, counted once per body and cell.
  int64_t CountRedrawn() const {
    size_t cells = 0;
    for (const auto& [body, drawn] : drawn_) cells += drawn.cells.size();
    return static_cast<int64_t>(cells);
  }
  void Change(BodyId body, const Body& to) {
    if (drawn_.count(body) > 0) return grid_.ChangeBody(body, to, drawn_[body].sets);
    std::vector<CellRef> cells;
    for (const Entry& entry : entries_)
      if (entry.body == body) cells.push_back(entry.ref);
    grid_.ChangeBody(body, to, test::CellSetsOf(grid_, cells));
  }

  void Verify() {
    VerifyLists();
    for (const auto& [index, rule] : layers_) VerifyLayer(index, rule);
    std::set<Cell> tiles, regions;
    for (const auto& [cell, list] : lists_) {
      tiles.insert({cell.first >> 3, cell.second >> 3});
      regions.insert({cell.first >> 6, cell.second >> 6});
      const CellBox box = grid_.occupied();
      ASSERT_TRUE(cell.first >= box.min_x && cell.first <= box.max_x);
      ASSERT_TRUE(cell.second >= box.min_y && cell.second <= box.max_y);
    }
    ASSERT_EQ(grid_.statistics().tiles, tiles.size());
    ASSERT_GE(grid_.statistics().regions, regions.size());
    VerifyRegionMaps(regions);
  }

 private:
  void VerifyLists() {
    for (const auto& [cell, list] : lists_) {
      ASSERT_NE(grid_.FindRegion(cell.first, cell.second), 0u);
      ASSERT_EQ(list, test::BodiesAt(grid_, cell.first, cell.second));
      CellSet set = test::CellSetOf(cell.first, cell.second);
      ASSERT_TRUE(grid_.FindSlots(std::span(&set, 1)));
      ASSERT_EQ(grid_.Crowded(set) != 0, list.size() > 1);
    }
    for (const Entry& entry : entries_) {
      Cell at;
      grid_.Coordinates(entry.ref, &at.first, &at.second);
      ASSERT_EQ(at, entry.cell);
      std::vector<BodyId> found;
      grid_.AnyIn(entry.ref, [&](BodyId id) {
        found.push_back(id);
        return false;
      });
      ASSERT_EQ(found, lists_[entry.cell]);
    }
  }

  /// The maps must contain exactly the regions that are not empty.
  void VerifyRegionMaps(const std::set<Cell>& regions) {
    const ray_grid_t view = grid_.View(kEverything);
    size_t bits = 0;
    for (const uint64_t map : grid_.region_maps()) bits += static_cast<size_t>(std::popcount(map));
    ASSERT_EQ(bits, regions.size());
    for (const auto& [x, y] : regions) {
      const ray_uint super = ray_find_super(&view, x >> 4, y >> 4);
      const ray_uint map = ray_block_map(super, x >> 3, y >> 3);
      ASSERT_NE(view.region_maps[map] >> ray_place(x, y, 3) & 1, 0u) << x << " " << y;
    }
  }

  /// The layer must have exactly the expected bits, and tile maps that agree with them.
  void VerifyLayer(LayerIndex index, const LayerRule& rule) {
    const Occupancy& layer = grid_.occupancy(index);
    size_t bits = 0, expected_bits = 0;
    for (size_t i = 0; i < layer.tiles().size(); i++) {
      const uint64_t word = layer.tiles()[i];
      bits += static_cast<size_t>(std::popcount(word));
      ASSERT_EQ(word != 0, (layer.tile_maps()[i / 64] >> (i % 64) & 1) != 0);
    }
    for (const auto& [cell, list] : lists_) {
      const auto [x, y] = cell;
      const size_t word = size_t{grid_.FindRegion(x, y)} * 64 + Grid::TileOf(x, y);
      const bool expected = std::any_of(list.begin(), list.end(),
                                        [&](BodyId id) { return rule.Shows(grid_.body(id)); });
      expected_bits += expected;
      ASSERT_EQ((layer.tiles()[word] >> Grid::BitOf(x, y) & 1) != 0, expected)
          << "layer " << index << " cell " << x << " " << y;
    }
    ASSERT_EQ(bits, expected_bits) << "layer " << index;
  }

  struct Drawn {
    std::set<Cell> cells;
    std::vector<CellSet> sets;
  };

  Grid grid_;
  std::vector<BodyId> bodies_;
  std::map<BodyId, Drawn> drawn_;
  std::vector<Entry> entries_;
  std::map<Cell, std::vector<BodyId>> lists_;
  std::map<LayerIndex, LayerRule> layers_;
};

/// Returns a cell: in a crowded area, spread out, at negative coordinates, or very far away.
Cell RandomCell(RandomSource* random) {
  const auto coordinate = [&](int spread) {
    return static_cast<int32_t>(random->Between(-spread, spread));
  };
  switch (random->Int(0, 3)) {
    case 0:
      return {coordinate(3), coordinate(3)};
    case 1:
      return {coordinate(100), coordinate(100)};
    case 2:
      return {coordinate(3000), coordinate(3000)};
    default:
      return {coordinate(kMaxCell), coordinate(kMaxCell)};
  }
}

TEST(Grid, EmptyHasNothing) {
  Checked checked;
  checked.Verify();
  EXPECT_TRUE(checked.grid().occupied().empty());
  EXPECT_EQ(checked.grid().FindRegion(0, 0), 0u);
  EXPECT_EQ(checked.grid().statistics().superregions, 0u);
  EXPECT_TRUE(test::BodiesAt(checked.grid(), 5, 5).empty());
}

TEST(Grid, RandomChangesKeepListsAndLayersRight) {
  for (uint64_t seed = 1; seed <= 4; seed++) {
    RandomSource random(seed);
    Checked checked;
    for (int i = 0; i < 30; i++)
      checked.AddBody(MakeBody(random.Int(0, 3), random.Int(3, 6), !random.OneIn(4)));
    Grid& grid = checked.grid();
    for (int step = 0; step < 6000; step++) {
      if (step == 1000) checked.ExpectLayer(grid.RangerLayer(3, true), {LayerRule::kHeight, 3});
      if (step == 1500) checked.ExpectLayer(grid.RangerLayer(0, false), {LayerRule::kAnyHeight, 0});
      if (step == 2000) checked.ExpectLayer(grid.RangerLayer(1.5, true), {LayerRule::kHeight, 1.5});
      // Grows, then shrinks to nothing.
      if (random.Int(0, 2) < (step < 3500 ? 2 : 1) || checked.entries().empty())
        checked.Insert(RandomCell(&random), random.Pick(checked.bodies()));
      else
        checked.Remove(static_cast<size_t>(random.Next() % checked.entries().size()));
      if (random.OneIn(40))
        checked.Change(random.Pick(checked.bodies()),
                       MakeBody(random.Int(0, 3), random.Int(3, 6), !random.OneIn(4)));
      if (step % 500 == 0) {
        ASSERT_NO_FATAL_FAILURE(checked.Verify());
      }
    }
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    while (!checked.entries().empty()) checked.Remove(checked.entries().size() - 1);
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    EXPECT_EQ(grid.statistics().tiles, 0u);
  }
}

/// Cells of a rectangle: most of its border and some of its inside.
std::set<Cell> RandomOutline(RandomSource* random, Cell at) {
  std::set<Cell> cells;
  const int32_t width = random->Int(1, 30), height = random->Int(1, 30);
  for (int32_t x = 0; x < width; x++)
    for (int32_t y = 0; y < height; y++) {
      const bool border = x == 0 || y == 0 || x == width - 1 || y == height - 1;
      if (border ? !random->OneIn(9) : random->OneIn(9))
        cells.insert({at.first + x, at.second + y});
    }
  return cells;
}

// Bodies move a little, jump, vanish and come back, alone and in a crowd.
TEST(Grid, RedrawnBodiesAreTheLastInTheirLists) {
  for (uint64_t seed = 1; seed <= 4; seed++) {
    RandomSource random(seed);
    Checked checked;
    const int bodies = seed % 2 ? 3 : 25;
    std::vector<Cell> places;
    for (int i = 0; i < bodies; i++) {
      checked.AddBody(MakeBody(random.Int(0, 3), random.Int(3, 6), !random.OneIn(4)));
      places.push_back({random.Int(-60, 60), random.Int(-60, 60)});
    }
    checked.ExpectLayer(checked.grid().RangerLayer(3, true), {LayerRule::kHeight, 3});
    checked.ExpectLayer(checked.grid().RangerLayer(1, true), {LayerRule::kHeight, 1});
    for (int step = 0; step < 1500; step++) {
      const auto body = static_cast<BodyId>(random.Int(0, bodies - 1));
      Cell& place = places[body];
      place = {place.first + random.Int(-3, 3), place.second + random.Int(-3, 3)};
      if (random.OneIn(20)) place = {random.Int(-100, 100), random.Int(-100, 100)};
      const bool vanishes = random.OneIn(12);
      if (random.OneIn(10))
        checked.Change(body, MakeBody(random.Int(0, 3), random.Int(3, 6), !random.OneIn(4)));
      checked.Rasterize(body, vanishes ? std::set<Cell>() : RandomOutline(&random, place));
      ASSERT_EQ(checked.grid().rasterized_cells(), checked.CountRedrawn());
      if (step % 50 == 0) {
        ASSERT_NO_FATAL_FAILURE(checked.Verify());
      }
    }
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    for (const BodyId body : checked.bodies()) checked.Rasterize(body, {});
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    EXPECT_EQ(checked.grid().statistics().tiles, 0u);
    EXPECT_EQ(checked.grid().rasterized_cells(), 0);
  }
}

TEST(Grid, AnyStopsAtTheFirstMatch) {
  Grid grid;
  CellRef cell = 0;
  for (int i = 0; i < 5; i++) cell = DrawCell(&grid, 7, -7, grid.AddBody(MakeBody(0, 1)));
  int looked_at = 0;
  EXPECT_TRUE(grid.AnyIn(cell, [&](BodyId id) {
    looked_at++;
    return id == 2;
  }));
  EXPECT_EQ(looked_at, 3);
}

TEST(Grid, BodyNumbersAreUsedAgain) {
  Grid grid;
  const BodyId first = grid.AddBody(MakeBody(0, 1));
  grid.RemoveBody(first);
  EXPECT_EQ(grid.AddBody(MakeBody(5, 6)), first);
  EXPECT_EQ(grid.body(first).z_min, 5);
}

TEST(Grid, CellsAtTheEndsOfTheGrid) {
  Checked checked;
  checked.AddBody(MakeBody(0, 1));
  for (const int32_t x : {-kMaxCell, -kMaxCell + 1, -1, 0, kMaxCell - 1, kMaxCell})
    for (const int32_t y : {-kMaxCell, -1, 0, kMaxCell}) checked.Insert({x, y}, 0);
  checked.Verify();
}

TEST(Grid, ManySuperregionsFarApart) {
  RandomSource random(21);
  Checked checked;
  checked.AddBody(MakeBody(0, 1));
  for (int i = 0; i < 700; i++) {
    const auto far = [&] { return static_cast<int32_t>(random.Between(-500, 500) * 1000000); };
    checked.Insert({far(), far()}, 0);
  }
  ASSERT_NO_FATAL_FAILURE(checked.Verify());
  const Grid& grid = checked.grid();
  EXPECT_GE(grid.statistics().superregions, 690u);
  // The directory must be at most half full, so that searches in it are short and end.
  EXPECT_GE(grid.directory().size(), 2 * grid.statistics().superregions);
  EXPECT_TRUE(std::has_single_bit(grid.directory().size()));
  for (int i = 0; i < 100000; i++) {
    const auto [x, y] = RandomCell(&random);
    const ray_grid_t view = grid.View(kEverything);
    const ray_uint super = ray_find_super(&view, x >> RAY_SUPER_SHIFT, y >> RAY_SUPER_SHIFT);
    ASSERT_LT(super * 256, grid.region_tables().size());
  }
}

TEST(Grid, StructureVersionChangesWithNewRegions) {
  Grid grid;
  const BodyId body = grid.AddBody(MakeBody(0, 1));
  DrawCell(&grid, 0, 0, body);
  const uint64_t version = grid.structure_version();
  const std::vector<uint32_t> tables = grid.region_tables();
  DrawCell(&grid, 63, 63, body);
  EXPECT_EQ(grid.structure_version(), version);
  EXPECT_EQ(grid.region_tables(), tables);
  DrawCell(&grid, 64, 0, body);
  EXPECT_GT(grid.structure_version(), version);
}

TEST(Grid, TheExtentIsThatOfSuperregions) {
  Grid grid;
  EXPECT_TRUE(grid.extent().empty());
  const BodyId body = grid.AddBody(MakeBody(0, 1));
  DrawCell(&grid, -1, 5, body);
  DrawCell(&grid, 3000, 5, body);
  const CellBox box = grid.extent();
  EXPECT_EQ(box.min_x, -1024);
  EXPECT_EQ(box.max_x, 3071);
  EXPECT_EQ(box.min_y, 0);
  EXPECT_EQ(box.max_y, 1023);
}

// ---- memory -------------------------------------------------------------------------------------

TEST(GridMemory, MovingBodyLeavesNoMemoryBehind) {
  Grid grid;
  const BodyId body = grid.AddBody(MakeBody(0, 1));
  grid.RangerLayer(0.5, true);
  CellRef last = DrawCell(&grid, 0, 0, body);
  size_t early = 0;
  for (int32_t i = 1; i <= 20000; i++) {
    const CellRef next = DrawCell(&grid, i * 640, i * -6400, body);
    EraseCell(&grid, last, body);
    last = next;
    if (i == 5000) early = grid.statistics().bytes;
  }
  const Grid::Statistics end = grid.statistics();
  EXPECT_EQ(end.tiles, 1u);
  EXPECT_LE(end.regions, 300u);
  EXPECT_LE(end.superregions, 300u);
  EXPECT_LE(end.bytes, early);
  EXPECT_LE(end.bytes, size_t{4} << 20);
  // Dropped regions no longer widen the box that rays are clipped to.
  EXPECT_GT(grid.occupied().min_x, 10000000);
}

TEST(GridMemory, DroppedRegionsCanBeReused) {
  Checked checked;
  checked.AddBody(MakeBody(0, 1));
  for (int round = 0; round < 3; round++) {
    for (int32_t i = 0; i < 1500; i++) checked.Insert({i * 100 - 70000, i * round * 70}, 0);
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    while (checked.entries().size() > 10) checked.Remove(0);
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    EXPECT_LE(checked.grid().statistics().regions, 300u);
  }
}

TEST(GridMemory, CrowdInOneCellNeedsOnlyItsList) {
  Grid grid;
  std::vector<BodyId> bodies(1000);
  for (BodyId& body : bodies) body = grid.AddBody(MakeBody(0, 1));
  CellRef cell = 0;
  for (const BodyId body : bodies) cell = DrawCell(&grid, 1, 1, body);
  size_t bytes = 0;  // including memory that is kept for reuse
  for (int round = 0; round < 10; round++) {
    if (round == 1) bytes = grid.statistics().bytes;
    for (const BodyId body : bodies) EraseCell(&grid, cell, body);
    EXPECT_EQ(grid.statistics().tiles, 0u);
    for (const BodyId body : bodies) cell = DrawCell(&grid, 1, 1, body);
  }
  EXPECT_EQ(grid.statistics().bytes, bytes);
}

/// A tile has lists for its cells only while it has several bodies.
TEST(GridMemory, TilesOfOneBodyNeedNoLists) {
  Grid grid;
  const BodyId wall = grid.AddBody(MakeBody(0, 1)), robot = grid.AddBody(MakeBody(0, 1));
  for (int32_t x = 0; x < 64; x++) DrawCell(&grid, x, 0, wall);
  const auto bytes = [&] { return grid.statistics().bytes; };
  const size_t alone = bytes();
  const CellRef beside = DrawCell(&grid, 3, 5, robot), within = DrawCell(&grid, 9, 0, robot);
  const size_t shared = bytes();
  EXPECT_GE(shared, alone + 2 * 64 * sizeof(uint32_t));
  EXPECT_EQ(test::BodiesAt(grid, 9, 0), (std::vector<BodyId>{wall, robot}));
  EXPECT_EQ(test::BodiesAt(grid, 3, 5), std::vector<BodyId>{robot});
  EXPECT_TRUE(test::BodiesAt(grid, 9, 5).empty());
  EraseCell(&grid, beside, robot);
  EraseCell(&grid, within, robot);
  for (int32_t x = 0; x < 64; x++) {
    EXPECT_EQ(test::BodiesAt(grid, x, 0), std::vector<BodyId>{wall});
    EXPECT_TRUE(test::BodiesAt(grid, x, 5).empty());
  }
  // Lists are reused as the robot moves; none stay behind.
  for (int32_t x = 0; x < 64; x++) EraseCell(&grid, DrawCell(&grid, x, 5, robot), robot);
  EXPECT_LE(bytes(), shared + 64);
}

// Bodies are erased in the order of rasterization, in reverse order and in random order.
TEST(GridMemory, ListsStayInOrder) {
  for (int way = 0; way < 3; way++) {
    Grid grid;
    std::vector<BodyId> bodies;
    std::vector<CellRef> cells;
    for (int i = 0; i < 50; i++) {
      bodies.push_back(grid.AddBody(MakeBody(0, 1)));
      cells.push_back(DrawCell(&grid, 1, 1, bodies.back()));
    }
    while (!bodies.empty()) {
      const size_t i = way == 0 ? 0 : way == 1 ? bodies.size() - 1 : bodies.size() * 7 / 11;
      EraseCell(&grid, cells[i], bodies[i]);
      bodies.erase(bodies.begin() + static_cast<std::ptrdiff_t>(i));
      cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(i));
      ASSERT_EQ(test::BodiesAt(grid, 1, 1), bodies) << way;
    }
  }
}

// ---- layers -------------------------------------------------------------------------------------

bool ShowsCell(const Grid& grid, LayerIndex layer, int32_t x, int32_t y) {
  const uint32_t region = grid.FindRegion(x, y);
  const auto tiles = grid.occupancy(layer).tiles();
  return tiles[size_t{region} * 64 + Grid::TileOf(x, y)] >> Grid::BitOf(x, y) & 1;
}

TEST(GridLayers, HeightsIncludeTheirEnds) {
  Grid grid;
  DrawCell(&grid, 0, 0, grid.AddBody(MakeBody(1, 2)));
  for (const double z : {1.0, 1.5, 2.0})
    EXPECT_TRUE(ShowsCell(grid, grid.RangerLayer(z, true), 0, 0)) << z;
  for (const double z : {0.999, 2.001})
    EXPECT_FALSE(ShowsCell(grid, grid.RangerLayer(z, true), 0, 0)) << z;
  EXPECT_TRUE(ShowsCell(grid, grid.RangerLayer(77, false), 0, 0));
}

TEST(GridLayers, AreReusedForEqualHeights) {
  Grid grid;
  const LayerIndex any = grid.RangerLayer(1, false);
  EXPECT_EQ(grid.RangerLayer(2, false), any);
  const LayerIndex one = grid.RangerLayer(1, true);
  EXPECT_NE(one, any);
  EXPECT_NE(one, kEverything);
  EXPECT_EQ(grid.RangerLayer(1, true), one);
  EXPECT_NE(grid.RangerLayer(2, true), one);
}

TEST(GridLayers, BodiesChangeWhatTheyShow) {
  Grid grid;
  const LayerIndex low = grid.RangerLayer(0.5, true), high = grid.RangerLayer(5, true);
  const BodyId id = grid.AddBody(MakeBody(0, 1));
  const std::vector<CellSet> cells = test::CellSetsOf(grid, {DrawCell(&grid, 0, 0, id)});
  grid.ChangeBody(id, MakeBody(4, 6), cells);
  EXPECT_FALSE(ShowsCell(grid, low, 0, 0));
  EXPECT_TRUE(ShowsCell(grid, high, 0, 0));
  grid.ChangeBody(id, MakeBody(0, 6, false), cells);
  EXPECT_FALSE(ShowsCell(grid, low, 0, 0));
  EXPECT_FALSE(ShowsCell(grid, high, 0, 0));
  EXPECT_TRUE(ShowsCell(grid, kEverything, 0, 0));
  grid.ChangeBody(id, MakeBody(0, 6), cells);
  EXPECT_TRUE(ShowsCell(grid, low, 0, 0));
}

TEST(GridLayers, TooManyHeightsShareOneLayer) {
  Grid grid;
  DrawCell(&grid, 0, 0, grid.AddBody(MakeBody(0, 1)));
  std::set<LayerIndex> layers;
  for (uint32_t i = 0; i < kMaxHeights; i++) layers.insert(grid.RangerLayer(i, true));
  EXPECT_EQ(layers.size(), kMaxHeights);
  const LayerIndex shared = grid.RangerLayer(1000, true);
  EXPECT_EQ(layers.count(shared), 0u);
  EXPECT_EQ(grid.RangerLayer(2000, true), shared);
  EXPECT_EQ(grid.RangerLayer(0, false), shared);
  EXPECT_TRUE(ShowsCell(grid, shared, 0, 0));
  EXPECT_LE(grid.layer_count(), kMaxLayers);
}

TEST(GridLayers, UnusedHeightsAreReplaced) {
  Grid grid;
  const BodyId body = grid.AddBody(MakeBody(0, 1));
  DrawCell(&grid, 0, 0, body);
  const uint32_t heights = kMaxHeights;
  for (uint32_t i = 0; i < heights; i++) grid.RangerLayer(i, true);
  const LayerIndex kept = grid.RangerLayer(0, true);
  const LayerIndex unused = grid.RangerLayer(1, true);
  const uint64_t id = grid.occupancy(unused).id();
  for (int i = 0; i < 3000; i++) {
    grid.ExpireLayers();
    EXPECT_EQ(grid.RangerLayer(0, true), kept);
  }
  EXPECT_TRUE(ShowsCell(grid, kept, 0, 0));
  EXPECT_TRUE(ShowsCell(grid, kEverything, 0, 0));
  std::set<LayerIndex> layers = {kept};
  for (uint32_t i = 1; i < heights; i++) layers.insert(grid.RangerLayer(0.01 * i, true));
  EXPECT_EQ(layers.size(), heights);
  EXPECT_LE(grid.layer_count(), kMaxLayers);
  for (const LayerIndex layer : layers) {
    EXPECT_TRUE(ShowsCell(grid, layer, 0, 0));
    if (layer == unused) {
      EXPECT_NE(grid.occupancy(layer).id(), id);
    }
  }
}

TEST(GridLayers, UnusedLayersFollowTheGridsGrowth) {
  Checked checked;
  checked.AddBody(MakeBody(0, 1));
  Grid& grid = checked.grid();
  grid.RangerLayer(0.5, true);
  for (int i = 0; i < 2000; i++) grid.ExpireLayers();
  for (int32_t i = 0; i < 100; i++) checked.Insert({i * 1000, i}, 0);
  checked.ExpectLayer(grid.RangerLayer(0.25, true), {LayerRule::kHeight, 0.25});
  checked.Verify();
}

TEST(GridLayers, NaNHeightHitsEverythingInOneLayer) {
  Grid grid;
  DrawCell(&grid, 0, 0, grid.AddBody(MakeBody(0, 1)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const LayerIndex layer = grid.RangerLayer(nan, true);
  EXPECT_TRUE(ShowsCell(grid, layer, 0, 0));
  EXPECT_EQ(grid.RangerLayer(nan, true), layer);
}

// ---- changes ------------------------------------------------------------------------------------

using Tiles = std::set<std::pair<uint32_t, uint32_t>>;  // (region, tile)

Tiles Noted(const ChangedTiles& changed) {
  Tiles tiles;
  changed.ForEachRegion([&](size_t region, uint64_t of_region) {
    EXPECT_NE(of_region, 0u);
    for (uint32_t tile = 0; tile < 64; tile++)
      if (of_region >> tile & 1) tiles.insert({static_cast<uint32_t>(region), tile});
  });
  EXPECT_EQ(changed.Count(), tiles.size());
  return tiles;
}

Tiles Noted(const Occupancy& layer) { return Noted(layer.changed()); }

std::vector<uint64_t> Copy(std::span<const uint64_t> words) { return {words.begin(), words.end()}; }

/// Grid::OnlyBody() of all tiles.
std::vector<BodyList> OnlyBodies(const Grid& grid) {
  std::vector<BodyList> bodies;
  for (uint32_t slot = 0; slot < grid.region_count() * kTilesPerRegion; slot++)
    bodies.push_back(grid.OnlyBody(slot));
  return bodies;
}

template <typename Words>
Tiles Different(const Words& before, const Words& after) {
  Tiles tiles;
  for (size_t i = 0; i < after.size(); i++)
    if (after[i] != (i < before.size() ? before[i] : 0))
      tiles.insert({static_cast<uint32_t>(i / 64), static_cast<uint32_t>(i % 64)});
  return tiles;
}

TEST(GridChanges, ExactlyTheChangedTilesAreListed) {
  RandomSource random(31);
  Checked checked;
  for (int i = 0; i < 5; i++) checked.AddBody(MakeBody(0, 1 + i, i != 2));
  Grid& grid = checked.grid();
  const LayerIndex height = grid.RangerLayer(3, true);
  grid.TrackChanges(true);
  for (int step = 0; step < 2000; step++) {
    const std::vector<uint64_t> all = Copy(grid.occupancy(kEverything).tiles());
    const std::vector<uint64_t> seen = Copy(grid.occupancy(height).tiles());
    const std::vector<BodyList> bodies = OnlyBodies(grid);
    if (random.OneIn(2) || checked.entries().empty())
      checked.Insert({random.Int(-200, 200), random.Int(-200, 200)}, random.Pick(checked.bodies()));
    else
      checked.Remove(static_cast<size_t>(random.Next() % checked.entries().size()));
    ASSERT_EQ(Noted(grid.occupancy(kEverything)),
              Different(all, Copy(grid.occupancy(kEverything).tiles())));
    ASSERT_EQ(Noted(grid.occupancy(height)), Different(seen, Copy(grid.occupancy(height).tiles())));
    ASSERT_EQ(Noted(grid.changed_bodies()), Different(bodies, OnlyBodies(grid)));
    grid.occupancy(kEverything).ForgetChanges();
    grid.occupancy(height).ForgetChanges();
    grid.ForgetChangedBodies();
    ASSERT_TRUE(Noted(grid.occupancy(height)).empty());
  }
}

TEST(GridChanges, AccumulateUntilTheyAreCleared) {
  Grid grid;
  const BodyId body = grid.AddBody(MakeBody(0, 1));
  DrawCell(&grid, 0, 0, body);
  EXPECT_TRUE(Noted(grid.occupancy(kEverything)).empty()) << "no sensor requested them";
  grid.TrackChanges(true);
  EXPECT_TRUE(Noted(grid.occupancy(kEverything)).empty());
  DrawCell(&grid, 1, 0, body);
  DrawCell(&grid, 8, 0, body);
  DrawCell(&grid, 100, 0, body);
  EXPECT_EQ(Noted(grid.occupancy(kEverything)).size(), 3u);
  grid.TrackChanges(false);
  EXPECT_TRUE(Noted(grid.occupancy(kEverything)).empty());
}

}  // namespace
}  // namespace Stg::internal::grid
