// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks the invariants of the grid: see Grid::Validate().

#include <algorithm>
#include <bit>
#include <string>
#include <vector>

#include "grid/grid.hh"

namespace Stg::internal::grid {

namespace {

/// Objects of an array, each with a mark that says whether it is in use.
class Users {
 public:
  explicit Users(size_t count) : used_(count, false) {}
  /// Marks an object as used. Returns false if it does not exist or is used already.
  bool Add(size_t index) {
    if (index >= used_.size() || used_[index]) return false;
    used_[index] = true;
    return true;
  }
  bool Has(size_t index) const { return index < used_.size() && used_[index]; }

 private:
  std::vector<bool> used_;
};

/// Returns a sentence such as "region 7 is not free".
std::string About(const char* thing, size_t number, const char* fault) {
  return std::string(thing) + " " + std::to_string(number) + " " + fault;
}

}  // namespace

/// Each Check function returns the first fault of one kind, or "".
class Grid::Validator {
 public:
  explicit Validator(const Grid& grid)
      : grid_(grid),
        free_bodies_(grid.bodies_.size()),
        regions_(grid.regions_.size()),
        supers_(grid.supers_.size()),
        lists_(grid.lists_.made()),
        nodes_(grid.nodes_.made()),
        outlines_(grid.outline_fragments_.made()) {}

  std::string Check() {
    for (const auto check :
         {&Validator::CheckSizes, &Validator::CheckFreeIndices, &Validator::CheckSupers,
          &Validator::CheckDirectory, &Validator::CheckRegions, &Validator::CheckBodies,
          &Validator::CheckTiles, &Validator::CheckTotals}) {
      std::string fault = (this->*check)();
      if (!fault.empty()) return fault;
    }
    return "";
  }

 private:
  std::string CheckSizes() {
    const size_t regions = grid_.regions_.size(), tiles = regions * kTilesPerRegion;
    const size_t supers = grid_.supers_.size();
    if (grid_.tiles_.size() != tiles) return "the number of tiles does not fit that of regions";
    if (grid_.outlines_.size() != 0 && grid_.outlines_.size() != tiles)
      return "the number of lists of outlines does not fit that of tiles";
    if (grid_.region_tables_.size() != supers * kRegionsPerSuper ||
        grid_.region_maps_.size() != supers * kMapsPerSuper)
      return "the number of region tables or maps does not fit that of superregions";
    if (grid_.stamps_.size() < grid_.bodies_.size()) return "some bodies have no stamp";
    for (const Layer& layer : grid_.layers_)
      if (layer.cells.tile_maps().size() != regions || layer.cells.tiles().size() != tiles)
        return "the size of a layer does not fit the number of regions";
    return "";
  }

  std::string CheckFreeIndices() {
    constexpr char kListedTwice[] = "is in the free list twice, or does not exist";
    for (const BodyId id : grid_.free_bodies_) {
      if (!free_bodies_.Add(id)) return About("body", id, kListedTwice);
      if (grid_.bodies_[id].model) return About("body", id, "is in the free list, but has a model");
    }
    for (const uint32_t region : grid_.free_regions_)
      if (region == 0 || !regions_.Add(region)) return About("region", region, kListedTwice);
    for (const uint32_t super : grid_.free_supers_)
      if (super == 0 || super >= grid_.supers_.size() || grid_.supers_[super].in_use ||
          !supers_.Add(super))
        return About("superregion", super,
                     "is in the free list twice, is in use, or does not exist");
    for (const uint32_t list : grid_.lists_.free())
      if (!lists_.Add(list)) return About("cell list", list, kListedTwice);
    for (const uint32_t node : grid_.nodes_.free())
      if (!nodes_.Add(node)) return About("node", node, kListedTwice);
    for (const uint32_t outline : grid_.outline_fragments_.free())
      if (outline == 0 || !outlines_.Add(outline)) return About("outline", outline, kListedTwice);
    return "";
  }

  std::string CheckSupers() {
    for (uint32_t super = 1; super < grid_.supers_.size(); super++) {
      const Super& of = grid_.supers_[super];
      uint32_t regions = 0;
      for (uint32_t place = 0; place < kRegionsPerSuper; place++) {
        const uint32_t region = grid_.region_tables_[super * kRegionsPerSuper + place];
        if (region == 0) continue;
        regions++;
        if (!regions_.Add(region))
          return About("region", region,
                       "is in a region table, but is free, in a second one, or does not exist");
        const Region& entry = grid_.regions_[region];
        if (entry.super != super || entry.place != place)
          return About("region", region,
                       "has another superregion or place than in the region table");
      }
      if (regions != of.regions)
        return About("superregion", super, "has a wrong number of regions");
      if (of.in_use != (regions > 0))
        return About("superregion", super, "has a wrong mark of being in use");
      if (!of.in_use && !supers_.Has(super))
        return About("superregion", super, "is neither in use nor in the free list");
    }
    for (uint32_t region = 1; region < grid_.regions_.size(); region++)
      if (!regions_.Has(region))
        return About("region", region, "is neither in use nor in the free list");
    return "";
  }

