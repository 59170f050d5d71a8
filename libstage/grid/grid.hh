// SPDX-License-Identifier: GPL-2.0-or-later
//
// The occupancy grid: which bodies lie in which cells.
//
// Cells are square, 1 / cells_per_metre wide; the cell of a point is the floor of its coordinates
// in cells. 8 x 8 cells are a tile, 8 x 8 tiles a region, 16 x 16 regions a superregion. Regions
// and superregions are made where geometry is, and dropped some time after they have become empty,
// so that memory grows with what is in the world and not with its extent. The cells that may be
// used are those within +-kMaxCell.

#ifndef STAGE_GRID_GRID_HH
#define STAGE_GRID_GRID_HH

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/occupancy.hh"
#include "grid/paged_array.hh"
#include "grid/pool.hh"
#include "grid/tile_part.hh"
#include "kernels/ray_walk.h"

namespace Stg {
class Model;
}

namespace Stg::internal::grid {

/// Bodies further out than this many cells are not drawn and rays from there hit nothing.
inline constexpr int32_t kMaxCell = 1 << 30;

/// Which cells are occupied is kept in layers, so that a ray meets only what it may stop at:
/// everything; and, as they are asked for, what rangers can see at any height or at one height.
/// Bodies may be drawn twice: by thin outlines, and for the exact ray model in every cell that
/// their outline touches. Each layer shows one of these drawings. Of thin outlines is known which
/// bodies lie in each cell, of the others which lie in each tile (grid_outlines.cc).
using LayerIndex = uint32_t;
inline constexpr LayerIndex kEverything = 0;  ///< of the thin outlines
inline constexpr LayerIndex kNoLayer = 0xffffffffu;
inline constexpr uint32_t kMaxHeights = 8;  ///< of each drawing
inline constexpr uint32_t kMaxLayers = 2 * (kMaxHeights + 3);

/// A body that is drawn in the grid: one block of a model, or, in the exact drawing, a few
/// consecutive edges of a block.
struct Body {
  double z_min = 0, z_max = 0;  ///< global height interval, metres
  Model* model = nullptr;
  const void* tree = nullptr;  ///< the topmost ancestor of the model: equal for related models
  bool ranger_visible = true;  ///< false: no ranger can see it, leave it out of their layers
  bool drives = false;         ///< its tree is that of a robot: layers of the map leave it out
  /// Exact drawing: edges + 1 corners, global, metres; they stay where they are. Else null.
  const point_t* corners = nullptr;
  uint32_t edges = 0;   ///< at most kMaxEdges
  uint32_t number = 0;  ///< of those that a ray meets at the same place, it stops at the smallest
  double x = 0, y = 0, radius = 0;  ///< a circle that holds them
  uint32_t layers = 0;              ///< bit i: it is drawn in layer i. Kept by the grid

  bool exact() const { return corners != nullptr; }
  static constexpr uint32_t kMaxEdges = 32;
};
using BodyId = uint32_t;

/// What is drawn of an exact outline in a tile.
struct OutlinePart {
  uint64_t cells;  ///< as TilePart has them
  BodyId id;
  uint32_t edges;  ///< as TilePart has them
  uint32_t next;   ///< the next part in the same tile, 0: it is the last
};
/// The parts in a tile: the number of the first, 0 if there is none. Valid until the grid changes.
using OutlineList = uint32_t;

/// A cell that something is drawn in: a handle that is valid as long as that is so.
using CellRef = uint64_t;
inline CellRef CellOf(uint32_t slot, uint32_t bit) { return CellRef{slot} << 6 | bit; }

/// The bodies in a cell: a handle that is valid until the grid changes. 0: nobody.
using BodyList = uint32_t;

/// Calls f(CellRef) for the cells of a part, which is drawn.
template <typename F>
void ForEachCell(const TilePart& part, F f) {
  ForEachBit(part.cells, [&](uint32_t bit) { f(CellOf(part.slot, bit)); });
}

/// What several bodies are drawn in: the parts of each.
struct Drawings {
  std::vector<const std::vector<TilePart>*> of_bodies;

