// SPDX-License-Identifier: GPL-2.0-or-later
//
// Grid::Validate() finds each kind of corruption, and assertions stop typical mistakes where they
// are made.

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "grid/grid.hh"
#include "support/draw_cells.hh"
#include "support/failed_assertions.hh"
#include "support/random_source.hh"

namespace Stg::internal::grid {

/// Gives these tests access to the parts of a grid, to corrupt them.
class GridTamperer {
 public:
  explicit GridTamperer(Grid* grid) : grid_(*grid) {}

  Grid::TileCells& Tile(uint32_t slot) { return grid_.tiles_[slot]; }
  BodyList& ListOf(uint32_t slot, uint32_t bit) {
    return grid_.lists_[Tile(slot).bodies & ~Grid::kListFlag][bit];
  }
  Grid::Node& FirstNode(uint32_t slot, uint32_t bit) {
    return grid_.nodes_[ListOf(slot, bit) & ~Grid::kListFlag];
  }
  OutlineFragment& Outline(uint32_t slot) {
    return grid_.outline_fragments_[grid_.outlines_[slot]];
  }
  Body& BodyOf(BodyId id) { return grid_.bodies_[id]; }
  uint64_t& StampOf(BodyId id) { return grid_.stamps_[id]; }
  Grid::Region& RegionOf(uint32_t slot) { return grid_.regions_[slot / kTilesPerRegion]; }
  Grid::Super& SuperOf(uint32_t slot) { return grid_.supers_[RegionOf(slot).super]; }
  uint64_t& RegionMap(uint32_t slot) {
    return grid_.region_maps_[grid_.RegionMapOf(slot / kTilesPerRegion)];
  }
  CellBox& Occupied() { return grid_.occupied_; }
  Grid::Edit& OwnEdit() { return grid_.serial_edit_; }
  int64_t& RasterizedCells() { return grid_.serial_edit_.rasterized_cells; }
  int64_t& EmptyRegions() { return grid_.serial_edit_.empty_regions; }
  CellBox& Extent() { return grid_.serial_edit_.extent; }
  std::vector<ray_super_t>& Directory() { return grid_.directory_; }
  std::vector<BodyId>& FreeBodies() { return grid_.free_bodies_; }
  std::vector<uint32_t>& FreeRegions() { return grid_.free_regions_; }
  /// Frees the node or the cell lists although they are in use.
  void FreeNode(uint32_t slot, uint32_t bit) {
    grid_.nodes_.Give(ListOf(slot, bit) & ~Grid::kListFlag);
  }
  void FreeLists(uint32_t slot) { grid_.lists_.Give(Tile(slot).bodies & ~Grid::kListFlag); }
  void FreeOutline(uint32_t slot) { grid_.outline_fragments_.Give(grid_.outlines_[slot]); }
  /// Sets a bit of a layer's tile map without changing the tile.
  void FlipTileMap(LayerIndex layer, uint32_t slot) {
    const auto& maps = grid_.layers_[layer].cells.tile_maps();
    const_cast<uint64_t&>(maps[slot / kTilesPerRegion]) ^= uint64_t{1} << slot % kTilesPerRegion;
  }

 private:
  Grid& grid_;
};

namespace {

Model* SomeModel() {
  static int somewhere;
  return reinterpret_cast<Model*>(&somewhere);
}

const point_t kCorners[] = {point_t(0, 0), point_t(1, 0)};

Body MakeBody(bool exact = false) {
  Body body;
  body.z_max = 1;
  body.model = SomeModel();
  if (!exact) return body;
  body.corners = kCorners;
  body.edges = 1;
  return body;
}

std::vector<CellSet> Row(int32_t x, int32_t y, int32_t length, uint32_t edges = 0) {
  std::vector<CellSet> sets;
  CellSetBuilder maker(&sets);
  maker.AddRow(y, x, x + length - 1, edges);
  maker.Finish();
  return sets;
}

/// A grid with two bodies that share cell 0 of a tile (one of them also has cell 1), a third body
/// alone in another tile, an exact outline, a removed body, and layers for rangers.
struct Example {
  Grid grid;
  BodyId older, newer, alone, exact, removed;
  uint32_t shared_slot, alone_slot;

