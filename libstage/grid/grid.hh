// SPDX-License-Identifier: GPL-2.0-or-later
//
// The occupancy grid: which bodies lie in which cells.
//
// Cells are squares with sides of 1 / cells_per_metre; the cell of a point is the floor of its
// coordinates in cells. 8 x 8 cells form a tile, 8 x 8 tiles a region, 16 x 16 regions a
// superregion. Regions and superregions exist only where geometry is (empty ones are dropped after
// a while), so memory grows with content, not with extent. Cell coordinates range over +-kMaxCell.

#ifndef STAGE_GRID_GRID_HH
#define STAGE_GRID_GRID_HH

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/cell_set.hh"
#include "grid/occupancy.hh"
#include "grid/paged_array.hh"
#include "grid/pool.hh"
#include "kernels/ray_walk.h"
#include "messages/assert.hh"

namespace Stg {
class Model;
}

namespace Stg::internal::grid {

/// Limit of cell coordinates: bodies beyond it are not rasterized and rays from there hit nothing.
inline constexpr int32_t kMaxCell = 1 << 30;

/// Occupied cells are stored in layers, so that a ray stops only where it may hit something. One
/// layer holds everything; others, made on demand, hold what rangers see at any height or at one
/// height. A body has up to two rasterizations: a thin outline, and every cell that the outline
/// touches for the exact ray model. Each layer shows one kind. Bodies are listed per cell for thin
/// outlines and per tile for exact ones (grid_outlines.cc).
using LayerIndex = uint32_t;
inline constexpr LayerIndex kEverything = 0;  ///< thin outlines only
inline constexpr LayerIndex kNoLayer = 0xffffffffu;
inline constexpr uint32_t kMaxHeights = 8;  ///< per kind of rasterization
inline constexpr uint32_t kMaxLayers = 2 * (kMaxHeights + 3);

/// One entry of the grid: a block of a model or, in the exact rasterization, a few consecutive
/// edges of a block.
struct Body {
  double z_min = 0, z_max = 0;  ///< global height interval, metres
  Model* model = nullptr;
  const void* tree = nullptr;  ///< the topmost ancestor of the model: equal for related models
  bool ranger_visible = true;  ///< false: ranger layers omit the body, no ranger can see it
  bool drives = false;         ///< part of a robot: map layers omit the body
  /// Exact rasterization: edges + 1 corners in global metres, owned by the caller. Otherwise null.
  const point_t* corners = nullptr;
  uint32_t edges = 0;   ///< at most kMaxEdges
  uint32_t number = 0;  ///< if a ray meets several bodies at one place, the smallest number wins
  double x = 0, y = 0, radius = 0;  ///< bounding circle of the corners
  uint32_t layers = 0;              ///< bit i: the body shows in layer i; kept by the grid

  bool exact() const { return corners != nullptr; }
  static constexpr uint32_t kMaxEdges = 32;
};
using BodyId = uint32_t;

/// The cells and edges of one exact outline in one tile.
struct OutlineFragment {
  uint64_t cells;  ///< as in CellSet
  BodyId id;
  uint32_t edges;  ///< as in CellSet
  uint32_t next;   ///< next outline in the same tile, or 0
};
/// The first outline of a tile, or 0 if the tile has none. Valid until the grid changes.
using OutlineList = uint32_t;

/// Handle of an occupied cell. Valid as long as the cell is occupied.
using CellRef = uint64_t;
inline CellRef CellOf(uint32_t slot, uint32_t bit) {
  STAGE_ASSERT(bit < 64);
  return CellRef{slot} << 6 | bit;
}

/// Handle of the bodies in a cell, or 0 if the cell is empty. Valid until the grid changes.
using BodyList = uint32_t;

/// Calls f(CellRef) for each cell of a cell set.
template <typename F>
void ForEachCell(const CellSet& set, F f) {
  ForEachBit(set.cells, [&](uint32_t bit) { f(CellOf(set.slot, bit)); });
}

/// The rasterizations of several bodies, each a list of cell sets.
struct Rasterizations {
  std::vector<const std::vector<CellSet>*> of_bodies;