  /// Calls f(const TilePart&) for all of them.
  template <typename F>
  void ForEachPart(F f) const {
    for (const std::vector<TilePart>* parts : of_bodies)
      for (const TilePart& part : *parts) f(part);
  }
  /// Calls f(CellRef) for all cells.
  template <typename F>
  void ForEachCell(F f) const {
    ForEachPart([&](const TilePart& part) { grid::ForEachCell(part, f); });
  }
};

struct CellBox {
  int32_t min_x = 0, min_y = 0, max_x = -1, max_y = -1;  ///< inclusive; empty if min > max
  bool empty() const { return min_x > max_x; }
};

class Grid {
 public:
  Grid();
  Grid(const Grid&) = default;
  /// From now on copies share the pages that neither changes, and this one is not changed any more.
  void MakeShareable();
  /// Becomes a copy of the other: bodies get its numbers, and their models those that it has.
  /// Nothing must have been drawn yet.
  void Become(const Grid& other);

  BodyId AddBody(const Body& body);
  void RemoveBody(BodyId id);  ///< it must not be in any cell
  /// Changes what is known of a body. `drawn` are the cells that it is drawn in.
  void ChangeBody(BodyId id, const Body& body, std::span<const TilePart> drawn);
  const Body& body(BodyId id) const { return bodies_[id]; }
  std::size_t body_count() const { return bodies_.size(); }  ///< ids are below

  /// The data of one thread while several change cells at once, see BeginSharedEdit(). Each has
  /// cache lines of its own, as it is written to all the time.
  class alignas(64) Edit {
    friend class Grid;
    bool shared = false;
    PoolShare own_lists, own_nodes, own_outlines;
    int64_t drawn_cells = 0, empty_regions = 0;  // more than before
    uint64_t first_drawing = 0, drawings = 0;    // numbers, see Stamp()
    CellBox extent;                              // what this edit adds to Grid::extent()

   public:
    /// In a shared edit: the next bodies that it redraws count as drawn behind those of which there
    /// are so many since the edit began.
    void Follow(uint64_t bodies) { drawings = first_drawing + bodies; }

   private:
    PoolShare* lists() { return shared ? &own_lists : nullptr; }
    PoolShare* nodes() { return shared ? &own_nodes : nullptr; }
    PoolShare* outlines() { return shared ? &own_outlines : nullptr; }
  };

  /// Takes a body out of the cells of `from`, which it is drawn in, and draws it in those of `to`.
  /// It becomes the last in the lists of these cells. Either may be empty; both are in order, with
  /// each tile once. Fills in the slots of `to`, except in a shared edit, where they must be there;
  /// those of an exact drawing it finds there if their regions exist.
  void Redraw(BodyId id, std::span<const TilePart> from, std::span<TilePart> to,
              Edit* edit = nullptr);

  /// Tells when a body was drawn: the lists of cells are in the order of these numbers.
  uint64_t Stamp(BodyId id) const { return stamps_[id]; }
  /// The greatest ever given.
  uint64_t last_stamp() const { return own_edit_.drawings; }
  /// Draws a body last, without drawing it: it becomes the last in the lists of `parts`.
  void MoveToEnd(BodyId id, std::span<const TilePart> parts) {
    Restamp(id, ++own_edit_.drawings, parts);
  }
  /// Moves a body to where it belongs in the lists of `parts`, in which it is drawn, with this
  /// stamp.
  void Restamp(BodyId id, uint64_t stamp, std::span<const TilePart> parts);