  Example() {
    older = grid.AddBody(MakeBody());
    newer = grid.AddBody(MakeBody());
    alone = grid.AddBody(MakeBody());
    exact = grid.AddBody(MakeBody(true));
    removed = grid.AddBody(MakeBody());
    grid.RangerLayer(0.5, true);
    grid.RangerLayer(0.5, true, true);
    grid.EverythingLayer(true);
    std::vector<CellSet> one = Row(0, 0, 1), two = Row(0, 0, 2), far = Row(200, 100, 5);
    std::vector<CellSet> outline = Row(0, 0, 3, 1);
    grid.Rasterize(older, {}, one);
    grid.Rasterize(newer, {}, two);
    grid.Rasterize(alone, {}, far);
    grid.Rasterize(exact, {}, outline);
    grid.RemoveBody(removed);
    shared_slot = one[0].slot;
    alone_slot = far[0].slot;
  }
};

struct Corruption {
  std::string name;
  std::function<void(GridTamperer*, const Example&)> make;
  std::string fault;  ///< part of the result of Validate()
};

std::vector<Corruption> AllCorruptions() {
  using T = GridTamperer;
  return {
      {"cells cleared", [](T* t, const Example& e) { t->Tile(e.alone_slot).cells = 0; },
       "has a wrong number of filled tiles"},
      {"a cell set", [](T* t, const Example& e) { t->Tile(e.alone_slot).cells |= 1 << 30; },
       "layer 0 has wrong cells"},
      {"another body in a tile", [](T* t, const Example& e) { t->Tile(e.alone_slot).bodies = 99; },
       "its body does not exist"},
      {"a removed body in a tile",
       [](T* t, const Example& e) { t->Tile(e.alone_slot).bodies = e.removed + 1; },
       "its body does not exist"},
      {"an exact body in a list",
       [](T* t, const Example& e) { t->ListOf(e.shared_slot, 1) = e.exact + 1; },
       "the body of a cell does not exist"},
      {"a tile without its body", [](T* t, const Example& e) { t->Tile(e.alone_slot).bodies = 0; },
       "there are bodies without cells"},
      {"crowded bit cleared", [](T* t, const Example& e) { t->Tile(e.shared_slot).crowded = 0; },
       "a cell has a wrong mark of being crowded"},
      {"crowded bit set", [](T* t, const Example& e) { t->Tile(e.alone_slot).crowded = 1 << 30; },
       "cells are crowded, but not occupied"},
      {"crowded cell of one body",
       [](T* t, const Example& e) { t->Tile(e.alone_slot).crowded = t->Tile(e.alone_slot).cells; },
       "cells are crowded, but there is only one body"},
      {"cell lists freed", [](T* t, const Example& e) { t->FreeLists(e.shared_slot); },
       "its cell lists are free or used twice"},
      {"a node freed", [](T* t, const Example& e) { t->FreeNode(e.shared_slot, 0); },
       "a node is free or used twice"},
      {"a node of another body",
       [](T* t, const Example& e) { t->FirstNode(e.shared_slot, 0).id = 77; },
       "a body in a list does not exist"},
      {"a ring of one node",
       [](T* t, const Example& e) {
         auto& node = t->FirstNode(e.shared_slot, 0);
         node.next = node.previous = t->ListOf(e.shared_slot, 0) & ~Grid::kListFlag;
       },
       "a list has only one body"},
      {"a link back", [](T* t, const Example& e) { t->FirstNode(e.shared_slot, 0).previous = 99; },
       " of a list do not agree"},
      {"order reversed",
       [](T* t, const Example& e) { std::swap(t->StampOf(e.older), t->StampOf(e.newer)); },
       "a list is not in the order of stamps"},
      {"a stamp of the future", [](T* t, const Example& e) { t->StampOf(e.newer) = 1000; },
       "has a stamp that was never given"},
      {"layers of a body", [](T* t, const Example& e) { t->BodyOf(e.alone).layers = 0; },
       "has wrong layers"},
      {"too many edges", [](T* t, const Example& e) { t->BodyOf(e.exact).edges = 33; },
       "has a wrong number of edges"},
      {"a bit in a tile map", [](T* t, const Example& e) { t->FlipTileMap(0, e.alone_slot + 1); },
       "layer 0 has a wrong bit in its tile map"},
      {"cells of an outline", [](T* t, const Example& e) { t->Outline(e.shared_slot).cells |= 8; },
       "has wrong cells"},
      {"no cells of an outline",
       [](T* t, const Example& e) { t->Outline(e.shared_slot).cells = 0; },
       "an outline has no cells"},
      {"an outline of a thin body",
       [](T* t, const Example& e) { t->Outline(e.shared_slot).id = e.alone; },
       "an outline belongs to no exact body"},
      {"an edge that is none", [](T* t, const Example& e) { t->Outline(e.shared_slot).edges = 2; },
       "an outline has no cells, or edges that do not exist"},
      {"an outline freed", [](T* t, const Example& e) { t->FreeOutline(e.shared_slot); },
       "an outline is free or used twice"},
      {"a live body freed", [](T* t, const Example& e) { t->FreeBodies().push_back(e.alone); },
       "is in the free list, but has a model"},
      {"a body freed twice", [](T* t, const Example& e) { t->FreeBodies().push_back(e.removed); },
       "is in the free list twice"},
      {"a region freed",
       [](T* t, const Example& e) { t->FreeRegions().push_back(e.alone_slot / kTilesPerRegion); },
       "is in a region table, but is free"},
      {"place of a region", [](T* t, const Example& e) { t->RegionOf(e.alone_slot).place++; },
       "has another superregion or place"},
      {"tiles of a region", [](T* t, const Example& e) { t->RegionOf(e.alone_slot).tiles++; },
       "has a wrong number of filled tiles"},
      {"a region map", [](T* t, const Example& e) { t->RegionMap(e.alone_slot) = 0; },
       "has a wrong bit in the region map"},
      {"regions of a superregion",
       [](T* t, const Example& e) { t->SuperOf(e.alone_slot).regions++; },
       "has a wrong number of regions"},
      {"use of a superregion",
       [](T* t, const Example& e) { t->SuperOf(e.alone_slot).in_use = false; },
       "has a wrong mark of being in use"},
      {"place of a superregion", [](T* t, const Example& e) { t->SuperOf(e.alone_slot).x += 5; },
       "is not found by the directory"},
      {"the directory emptied",
       [](T* t, const Example&) {
         for (ray_super_t& entry : t->Directory()) entry.index = 0;
       },
       "the directory does not have one entry for each superregion"},
      {"size of the directory", [](T* t, const Example&) { t->Directory().push_back({}); },
       "the directory's size is no power of two"},
      {"the occupied box", [](T* t, const Example&) { t->Occupied().max_x = 10; },
       "lies outside of the occupied box"},
      {"number of cells", [](T* t, const Example&) { t->RasterizedCells()--; },
       "the number of rasterized cells is wrong"},
      {"number of empty regions", [](T* t, const Example&) { t->EmptyRegions()++; },
       "the number of empty regions is wrong"},
      {"the extent", [](T* t, const Example&) { t->Extent() = CellBox(); },
       "some cells lie outside of the extent"},
  };
}

TEST(GridValidateTest, FindsNoFaultInAGoodGrid) {
  EXPECT_EQ(Grid().Validate(), "");
  EXPECT_EQ(Example().grid.Validate(), "");
}

TEST(GridValidateTest, FindsEachKindOfCorruption) {
  for (const Corruption& corruption : AllCorruptions()) {
    Example example;
    GridTamperer tamperer(&example.grid);
    const test::FailedAssertions ignored;  // of the corruption itself
    corruption.make(&tamperer, example);
    EXPECT_NE(example.grid.Validate().find(corruption.fault), std::string::npos)
        << corruption.name << ": \"" << example.grid.Validate() << '"';
  }
}

TEST(GridValidateTest, FindsNoFaultWhileRandomBodiesMove) {
  test::RandomSource random(1);
  Grid grid;
  struct Drawn {
    BodyId id;
    std::vector<CellSet> sets;
  };
  std::vector<Drawn> drawn;
  for (int i = 0; i < 300; i++) {
    const bool exact = random.OneIn(3);
    if (drawn.size() < 20) drawn.push_back({grid.AddBody(MakeBody(exact)), {}});
    Drawn& body = drawn[static_cast<size_t>(random.Int(0, static_cast<int>(drawn.size()) - 1))];
    std::vector<CellSet> to;
    const int reach = random.OneIn(4) ? 3000 : 20;
    if (!random.OneIn(4))
      to = Row(random.Int(-reach, reach), random.Int(-reach, reach), random.Int(1, 20),
               grid.body(body.id).exact());
    grid.Rasterize(body.id, body.sets, to);
    body.sets = to;
    if (random.OneIn(20)) grid.RangerLayer(random.Real(0, 2), true, random.OneIn(2));
    if (random.OneIn(10) && body.sets.empty()) {
      grid.RemoveBody(body.id);
      std::swap(body, drawn.back());
      drawn.pop_back();
    }
    grid.ExpireLayers();
    ASSERT_EQ(grid.Validate(), "") << "after change " << i;
    if (i % 30 == 0) {
      ASSERT_EQ(Grid(grid).Validate(), "") << "of a copy after change " << i;
    }
  }
}

// Typical mistakes in code that uses the grid, or changes it. In builds with assertions they are
// noticed where they happen, in others by Validate().

TEST(GridMistakesTest, ABodyIsRemovedWithoutErasingItsCells) {
  Example example;
  const test::FailedAssertions failed;
  example.grid.RemoveBody(example.alone);
  EXPECT_NE(example.grid.Validate().find("its body does not exist"), std::string::npos);
  const BodyId reused = example.grid.AddBody(MakeBody());  // gets the same index
  ASSERT_EQ(reused, example.alone);
  std::vector<CellSet> there = Row(200, 100, 5);
  example.grid.Rasterize(reused, {}, there);
  if (test::kAssertions) {
    EXPECT_NE(failed.Text().find("libstage/grid/grid.cc"), std::string::npos) << failed.Text();
    EXPECT_NE(failed.Text().find("tile.bodies != id + 1"), std::string::npos) << failed.Text();
  }
}

TEST(GridMistakesTest, ABitOfATileMapIsOffByOne) {
  Example example;
  GridTamperer(&example.grid).FlipTileMap(kEverything, example.alone_slot);
  GridTamperer(&example.grid).FlipTileMap(kEverything, example.alone_slot + 1);
  EXPECT_NE(example.grid.Validate().find("has a wrong bit in its tile map"), std::string::npos);
  const test::FailedAssertions failed;
  std::vector<CellSet> from = Row(200, 100, 5);
  from[0].slot = example.alone_slot;
  example.grid.Rasterize(example.alone, from, {});
  if (test::kAssertions) {
    EXPECT_NE(failed.Text().find("libstage/grid/occupancy.cc"), std::string::npos) << failed.Text();
  }
}

TEST(GridMistakesTest, MovesThatShareATileAreMadeInTheWrongOrder) {
  Example example;
  Grid& grid = example.grid;
  const BodyId first = grid.AddBody(MakeBody()), second = grid.AddBody(MakeBody());
  std::vector<CellSet> cell = Row(0, 0, 1);
  grid.MakeSlots(cell);
  std::vector<Grid::Edit> edits(2);
  const test::FailedAssertions failed;
  grid.BeginConcurrentEdit({.sets = 2, .cells = 2, .bodies = 2}, &edits);
  edits[1].SetNextStamp(1);
  grid.Rasterize(second, {}, cell, &edits[1]);
  edits[0].SetNextStamp(0);
  grid.Rasterize(first, {}, cell, &edits[0]);
  grid.EndConcurrentEdit(&edits);
  EXPECT_NE(grid.Validate().find("a list is not in the order of stamps"), std::string::npos);
  if (test::kAssertions) {
    EXPECT_NE(failed.Text().find("stamps_[LastOf(*list)] < stamps_[id]"), std::string::npos)
        << failed.Text();
  }
}

}  // namespace
}  // namespace Stg::internal::grid
