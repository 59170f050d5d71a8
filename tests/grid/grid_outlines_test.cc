// SPDX-License-Identifier: GPL-2.0-or-later
//
// Compares the grid's exact rasterization with a map from tiles to their content.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "grid/grid.hh"
#include "support/random_source.hh"

namespace Stg::internal::grid {
namespace {

using test::RandomSource;
using Tile = std::pair<int32_t, int32_t>;

/// Bodies need a model pointer that is not null, exact ones a corner; neither is dereferenced.
Body MakeBody(RandomSource* random, bool exact) {
  static int somewhere;
  static const point_t corner;
  Body body;
  body.z_min = random->Int(0, 3);
  body.z_max = random->Int(3, 6);
  body.model = reinterpret_cast<Model*>(&somewhere);
  body.ranger_visible = !random->OneIn(4);
  if (exact) body.corners = &corner;
  if (exact) body.edges = Body::kMaxEdges;
  return body;
}

/// A grid with bodies of both kinds of rasterization, and the cells of each.
class Checked {
 public:
  explicit Checked(RandomSource* random) : random_(*random) {}

  void AddBody(bool exact) { drawn_[grid_.AddBody(MakeBody(&random_, exact))] = {exact, {}}; }
  Grid& grid() { return grid_; }
  void Use(Grid grid) { grid_.AssignCopy(grid); }

  /// Rasterizes a random body again: far away, nearby, or nowhere.
  void RedrawOne() {
    auto [id, drawn] = Pick();
    std::vector<CellSet> sets;
    if (!random_.OneIn(10)) {
      CellSetBuilder maker(&sets);
      const int32_t x = random_.Int(-30, 30), y = random_.Int(-30, 30);
      for (int rows = random_.Int(1, 20); rows > 0; rows--) {
        const int32_t first = x + random_.Int(0, 9), last = first + random_.Int(-1, 20);
        maker.AddRow(y + rows, first, last, 1u << random_.Int(0, 31));
      }
      maker.Finish();
    }
    grid_.Rasterize(id, drawn->sets, sets);
    drawn->sets = sets;
  }
  void ChangeOne() {
    auto [id, drawn] = Pick();
    grid_.ChangeBody(id, MakeBody(&random_, drawn->exact), drawn->sets);
  }
  void EraseAll() {
    for (auto& [id, drawn] : drawn_) {
      grid_.Rasterize(id, drawn.sets, {});
      drawn.sets.clear();
    }
  }

  void Verify() const {
    std::map<Tile, std::map<BodyId, std::pair<uint64_t, uint32_t>>> outlines;
    std::map<Tile, uint64_t> tiles;
    for (const auto& [id, drawn] : drawn_)
      for (const CellSet& set : drawn.sets) {
        tiles[{set.x, set.y}] |= set.cells;
        if (drawn.exact) outlines[{set.x, set.y}][id] = {set.cells, set.edges};
      }
    for (const auto& [tile, cells] : tiles) {
      std::map<BodyId, std::pair<uint64_t, uint32_t>> found;
      grid_.ForEachOutline(grid_.OutlinesIn(SlotOf(tile)), [&](const OutlineFragment& set) {
        ASSERT_TRUE(found.emplace(set.id, std::pair(set.cells, set.edges)).second);
      });
      ASSERT_EQ(found, outlines[tile]);
    }
    ASSERT_EQ(grid_.statistics().tiles, tiles.size());
    for (LayerIndex layer = 0; layer < grid_.layer_count(); layer++) VerifyLayer(layer);
  }

 private:
  struct Drawn {
    bool exact;
    std::vector<CellSet> sets;
  };
  std::pair<BodyId, Drawn*> Pick() {
    auto& [id, drawn] =
        *std::next(drawn_.begin(), random_.Int(0, static_cast<int>(drawn_.size()) - 1));
    return {id, &drawn};
  }
  uint32_t SlotOf(const Tile& tile) const {
    return grid_.FindTileSlot({.x = tile.first, .y = tile.second});
  }

  /// The layer must show exactly the cells of the bodies that belong to it.
  void VerifyLayer(LayerIndex layer) const {
    std::map<uint32_t, uint64_t> expected;
    for (const auto& [id, drawn] : drawn_)
      if ((grid_.body(id).layers >> layer & 1) != 0)
        for (const CellSet& set : drawn.sets) expected[SlotOf({set.x, set.y})] |= set.cells;
    const std::span<const uint64_t> words = grid_.occupancy(layer).tiles();
    for (uint32_t slot = 0; slot < words.size(); slot++) {
      const auto found = expected.find(slot);
      ASSERT_EQ(words[slot], found == expected.end() ? 0 : found->second) << "layer " << layer;
    }
  }

  RandomSource& random_;
  Grid grid_;
  std::map<BodyId, Drawn> drawn_;
};

TEST(GridOutlines, RandomChangesKeepListsAndLayersRight) {
  for (uint64_t seed = 1; seed <= 6; seed++) {
    RandomSource random(seed);
    Checked checked(&random);
    for (int i = 0; i < 12; i++) checked.AddBody(i % 3 != 0);
    for (int step = 0; step < 1500; step++) {
      if (step == 200) checked.grid().RangerLayer(3, true, true);
      if (step == 300) checked.grid().RangerLayer(3, true, false);
      if (step == 400) checked.grid().EverythingLayer(true);
      if (step == 500) checked.grid().RangerLayer(0, false, true);
      if (step % 400 == 399) {  // continue with a copy
        Grid shared(checked.grid());
        shared.Freeze();
        checked.Use(shared);
      }
      if (random.OneIn(8))
        checked.ChangeOne();
      else
        checked.RedrawOne();
      if (step % 25 == 0) {
        ASSERT_NO_FATAL_FAILURE(checked.Verify()) << "seed " << seed << " step " << step;
      }
    }
    checked.EraseAll();
    ASSERT_NO_FATAL_FAILURE(checked.Verify());
    EXPECT_EQ(checked.grid().statistics().tiles, 0u);
  }
}

TEST(GridOutlines, RowsHaveAllTheirCells) {
  RandomSource random(5);
  for (int round = 0; round < 2000; round++) {
    std::vector<CellSet> rows, cells;
    CellSetBuilder by_row(&rows), by_cell(&cells);
    for (int i = random.Int(1, 6); i > 0; i--) {
      const int32_t y = random.Int(-20, 20), first = random.Int(-20, 20);
      const int32_t last = first + random.Int(-1, 30);
      by_row.AddRow(y, first, last, 1);
      for (int32_t x = first; x <= last; x++) by_cell.Add(x, y);
    }
    by_row.Finish();
    by_cell.Finish();
    ASSERT_EQ(rows.size(), cells.size());
    for (size_t i = 0; i < rows.size(); i++) {
      ASSERT_TRUE(rows[i].SameTile(cells[i]));
      ASSERT_EQ(rows[i].cells, cells[i].cells);
      ASSERT_EQ(rows[i].edges, 1u);
    }
  }
}

}  // namespace
}  // namespace Stg::internal::grid