  /// From here to EndSharedEdit() several threads may redraw, change and read bodies at once, each
  /// with an edit of its own. No two of them may use cells of the same tile at once. All parts that
  /// bodies are drawn into must have their slots; `most` is what is drawn at most. Nothing else may
  /// change.
  struct EditSize {
    std::size_t parts = 0, cells = 0;  ///< of thin outlines; all parts together have so many cells
    std::size_t exact_parts = 0;
    uint64_t bodies = 0;  ///< that are redrawn
  };
  void BeginSharedEdit(const EditSize& most, std::vector<Edit>* edits);
  void EndSharedEdit(std::vector<Edit>* edits);
  /// Fills in the slots of the parts; 0 for those whose region does not exist. True if all regions
  /// do. Slots are good until regions are dropped, which may happen whenever bodies are redrawn
  /// without an edit, and when a shared edit ends.
  bool FindSlots(std::span<TilePart> parts) const;
  /// The same, and makes the regions that are missing.
  void MakeSlots(std::span<TilePart> parts);
  /// Tells whether all tiles of the rectangle, in tiles, have regions, and makes these.
  bool HasRegions(const CellBox& tiles) const;
  void MakeRegions(const CellBox& tiles);

  /// What is drawn in a tile with thin outlines: mostly a single body. The same size everywhere:
  /// i386 would put numbers of 64 bits at any multiple of 4.
  struct alignas(8) TileCells {
    uint64_t cells;    ///< that something is drawn in
    uint64_t crowded;  ///< those with several bodies
    uint32_t bodies;   ///< 0, id + 1 of the only one, or kSeveral | number of its CellLists
  };
  /// The lists of a tile with several bodies, for those of its cells that something is drawn in: id
  /// + 1 (one body), or kSeveral | index of the first of several nodes. These form a ring, in the
  /// order of drawing.
  using CellLists = std::array<BodyList, 64>;
  static constexpr uint32_t kSeveral = 0x80000000u;

  /// The arrays that ListIn() reads, for code that looks up the lists of many cells at once.
  struct Tables {
    const TileCells* tiles;  ///< by slot: region * 64 + tile in the region
    const CellLists* lists;
    const OutlineList* outlines;  ///< by slot; null if nothing was ever drawn exactly
  };
  Tables tables() const { return {tiles_.data(), lists_.data(), outlines_.data()}; }

  /// The exact outlines in a tile, in no particular order.
  OutlineList OutlinesIn(uint32_t slot) const { return outlines_.size() > 0 ? outlines_[slot] : 0; }
  const OutlinePart& outline(OutlineList list) const { return outline_parts_[list]; }
  /// Fetches the first part into the cache.
  void PrefetchOutline(OutlineList list) const { __builtin_prefetch(&outline_parts_[list]); }
  /// Calls f(const OutlinePart&) for the parts in a tile.
  template <typename F>
  void ForEachOutline(OutlineList list, F f) const {
    for (; list != 0; list = outline_parts_[list].next) f(outline_parts_[list]);
  }