  std::string CheckDirectory() {
    const std::vector<ray_super_t>& directory = grid_.directory_;
    if (!std::has_single_bit(directory.size())) return "the directory's size is no power of two";
    const auto entries =
        std::ranges::count_if(directory, [](const ray_super_t& entry) { return entry.index != 0; });
    if (static_cast<size_t>(entries) != grid_.CountSupers())
      return "the directory does not have one entry for each superregion";
    ray_grid_t view{};
    view.directory = directory.data();
    view.directory_mask = static_cast<uint32_t>(directory.size() - 1);
    for (uint32_t super = 1; super < grid_.supers_.size(); super++) {
      const Super& of = grid_.supers_[super];
      if (of.in_use && ray_find_super(&view, of.x, of.y) != super)
        return About("superregion", super, "is not found by the directory");
    }
    return "";
  }

  std::string CheckRegions() {
    int64_t empty = 0;
    for (uint32_t region = 0; region < grid_.regions_.size(); region++) {
      uint32_t tiles = 0;
      for (uint32_t i = 0; i < kTilesPerRegion; i++)
        tiles += !grid_.IsEmpty(region * kTilesPerRegion + i);
      if (!IsUsed(region)) {
        if (tiles > 0) return About("region", region, "has filled tiles, but is not in use");
        continue;
      }
      const Region& of = grid_.regions_[region];
      empty += tiles == 0;
      if (tiles != of.tiles) return About("region", region, "has a wrong number of filled tiles");
      const uint64_t bit = uint64_t{1} << ((of.place & 7) | (of.place >> 4 & 7) << 3);
      if (((grid_.region_maps_[MapOf(of.super, of.place)] & bit) != 0) != (tiles > 0))
        return About("region", region, "has a wrong bit in the region map");
      if (!Contains(grid_.occupied_, BoxOf(of)))
        return About("region", region, "lies outside of the occupied box");
    }
    if (empty != grid_.serial_edit_.empty_regions) return "the number of empty regions is wrong";
    return "";
  }

  std::string CheckBodies() {
    for (BodyId id = 0; id < grid_.bodies_.size(); id++) {
      const Body& body = grid_.bodies_[id];
      if (body.exact() != (body.edges > 0) || body.edges > Body::kMaxEdges)
        return About("body", id, "has a wrong number of edges");
      if (body.model && body.layers != grid_.LayersOf(body))
        return About("body", id, "has wrong layers");
      if (grid_.stamps_[id] > grid_.last_stamp())
        return About("body", id, "has a stamp that was never given");
    }
    return "";
  }

  std::string CheckTiles() {
    for (uint32_t slot = 0; slot < grid_.tiles_.size(); slot++) {
      std::fill(shown_, shown_ + kMaxLayers, 0);
      std::string fault = CheckCells(slot);
      if (fault.empty()) fault = CheckOutlines(slot);
      if (fault.empty()) fault = CheckLayers(slot);
      if (!fault.empty()) return "tile " + std::to_string(slot) + ": " + fault;
    }
    return "";
  }

  /// Checks the bodies of thin outlines in a tile, and notes in which layers its cells show.
  std::string CheckCells(uint32_t slot) {
    const TileCells& tile = grid_.tiles_[slot];
    if ((tile.crowded & ~tile.cells) != 0) return "cells are crowded, but not occupied";
    if ((tile.cells == 0) != (tile.bodies == 0))
      return "there are bodies without cells, or cells without bodies";
    if ((tile.bodies & kListFlag) == 0) {
      if (tile.crowded != 0) return "cells are crowded, but there is only one body";
      if (tile.cells != 0 && !Note(tile.bodies - 1, tile.cells))
        return "its body does not exist or has no thin outline";
      return "";
    }
    const uint32_t index = tile.bodies & ~kListFlag;
    if (!lists_.Add(index)) return "its cell lists are free or used twice";
    std::string fault;
    bool only_one = true;
    BodyList first = 0;
    ForEachBit(tile.cells, [&](uint32_t bit) {
      const BodyList list = grid_.lists_[index][bit];
      if (fault.empty()) fault = CheckList(list, tile.crowded >> bit & 1, uint64_t{1} << bit);
      if (first == 0) first = list;
      only_one = only_one && list == first;
    });
    if (fault.empty() && only_one && tile.crowded == 0) return "its cell lists have only one body";
    return fault;
  }