  /// Calls f(const CellSet&) for each cell set of each body.
  template <typename F>
  void ForEachSet(F f) const {
    for (const std::vector<CellSet>* sets : of_bodies)
      for (const CellSet& set : *sets) f(set);
  }
  /// Calls f(CellRef) for each cell of each body.
  template <typename F>
  void ForEachCell(F f) const {
    ForEachSet([&](const CellSet& set) { grid::ForEachCell(set, f); });
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
  /// Freezes this grid. Later copies share each memory page with it until they write to the page.
  void Freeze();
  /// Turns this grid, in which nothing is rasterized yet, into a copy of `other`. Body ids and
  /// model pointers are copied unchanged.
  void AssignCopy(const Grid& other);

  BodyId AddBody(const Body& body);
  void RemoveBody(BodyId id);  ///< the body must not be in any cell
  /// Replaces the attributes of a body. `rasterized` is its current rasterization.
  void ChangeBody(BodyId id, const Body& body, std::span<const CellSet> current);
  const Body& body(BodyId id) const {
    STAGE_ASSERT(id < bodies_.size());
    return bodies_[id];
  }
  std::size_t body_count() const { return bodies_.size(); }  ///< upper bound: all ids are below it

  /// Per-thread state of a concurrent edit, see BeginConcurrentEdit(). Aligned to cache lines,
  /// because each thread writes to its own all the time.
  class alignas(64) Edit {
    friend class Grid;
    friend class GridTamperer;
    bool shared = false;
    PoolCache own_lists, own_nodes, own_outlines;
    int64_t rasterized_cells = 0, empty_regions = 0;  // increase since the edit began
    uint64_t first_stamp = 0, last_stamp = 0;         // last stamp before the edit, and so far
    CellBox extent;                                   // what this edit adds to Grid::extent()

   public:
    /// Concurrent edits only: sets the next stamp, as if `bodies` calls of Rasterize() preceded it
    /// in this edit.
    void SetNextStamp(uint64_t bodies) {
      STAGE_ASSERT(shared);
      last_stamp = first_stamp + bodies;
    }

   private:
    PoolCache* lists() { return shared ? &own_lists : nullptr; }
    PoolCache* nodes() { return shared ? &own_nodes : nullptr; }
    PoolCache* outlines() { return shared ? &own_outlines : nullptr; }
  };

  /// Moves the rasterization of a body from `from` (its current one) to `to`. The body becomes the
  /// last in the lists of the cells of `to`. Both spans are sorted and name each tile once; either
  /// may be empty. Fills in the slots of `to`. In a concurrent edit, regions are not created: slots
  /// of thin cell sets must be filled in beforehand, and exact cell sets need existing regions.
  void Rasterize(BodyId id, std::span<const CellSet> from, std::span<CellSet> to,
                 Edit* edit = nullptr);

  /// Changes the cells of a thin body in one tile, whose region exists, from `from` to `to`,
  /// without a new stamp. Nothing is allocated for tiles that no other body is in. The extent may
  /// grow.
  void ChangeTile(BodyId id, uint32_t slot, uint64_t from, uint64_t to);

  /// Sequence number of the body's last rasterization. The lists of cells are sorted by it.
  uint64_t Stamp(BodyId id) const {
    STAGE_ASSERT(id < stamps_.size());
    return stamps_[id];
  }
  /// The highest stamp so far.
  uint64_t last_stamp() const { return serial_edit_.last_stamp; }
  /// Gives a body the newest stamp without rasterizing it: it becomes the last in its lists.
  void MoveToEnd(BodyId id, std::span<const CellSet> sets) {
    Restamp(id, ++serial_edit_.last_stamp, sets);
  }
  /// Sets the stamp of a body and re-sorts it in the lists of `sets`, its rasterization.
  void Restamp(BodyId id, uint64_t stamp, std::span<const CellSet> sets);

  /// Until EndConcurrentEdit(), several threads may rasterize, change and read bodies concurrently,
  /// each with its own Edit. Two threads must never use the same tile at once, and thin cell sets
  /// need their slots. `limits` gives upper bounds, for which memory is reserved. Other changes are
  /// forbidden.
  struct EditSize {
    std::size_t sets = 0, cells = 0;  ///< thin outlines: cell sets, and cells in all of them
    std::size_t exact_sets = 0;
    uint64_t bodies = 0;  ///< number of calls of Rasterize()
  };
  void BeginConcurrentEdit(const EditSize& limits, std::vector<Edit>* edits);
  void EndConcurrentEdit(std::vector<Edit>* edits);
  /// Fills in the slots of the cell sets, with 0 where the region does not exist. Returns true if
  /// all regions exist. A slot is valid until regions are dropped, which may happen in each
  /// rasterization outside of a concurrent edit and at the end of one.
  bool FindSlots(std::span<CellSet> sets) const;
  /// Fills in the slots of the cell sets and creates missing regions.
  void MakeSlots(std::span<CellSet> sets);
  /// HasRegions() is true if all tiles of the box have regions; MakeRegions() makes them.
  bool HasRegions(const CellBox& tiles) const;
  void MakeRegions(const CellBox& tiles);

  /// Thin outlines in a tile, mostly of a single body. The alignment keeps the layout equal
  /// everywhere: i386 aligns 64-bit numbers to 4 bytes only.
  struct alignas(8) TileCells {
    uint64_t cells;    ///< occupied cells
    uint64_t crowded;  ///< cells with several bodies
    uint32_t bodies;   ///< 0: none; id + 1: only this one; kListFlag | index of CellLists: several
  };
  /// The lists of a tile with several bodies, valid for its occupied cells: id + 1 for one body, or
  /// kListFlag | index of the first node. The nodes of a cell form a ring in the order of stamps.
  using CellLists = std::array<BodyList, 64>;
  static constexpr uint32_t kListFlag = 0x80000000u;

  /// The arrays that ListIn() reads, for code that looks up many cells at once.
  struct Tables {
    const TileCells* tiles;  ///< by slot: region * 64 + tile in the region
    const CellLists* lists;
    const OutlineList* outlines;  ///< by slot; null before the first exact outline
  };
  Tables tables() const { return {tiles_.data(), lists_.data(), outlines_.data()}; }

  /// First exact outline in a tile. The order of outlines is unspecified.
  OutlineList OutlinesIn(uint32_t slot) const {
    STAGE_ASSERT(slot < tiles_.size());
    return outlines_.size() > 0 ? outlines_[slot] : 0;
  }
  const OutlineFragment& outline(OutlineList list) const {
    STAGE_ASSERT(list != 0);
    return outline_fragments_[list];
  }
  /// Prefetches the first outline of the list.
  void PrefetchOutline(OutlineList list) const { __builtin_prefetch(&outline_fragments_[list]); }
  /// Calls f(const OutlineFragment&) for each outline of the list.
  template <typename F>
  void ForEachOutline(OutlineList list, F f) const {
    for (; list != 0; list = outline_fragments_[list].next) f(outline_fragments_[list]);
  }

  /// Calls f(BodyId) for the bodies in a cell, in order of stamps, until f returns true. Returns
  /// true if f did.
  template <typename F>
  bool AnyIn(CellRef cell, F f) const {
    return AnyOf(ListIn(cell), f);
  }
  template <typename F>
  bool AnyAt(uint32_t region, uint32_t tile, uint32_t bit, F f) const {
    return AnyIn(CellAt(region, tile, bit), f);
  }
  BodyList ListIn(CellRef cell) const {
    STAGE_ASSERT(cell >> 6 < tiles_.size());
    const TileCells& tile = tiles_[static_cast<std::size_t>(cell >> 6)];
    if (!(tile.cells >> (cell & 63) & 1)) return 0;
    return tile.bodies & kListFlag ? lists_[tile.bodies & ~kListFlag][cell & 63] : tile.bodies;
  }
  /// Like AnyIn(), for a list that has been looked up already.
  template <typename F>
  bool AnyOf(BodyList list, F f) const {
    if (list == 0) return false;
    if (!(list & kListFlag)) {
      STAGE_ASSERT(list <= bodies_.size());
      return f(BodyId{list - 1});
    }
    const uint32_t first = list & ~kListFlag;
    uint32_t n = first;
    do {
      STAGE_ASSERT(nodes_[n].id < bodies_.size());
      if (f(nodes_[n].id)) return true;
      n = nodes_[n].next;
    } while (n != first);
    return false;
  }
  /// Mask of the cells of a cell set that hold several bodies.
  uint64_t Crowded(const CellSet& set) const {
    STAGE_ASSERT(set.slot < tiles_.size());
    return set.cells & tiles_[set.slot].crowded;
  }
  /// Handle of an occupied cell, from its region, tile and bit.
  static CellRef CellAt(uint32_t region, uint32_t tile, uint32_t bit) {
    STAGE_ASSERT(tile < kTilesPerRegion);
    return CellOf(region * kTilesPerRegion + tile, bit);
  }
  /// Prefetch a cell's list (first), or the first body of that list (later).
  void PrefetchList(CellRef cell) const {
    __builtin_prefetch(&tiles_[static_cast<std::size_t>(cell >> 6)]);
  }
  void PrefetchBody(BodyList list) const {
    if (list == 0) return;
    if (list & kListFlag)
      __builtin_prefetch(&nodes_[list & ~kListFlag]);
    else
      __builtin_prefetch(&bodies_[list - 1]);
  }
  /// Index of the region that contains a cell, or 0 if it does not exist.
  uint32_t FindRegion(int32_t x, int32_t y) const;
  /// Slot of the tile that contains a cell, or of an empty tile if the region does not exist.
  uint32_t FindTileSlot(int32_t x, int32_t y) const {
    return FindRegion(x, y) * kTilesPerRegion + TileOf(x, y);
  }
  uint32_t FindTileSlot(const CellSet& set) const {
    return FindTileSlot(set.x << RAY_TILE_SHIFT, set.y << RAY_TILE_SHIFT);
  }
  /// Upper bound of region indices.
  std::size_t region_count() const { return regions_.size(); }
  /// TileOf() is the index of a cell's tile in its region; BitOf() is the cell's bit in the tile.
  static uint32_t TileOf(int32_t x, int32_t y) {
    return static_cast<uint32_t>(ray_place(x >> RAY_TILE_SHIFT, y >> RAY_TILE_SHIFT, 3));
  }
  static uint32_t BitOf(int32_t x, int32_t y) { return CellSet::BitOf(x, y); }

  /// Coordinates of the cell that a handle stands for.
  void Coordinates(CellRef cell, int32_t* x, int32_t* y) const;

  /// The layer for rangers' rays at height z: bodies that are visible to rangers and span z (bounds
  /// included). Returns the layer of any height if `z_test` is off or kMaxHeights is reached. Makes
  /// the layer if needed.
  LayerIndex RangerLayer(double z, bool z_test, bool exact = false) {
    return RangerLayerOf(z, z_test, exact, false);
  }
  /// A layer like RangerLayer() without robots. Both kinds count towards kMaxHeights.
  LayerIndex MapLayer(double z, bool z_test, bool exact) {
    return RangerLayerOf(z, z_test, exact, true);
  }
  /// Like RangerLayer(), but returns kNoLayer instead of making a layer. Thread-safe.
  LayerIndex FindRangerLayer(double z, bool z_test, bool exact) const {
    return FindRangerLayerOf(z, z_test, exact, false);
  }
  /// Masks of layers: those for rangers that show bodies of all heights, and those made since the
  /// last call of ExpireLayers().
  uint32_t LayersOfAllHeights() const;
  uint32_t NewLayers() const;
  /// The layer of all bodies, thin or exact. Makes it if needed.
  LayerIndex EverythingLayer(bool exact);
  /// Call once a step: frees layers of heights that were not requested for 1000 steps.
  void ExpireLayers();

  /// Input of the ray walk. Valid until the grid changes.
  ray_grid_t View(LayerIndex layer) const;
  LayerIndex layer_count() const { return static_cast<LayerIndex>(layers_.size()); }
  const Occupancy& occupancy(LayerIndex layer) const {
    STAGE_ASSERT(layer < layers_.size());
    return layers_[layer].cells;
  }
  Occupancy& occupancy(LayerIndex layer) {
    STAGE_ASSERT(layer < layers_.size());
    return layers_[layer].cells;
  }
  /// Records changed tiles while on, for a device that copies the layers and OnlyBody().
  void TrackChanges(bool on);
  /// The list of every occupied cell in the tile if a single body is rasterized there, otherwise 0.
  BodyList OnlyBody(uint32_t slot) const {
    STAGE_ASSERT(slot < tiles_.size());
    const BodyList bodies = tiles_[slot].bodies;
    return bodies & kListFlag ? 0 : bodies;
  }
  /// Tiles whose OnlyBody() may have changed.
  const ChangedTiles& changed_bodies() const { return changed_bodies_; }
  /// Const, because the bodies do not change.
  void ForgetChangedBodies() const { changed_bodies_.Forget(); }

  /// Tiles whose list of outlines may have changed: which outlines are in it, and their edges.
  const ChangedTiles& changed_outlines() const { return changed_outlines_; }
  /// By body: nonzero if it is exact and may have changed.
  const std::vector<uint8_t>& changed_exact_bodies() const { return changed_exact_bodies_; }
  void ForgetChangedOutlines() const;
  /// Upper bound of the numbers in OutlineList.
  std::size_t outline_count() const { return outline_fragments_.made(); }
  /// Another number if a copy of the outlines must be made anew: changes do not tell all.
  uint64_t OutlinesVersion() const;

  /// Directory of superregions and their tables of regions, as described in ray_walk.h. Unchanged
  /// as long as structure_version() is.
  const std::vector<ray_super_t>& directory() const { return directory_; }
  const std::vector<uint32_t>& region_tables() const { return region_tables_; }
  /// kMapsPerSuper words per superregion: bit masks of its regions that are not empty.
  const std::vector<uint64_t>& region_maps() const { return region_maps_; }
  /// Index in region_maps() of the word that covers the region.
  std::size_t RegionMapOf(std::size_t region) const {
    STAGE_ASSERT(region < regions_.size());
    return MapOf(regions_[region].super, regions_[region].place);
  }
  uint64_t structure_version() const { return structure_version_; }

  /// Total number of cells in thin rasterizations. A cell with two bodies counts twice.
  int64_t rasterized_cells() const { return serial_edit_.rasterized_cells; }
  /// Adds to rasterized_cells() without rasterizing, for tests of overflow.
  void AddRasterizedCells(int64_t cells) {
    serial_edit_.rasterized_cells += cells;
    pretended_cells_ += cells;
  }
  int64_t pretended_cells() const { return pretended_cells_; }
  /// A box, in whole regions, that contains every occupied cell. It may be larger than needed.
  CellBox occupied() const { return occupied_; }
  /// Makes all rays miss by emptying occupied().
  void Hide() { occupied_ = CellBox(); }
  /// Bounding box, in cells, of all superregions that a thin outline was ever rasterized in. It is
  /// part of the world's state, because cameras render the floor that far. Only rasterizing a thin
  /// outline widens it: superregions that come and go, exact outlines (made for any observer) and
  /// rejected moves have no effect.
  CellBox extent() const { return serial_edit_.extent; }
  /// Restores an extent, which must contain all thin outlines: see LiesInExtent().
  void SetExtent(const CellBox& extent) { serial_edit_.extent = extent; }
  /// True if all thin outlines lie in the extent. Rasterizing widens the extent only for empty
  /// tiles; it assumes that occupied tiles are in it already.
  bool LiesInExtent() const;
  /// Extends the extent by the superregions of the cell sets.
  void WidenExtent(std::span<const CellSet> sets);
  /// Call when the grid is empty: the next rasterization starts a new extent.
  void ForgetExtent() {
    DropEmptyRegions();
    STAGE_ASSERT(CountRegions() == 0);
    serial_edit_.extent = CellBox();
  }

  struct Statistics {
    std::size_t superregions, regions, tiles, bytes;
    uint64_t entered;  ///< insertions into the directory so far: a measure of work
  };
  Statistics statistics() const;

  /// Checks everything that must hold outside of concurrent edits: lists against tiles, tiles
  /// against all layers, regions and superregions, free indices, counts and the extent. Returns the
  /// first fault found, or an empty string. Takes time in proportion to the size of the grid. A
  /// grid after Hide() is not valid.
  std::string Validate() const;

 private:
  class Validator;
  friend class GridTamperer;  // tests corrupt a grid to check that Validate() detects it
  struct Node {
    BodyId id;
    uint32_t next;      // of the last node: the first one
    uint32_t previous;  // of the first node: the last one
  };
  struct Region {
    uint32_t super = 0;
    uint32_t place = 0;  // index in its superregion, 0..255
    uint32_t tiles = 0;  // number of tiles that are not empty
  };
  struct Super {
    int32_t x = 0, y = 0;
    uint32_t regions = 0;
    bool in_use = false;
  };
  struct Layer {
    enum Kind { kAll, kAnyHeight, kHeight, kUnused } kind = kUnused;
    double z = 0;                    // kHeight only, metres
    bool exact = false;              // kind of rasterization
    bool map = false;                // omits robots
    uint64_t made = 0;               // step
    mutable uint64_t last_used = 0;  // step of the last request
    Occupancy cells;
  };

  Grid& operator=(Grid&&) = default;

  template <typename F>
  static void ForEachRegionOf(const CellBox& tiles, F f);
  template <typename F>
  static void FillInSlots(std::span<CellSet> sets, F region_of);
  uint32_t MakeRegion(int32_t x, int32_t y);
  uint32_t MakeSuper(int32_t x, int32_t y);
  void AddFreeRegion();
  void AddFreeSuper();
  uint32_t MakeNode(BodyId id, Edit* edit);
  void RasterizeOutline(BodyId id, std::span<const CellSet> from, std::span<CellSet> to,
                        Edit* edit);
  void AddOutline(const CellSet& set, BodyId id, Edit* edit);
  void ChangeOutline(const CellSet& from, const CellSet& to, BodyId id);
  void RemoveOutline(const CellSet& set, BodyId id, Edit* edit);
  void ClearOutlineCells(uint32_t slot, uint64_t cells, BodyId id);
  OutlineList* FindOutline(uint32_t slot, BodyId id);
  bool HasOutline(uint32_t slot, BodyId id) const;
  void RefreshOutlines(uint32_t slot);
  void NoteExactBody(BodyId id) {
    if (tracking_) changed_exact_bodies_[id] = 1;
  }
  bool IsEmpty(uint32_t slot) const { return tiles_[slot].cells == 0 && OutlinesIn(slot) == 0; }
  /// True if the tile of this slot lies in a region that exists.
  bool IsInRegion(uint32_t slot) const;
  void AddToTile(uint32_t slot, uint64_t bits, BodyId id, Edit* edit);
  void RemoveFromTile(uint32_t slot, uint64_t bits, BodyId id, Edit* edit);
  CellLists& ListsOf(uint32_t slot, Edit* edit);
  void DropListsOfOneBody(uint32_t slot, Edit* edit);
  void SetBodies(uint32_t slot, uint32_t bodies);
  static bool AreListsOf(const CellLists& lists, uint64_t cells, BodyId id);
  void SetBits(uint32_t layers, uint32_t slot, uint64_t bits);
  void ClearBits(uint32_t layers, uint32_t slot, uint64_t bits);
  uint32_t UncoveredLayers(BodyList list, uint32_t layers) const;
  BodyId LastOf(BodyList list) const;
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
  uint32_t LayersOfKind(bool exact) const;
  void RefreshCells(const CellSet& set);
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
  void AllocateForCells(std::span<CellSet> sets);
  void DropEmptyRegions();
  void RebuildDirectory(size_t supers);
  void Enter(uint32_t super);
  void RecomputeOccupied();

  std::vector<Body> bodies_;
  std::vector<BodyId> free_bodies_;

  PagedArray<TileCells> tiles_;  // 64 per region; region 0 is empty
  Pool<CellLists> lists_;
  Pool<Node> nodes_;
  PagedArray<OutlineList> outlines_;         // one per tile, once there is an exact outline
  Pool<OutlineFragment> outline_fragments_;  // [0] stands for none

  std::vector<Region> regions_;  // [0] stands for none
  std::vector<uint32_t> free_regions_;

  std::vector<uint64_t> stamps_;  // by BodyId
  std::vector<Super> supers_;     // [0] stands for none
  std::vector<uint32_t> free_supers_;
  std::vector<uint32_t> region_tables_;
  std::vector<uint64_t> region_maps_;
  std::vector<ray_super_t> directory_;
  uint64_t structure_version_ = 1;
  uint64_t entered_ = 0;  // see Statistics

  std::vector<Layer> layers_;
  uint64_t step_ = 0;
  bool tracking_ = false;
  mutable ChangedTiles changed_bodies_, changed_outlines_;
  mutable std::vector<uint8_t> changed_exact_bodies_;
  CellBox occupied_;
  int64_t pretended_cells_ = 0;  // see AddRasterizedCells()
  Edit serial_edit_;             // used outside of concurrent edits
};

}  // namespace Stg::internal::grid

namespace Stg {
namespace grid = internal::grid;  // for internal modules: clients do not see this header
}

#endif