  /// Calls f(BodyId) for the bodies in a cell, in the order of drawing, until f returns true.
  /// Returns whether it did.
  template <typename F>
  bool AnyIn(CellRef cell, F f) const {
    return AnyOf(ListIn(cell), f);
  }
  template <typename F>
  bool AnyAt(uint32_t region, uint32_t tile, uint32_t bit, F f) const {
    return AnyIn(CellAt(region, tile, bit), f);
  }
  BodyList ListIn(CellRef cell) const {
    const TileCells& tile = tiles_[static_cast<std::size_t>(cell >> 6)];
    if (!(tile.cells >> (cell & 63) & 1)) return 0;
    return tile.bodies & kSeveral ? lists_[tile.bodies & ~kSeveral][cell & 63] : tile.bodies;
  }
  /// AnyIn() of the list's cell.
  template <typename F>
  bool AnyOf(BodyList list, F f) const {
    if (list == 0) return false;
    if (!(list & kSeveral)) return f(BodyId{list - 1});
    const uint32_t first = list & ~kSeveral;
    uint32_t n = first;
    do {
      if (f(nodes_[n].id)) return true;
      n = nodes_[n].next;
    } while (n != first);
    return false;
  }
  /// Those cells of a drawn part with several bodies in them, as bits.
  uint64_t Crowded(const TilePart& part) const { return part.cells & tiles_[part.slot].crowded; }
  /// A handle of a cell in which something is, by its region, tile and bit.
  static CellRef CellAt(uint32_t region, uint32_t tile, uint32_t bit) {
    return CellOf(region * kTilesPerRegion + tile, bit);
  }
  /// Fetch a cell's list, and then the first body in it, into the cache: they will be needed soon.
  void PrefetchList(CellRef cell) const {
    __builtin_prefetch(&tiles_[static_cast<std::size_t>(cell >> 6)]);
  }
  void PrefetchBody(BodyList list) const {
    if (list == 0) return;
    if (list & kSeveral)
      __builtin_prefetch(&nodes_[list & ~kSeveral]);
    else
      __builtin_prefetch(&bodies_[list - 1]);
  }
  /// The region of a cell, or 0 if there is none.
  uint32_t FindRegion(int32_t x, int32_t y) const;
  /// The slot of a cell's tile, as in TilePart, or of an empty tile if there is no such region.
  uint32_t FindTileSlot(int32_t x, int32_t y) const {
    return FindRegion(x, y) * kTilesPerRegion + TileOf(x, y);
  }
  uint32_t FindTileSlot(const TilePart& part) const {
    return FindTileSlot(part.x << RAY_TILE_SHIFT, part.y << RAY_TILE_SHIFT);
  }
  /// Regions have numbers below this.
  std::size_t region_count() const { return regions_.size(); }
  /// A cell's tile in its region, and its bit in the tile.
  static uint32_t TileOf(int32_t x, int32_t y) {
    return static_cast<uint32_t>(ray_place(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT, 3));
  }
  static uint32_t BitOf(int32_t x, int32_t y) { return TilePart::BitOf(x, y); }

  /// Cell coordinates of a handle.
  void Coordinates(CellRef cell, int32_t* x, int32_t* y) const;

  /// The layer for rangers' rays at height z, which meet what is visible to rangers and reaches
  /// that height, ends included. There is room for a few heights; for others, and if `z_test` is
  /// off, it is the layer of any height. Makes the layer if there is none.
  LayerIndex RangerLayer(double z, bool z_test, bool exact = false) {
    return RangerLayerOf(z, z_test, exact, false);
  }
  /// A layer like RangerLayer() that leaves robots out. Heights of both kinds share the room.
  LayerIndex MapLayer(double z, bool z_test, bool exact) {
    return RangerLayerOf(z, z_test, exact, true);
  }
  /// The same, or kNoLayer instead of making one. For several threads at once.
  LayerIndex FindRangerLayer(double z, bool z_test, bool exact) const {
    return FindRangerLayerOf(z, z_test, exact, false);
  }
  /// The layer of everything in one of the drawings.
  LayerIndex EverythingLayer(bool exact);
  /// To be called once a step: heights that nobody asked for in a long time give up their layers.
  void AgeLayers();

  /// What the ray walk needs. Valid until the next change of the grid.
  ray_grid_t View(LayerIndex layer) const;
  LayerIndex layer_count() const { return static_cast<LayerIndex>(layers_.size()); }
  const Occupancy& occupancy(LayerIndex layer) const { return layers_[layer].cells; }
  Occupancy& occupancy(LayerIndex layer) { return layers_[layer].cells; }
  /// Remembers changed tiles, for a device that has a copy of the layers and of OnlyBody().
  void TrackChanges(bool on);
  /// What ListIn() says of all cells of a tile in which something is, if a single body is drawn in
  /// it; else 0.
  BodyList OnlyBody(uint32_t slot) const {
    const BodyList bodies = tiles_[slot].bodies;
    return bodies & kSeveral ? 0 : bodies;
  }
  /// Tiles for which that has changed.
  const ChangedTiles& changed_bodies() const { return changed_bodies_; }
  /// Const, as what is drawn does not change.
  void ForgetChangedBodies() const { changed_bodies_.Forget(); }