  std::string CheckList(BodyList list, bool crowded, uint64_t cell) {
    if (crowded != ((list & kListFlag) != 0)) return "a cell has a wrong mark of being crowded";
    if (!crowded)
      return list != 0 && Note(list - 1, cell)
                 ? ""
                 : "the body of a cell does not exist or has no thin outline";
    const uint32_t first = list & ~kListFlag;
    uint32_t node = first, previous = first;
    uint64_t stamp = 0;
    size_t count = 0;
    do {
      if (!nodes_.Add(node)) return "a node is free or used twice";
      const Node& entry = grid_.nodes_[node];
      if (count > 0 && entry.previous != previous) return "the links of a list do not agree";
      if (!Note(entry.id, cell)) return "a body in a list does not exist or has no thin outline";
      if (count > 0 && grid_.stamps_[entry.id] <= stamp)
        return "a list is not in the order of stamps";
      stamp = grid_.stamps_[entry.id];
      previous = node;
      node = entry.next;
      count++;
    } while (node != first);
    if (grid_.nodes_[first].previous != previous) return "the ends of a list do not agree";
    return count > 1 ? "" : "a list has only one body";
  }

  /// Checks the exact outlines in a tile, and notes in which layers its cells show.
  std::string CheckOutlines(uint32_t slot) {
    std::vector<BodyId> seen;
    for (OutlineList list = grid_.OutlinesIn(slot); list != 0;) {
      if (!outlines_.Add(list)) return "an outline is free or used twice";
      const OutlineFragment& set = grid_.outline_fragments_[list];
      if (set.id >= grid_.bodies_.size() || free_bodies_.Has(set.id) ||
          !grid_.bodies_[set.id].exact())
        return "an outline belongs to no exact body";
      const Body& body = grid_.bodies_[set.id];
      if (std::ranges::count(seen, set.id) > 0) return "a body has two outlines";
      seen.push_back(set.id);
      if (set.cells == 0 || set.edges >> (body.edges - 1) >> 1 != 0)
        return "an outline has no cells, or edges that do not exist";
      Show(body, set.cells);
      list = set.next;
    }
    return "";
  }

  std::string CheckLayers(uint32_t slot) const {
    for (LayerIndex i = 0; i < grid_.layers_.size(); i++) {
      const Occupancy& cells = grid_.layers_[i].cells;
      if (cells.tiles()[slot] != shown_[i]) return About("layer", i, "has wrong cells");
      const uint64_t map = cells.tile_maps()[slot / kTilesPerRegion];
      if ((map >> slot % kTilesPerRegion & 1) != (shown_[i] != 0))
        return About("layer", i, "has a wrong bit in its tile map");
    }
    return "";
  }

  std::string CheckTotals() {
    if (rasterized_cells_ + grid_.pretended_cells_ != grid_.rasterized_cells())
      return "the number of rasterized cells is wrong";
    if (!grid_.LiesInExtent()) return "some cells lie outside of the extent";
    return "";
  }

  /// Notes cells of a body with a thin outline. Returns false if there is no such body.
  bool Note(BodyId id, uint64_t cells) {
    if (id >= grid_.bodies_.size() || free_bodies_.Has(id) || grid_.bodies_[id].exact())
      return false;
    rasterized_cells_ += std::popcount(cells);
    Show(grid_.bodies_[id], cells);
    return true;
  }
  void Show(const Body& body, uint64_t cells) {
    ForEachBit(body.layers, [&](uint32_t layer) { shown_[layer] |= cells; });
  }

  bool IsUsed(uint32_t region) const {
    const Region& of = grid_.regions_[region];
    return region != 0 && grid_.region_tables_[of.super * kRegionsPerSuper + of.place] == region;
  }
  /// The cells of a region.
  CellBox BoxOf(const Region& region) const {
    const Super& super = grid_.supers_[region.super];
    const int32_t x = (super.x * 16 + static_cast<int32_t>(region.place & 15)) * 64;
    const int32_t y = (super.y * 16 + static_cast<int32_t>(region.place >> 4)) * 64;
    return {x, y, x + 63, y + 63};
  }
  static bool Contains(const CellBox& outer, const CellBox& inner) {
    return outer.min_x <= inner.min_x && outer.min_y <= inner.min_y && outer.max_x >= inner.max_x &&
           outer.max_y >= inner.max_y;
  }

  const Grid& grid_;
  // Objects that are free or were found in use.
  Users free_bodies_, regions_, supers_, lists_, nodes_, outlines_;
  uint64_t shown_[kMaxLayers] = {};  // for one tile: the cells that each layer should show
  int64_t rasterized_cells_ = 0;
};

std::string Grid::Validate() const { return Validator(*this).Check(); }

}  // namespace Stg::internal::grid