  /// The directory of superregions and their tables of regions, as ray_walk.h describes them.
  /// They stay the same as long as structure_version() does.
  const std::vector<ray_super_t>& directory() const { return directory_; }
  const std::vector<uint32_t>& region_tables() const { return region_tables_; }
  /// kMapsPerSuper words for each superregion: in which of its regions something is drawn.
  const std::vector<uint64_t>& region_maps() const { return region_maps_; }
  /// The word of those that has the region.
  std::size_t RegionMapOf(std::size_t region) const {
    return MapOf(regions_[region].super, regions_[region].place);
  }
  uint64_t structure_version() const { return structure_version_; }

  /// The number of cells of all bodies added up, without the exact drawing: a cell with two bodies
  /// counts twice.
  int64_t drawn_cells() const { return own_edit_.drawn_cells; }
  /// Adds to that number without drawing: for tests of what happens when it gets too large.
  void PretendDrawn(int64_t cells) { own_edit_.drawn_cells += cells; }
  /// Everything drawn lies in here (in whole regions; it may be larger than needed).
  CellBox occupied() const { return occupied_; }
  /// From now on rays meet nothing, whatever is drawn.
  void Hide() { occupied_ = CellBox(); }
  /// The bounding box of all superregions in which a thin outline has ever been drawn, in cells. It
  /// is a part of the world's state, as cameras see the floor that far. Drawing a thin outline is
  /// the only event that widens it: neither superregions that come and go, nor exact outlines,
  /// which are drawn for any onlooker, nor moves that are planned and not made have a part in it.
  CellBox extent() const { return own_edit_.extent; }
  /// Goes back to an extent that everything drawn lies in: see LiesInExtent().
  void SetExtent(const CellBox& extent) { own_edit_.extent = extent; }
  /// True if all thin outlines lie in the extent. Only then does drawing widen it as it should, as
  /// tiles that are occupied already are taken for a part of it.
  bool LiesInExtent() const;
  /// Widens the extent to what is drawn in the parts.
  void WidenExtent(std::span<const TilePart> parts);
  /// To be called when nothing is drawn any more: what is drawn then begins a new extent.
  void ForgetExtent() {
    DropEmptyRegions();
    own_edit_.extent = CellBox();
  }

  struct Statistics {
    std::size_t superregions, regions, tiles, bytes;
    uint64_t entered;  ///< how often superregions were put into the directory: a measure of work
  };
  Statistics statistics() const;

 private:
  struct Node {
    BodyId id;
    uint32_t next;      // of the last: the first
    uint32_t previous;  // of the first: the last
  };
  struct Region {
    uint32_t super = 0;
    uint32_t place = 0;  // in its superregion, 0..255
    uint32_t tiles = 0;  // that hold something
  };
  struct Super {
    int32_t x = 0, y = 0;
    uint32_t regions = 0;
    bool in_use = false;
  };
  struct Layer {
    enum Kind { kAll, kAnyHeight, kHeight, kUnused } kind = kUnused;
    double z = 0;                    // kHeight
    bool exact = false;              // which drawing
    bool map = false;                // it leaves out robots
    mutable uint64_t last_used = 0;  // the step
    Occupancy cells;
  };

  Grid& operator=(Grid&&) = default;

  template <typename F>
  static void ForEachRegionOf(const CellBox& tiles, F f);
  template <typename F>
  static void FillInSlots(std::span<TilePart> parts, F region_of);
  uint32_t MakeRegion(int32_t x, int32_t y);
  uint32_t MakeSuper(int32_t x, int32_t y);
  void AddFreeRegion();
  void AddFreeSuper();
  uint32_t MakeNode(BodyId id, Edit* edit);
  void RedrawOutline(BodyId id, std::span<const TilePart> from, std::span<TilePart> to, Edit* edit);
  void DrawOutline(const TilePart& part, BodyId id, Edit* edit);
  void ChangeOutline(const TilePart& from, const TilePart& to, BodyId id);
  void EraseOutline(const TilePart& part, BodyId id, Edit* edit);
  void HideOutline(uint32_t slot, uint64_t cells, BodyId id);
  OutlineList* FindOutline(uint32_t slot, BodyId id);
  void RefreshOutlines(uint32_t slot);
  bool IsEmpty(uint32_t slot) const { return tiles_[slot].cells == 0 && OutlinesIn(slot) == 0; }
  void DrawIn(uint32_t slot, uint64_t bits, BodyId id, Edit* edit);
  void EraseFrom(uint32_t slot, uint64_t bits, BodyId id, Edit* edit);
  CellLists& ListsOf(uint32_t slot, Edit* edit);
  void DropListsOfOneBody(uint32_t slot, Edit* edit);
  void SetBodies(uint32_t slot, uint32_t bodies);
  void SetBits(uint32_t layers, uint32_t slot, uint64_t bits);
  void ClearBits(uint32_t layers, uint32_t slot, uint64_t bits);
  uint32_t LayersWithoutOthers(BodyList list, uint32_t layers) const;
  void Append(BodyList* list, BodyId id, Edit* edit);
  void RemoveFrom(BodyList* list, BodyId id, Edit* edit);
  static bool Shows(const Layer& layer, const Body& body);
  uint32_t FindNode(uint32_t first, BodyId id) const;
  uint32_t LayersOf(const Body& body) const;
  LayerIndex RangerLayerOf(double z, bool z_test, bool exact, bool map);
  LayerIndex FindRangerLayerOf(double z, bool z_test, bool exact, bool map) const;
  LayerIndex FindLayer(Layer::Kind kind, double z, bool exact, bool map) const;
  bool HeightsAreFull(bool exact) const;
  LayerIndex MakeLayer(Layer::Kind kind, double z, bool exact, bool map);
  void SortIn(BodyList* list, BodyId id);
  uint32_t LayersOfDrawing(bool exact) const;
  void RefreshCells(const TilePart& part);
  size_t CountSupers() const { return supers_.size() - 1 - free_supers_.size(); }
  size_t CountRegions() const { return regions_.size() - 1 - free_regions_.size(); }
  static std::size_t MapOf(uint32_t super, uint32_t place) {
    return ray_block_map(super, static_cast<int>(place & 15) >> 3, static_cast<int>(place >> 7));
  }
  void MarkRegion(const Region& region, bool filled);
  CellBox SuperOf(uint32_t slot) const;
  void CountFilledTile(uint32_t slot, Edit* edit);
  void CountEmptiedTile(uint32_t slot, Edit* edit);
  void DropRegionsIfManyAreEmpty();
  void PrepareToDraw(std::span<TilePart> parts);
  void DropEmptyRegions();
  void RebuildDirectory(size_t supers);
  void Enter(uint32_t super);
  void RecomputeOccupied();

  std::vector<Body> bodies_;
  std::vector<BodyId> free_bodies_;

  PagedArray<TileCells> tiles_;  // 64 for each region, those of region 0 are empty
  Pool<CellLists> lists_;
  Pool<Node> nodes_;
  PagedArray<OutlineList> outlines_;  // as many as tiles, once something is drawn exactly
  Pool<OutlinePart> outline_parts_;   // [0]: none

  std::vector<Region> regions_;  // [0]: none
  std::vector<uint32_t> free_regions_;

  std::vector<uint64_t> stamps_;  // of bodies
  std::vector<Super> supers_;     // [0]: none
  std::vector<uint32_t> free_supers_;
  std::vector<uint32_t> region_tables_;
  std::vector<uint64_t> region_maps_;
  std::vector<ray_super_t> directory_;
  uint64_t structure_version_ = 1;
  uint64_t entered_ = 0;  // see Statistics

  std::vector<Layer> layers_;
  uint64_t step_ = 0;
  bool tracking_ = false;
  mutable ChangedTiles changed_bodies_;
  CellBox occupied_;
  Edit own_edit_;  // of who changes the grid alone
};

}  // namespace Stg::internal::grid

namespace Stg {
namespace grid = internal::grid;  // for the rooms above: clients see no such header
}

#endif
