// SPDX-License-Identifier: GPL-2.0-or-later

#include "grid/grid.hh"

#include <algorithm>
#include <atomic>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "messages/assert.hh"

namespace Stg::internal::grid {

namespace {

constexpr size_t kSlotsPerSuper = 4;  // minimum; sparse, so that the first probe mostly hits

void Include(CellBox* box, const CellBox& other) {
  if (box->empty()) {
    *box = other;
    return;
  }
  box->min_x = std::min(box->min_x, other.min_x);
  box->min_y = std::min(box->min_y, other.min_y);
  box->max_x = std::max(box->max_x, other.max_x);
  box->max_y = std::max(box->max_y, other.max_y);
}

/// Cells of the square (x, y) in a mesh of squares with 2^shift cells per side.
CellBox SquareBox(int32_t x, int32_t y, int shift) {
  const int32_t side = int32_t{1} << shift;
  return {x * side, y * side, x * side + side - 1, y * side + side - 1};
}

/// Reserves memory for `count` numbers, at least doubling it so that many small calls are cheap.
void ReserveFor(size_t count, std::vector<uint32_t>* numbers) {
  if (numbers->capacity() < count) numbers->reserve(std::max(count, 2 * numbers->capacity()));
}

/// True if the cell sets are sorted and lie in the grid. Exact rasterizations may reach beyond
/// kMaxCell by their margin.
[[maybe_unused]] bool AreValid(std::span<const CellSet> sets) {
  constexpr int32_t kMaxTile = (kMaxCell >> RAY_TILE_SHIFT) + 1;
  return AreSorted(sets) && std::ranges::all_of(sets, [](const CellSet& set) {
           return std::abs(set.x) <= kMaxTile && std::abs(set.y) <= kMaxTile && set.cells != 0;
         });
}

}  // namespace

Grid::Grid() : tiles_(kTilesPerRegion), regions_(1), supers_(1) {
  region_tables_.resize(kRegionsPerSuper, 0);
  region_maps_.resize(kMapsPerSuper, 0);
  MakeLayer(Layer::kAll, 0, false, false);
  RebuildDirectory(0);
}

void Grid::Freeze() {
  tiles_.Freeze(tiles_.size());
  lists_.Freeze();
  nodes_.Freeze();
  outlines_.Freeze(outlines_.size());
  outline_fragments_.Freeze();
  for (Layer& layer : layers_) layer.cells.Freeze();
}

void Grid::AssignCopy(const Grid& other) {
  const bool tracking = tracking_;
  const uint64_t version = std::max(structure_version_, other.structure_version_) + 1;
  *this = Grid(other);
  structure_version_ = version;
  TrackChanges(tracking);
}

BodyId Grid::AddBody(const Body& body) {
  STAGE_ASSERT(body.exact() == (body.edges > 0) && body.edges <= Body::kMaxEdges);
  if (body.exact() && outlines_.size() == 0) {
    outline_fragments_.ReserveFree(1);
    outlines_.resize(tiles_.size());
    outline_fragments_.Take();  // 0 stands for none
  }
  BodyId id = static_cast<BodyId>(bodies_.size());
  if (!free_bodies_.empty()) {
    id = free_bodies_.back();
    STAGE_ASSERT(id < bodies_.size() && bodies_[id].model == nullptr);  // as RemoveBody() left it
    free_bodies_.pop_back();
    bodies_[id] = body;
  } else {
    if (stamps_.size() <= id) stamps_.resize(id + 1);
    if (tracking_) changed_exact_bodies_.resize(id + 1);
    bodies_.push_back(body);
    free_bodies_.reserve(bodies_.capacity());  // so that RemoveBody() does not allocate
  }
  stamps_[id] = 0;  // a reused id must not inherit the stamp of its previous body
  bodies_[id].layers = LayersOf(body);
  if (body.exact()) NoteExactBody(id);
  return id;
}

void Grid::ChangeBody(BodyId id, const Body& body, std::span<const CellSet> current) {
  STAGE_ASSERT(id < bodies_.size() && bodies_[id].exact() == body.exact());
  STAGE_ASSERT(body.edges <= Body::kMaxEdges);
  const uint32_t before = bodies_[id].layers;
  bodies_[id] = body;
  bodies_[id].layers = LayersOf(body);
  if (body.exact()) NoteExactBody(id);
  if (bodies_[id].layers == before) return;
  for (const CellSet& set : current) {
    STAGE_ASSERT(IsInRegion(set.slot));
    if (body.exact())
      RefreshOutlines(set.slot);
    else
      RefreshCells(set);
  }
}

void Grid::RemoveBody(BodyId id) {
  STAGE_ASSERT(id < bodies_.size() && free_bodies_.size() < bodies_.size());
  STAGE_ASSERT(bodies_[id].model != nullptr);  // not removed yet
  bodies_[id] = Body();
  free_bodies_.push_back(id);
}

// ---- cells --------------------------------------------------------------------------------------

void Grid::Rasterize(BodyId id, std::span<const CellSet> from, std::span<CellSet> to, Edit* edit) {
  if (edit == nullptr) edit = &serial_edit_;
  STAGE_ASSERT(edit->shared == (edit != &serial_edit_));
  STAGE_ASSERT(id < bodies_.size() && AreValid(from) && AreValid(to));
  if (bodies_[id].exact()) return RasterizeOutline(id, from, to, edit);
  if (!edit->shared) AllocateForCells(to);
  STAGE_ASSERT(std::ranges::all_of(from, [&](const CellSet& p) { return IsInRegion(p.slot); }));
  STAGE_ASSERT(std::ranges::all_of(to, [&](const CellSet& p) { return IsInRegion(p.slot); }));
  if (!to.empty()) stamps_[id] = ++edit->last_stamp;
  size_t next = 0;
  const auto erase_next = [&] {
    RemoveFromTile(from[next].slot, from[next].cells, id, edit);
    next++;
  };
  for (const CellSet& set : to) {
    while (next < from.size() && from[next].ComesBefore(set)) erase_next();
    if (next == from.size() || !from[next].SameTile(set)) {
      AddToTile(set.slot, set.cells, id, edit);
      continue;
    }
    STAGE_ASSERT(from[next].slot == set.slot);
    const uint64_t before = from[next++].cells;
    // The body must become the last in each list. In cells where it is alone, it already is.
    const uint64_t stays = before & set.cells & ~tiles_[set.slot].crowded;
    RemoveFromTile(set.slot, before & ~stays, id, edit);
    AddToTile(set.slot, set.cells & ~stays, id, edit);
  }
  while (next < from.size()) erase_next();
  if (!edit->shared) DropRegionsIfManyAreEmpty();
}

/// Allocates all memory before anything is rasterized, so that bad_alloc leaves the grid unchanged.
void Grid::AllocateForCells(std::span<CellSet> sets) {
  MakeSlots(sets);
  lists_.ReserveFree(sets.size());
  nodes_.ReserveFree(2 * CountCells(sets));  // see BeginConcurrentEdit()
}

void Grid::AddToTile(uint32_t slot, uint64_t bits, BodyId id, Edit* edit) {
  if (bits == 0) return;
  STAGE_ASSERT(IsInRegion(slot));
  TileCells& tile = tiles_[slot];
  STAGE_ASSERT(tile.bodies != id + 1 || (tile.cells & bits) == 0);  // erased there before
  STAGE_ASSERT((tile.cells == 0) == (tile.bodies == 0) && (tile.crowded & ~tile.cells) == 0);
  edit->rasterized_cells += std::popcount(bits);
  if (IsEmpty(slot)) CountFilledTile(slot, edit);
  if (tile.cells == 0) Include(&edit->extent, SuperOf(slot));
  if (tile.cells == 0 || (tile.bodies == id + 1 && (tile.cells & bits) == 0)) {
    SetBodies(slot, id + 1);
  } else {
    CellLists& lists = ListsOf(slot, edit);
    ForEachBit(bits & ~tile.cells, [&](uint32_t bit) { lists[bit] = id + 1; });
    ForEachBit(bits & tile.cells, [&](uint32_t bit) { Append(&lists[bit], id, edit); });
    tile.crowded |= bits & tile.cells;
  }
  tile.cells |= bits;
  SetBits(bodies_[id].layers, slot, bits);
}

void Grid::RemoveFromTile(uint32_t slot, uint64_t bits, BodyId id, Edit* edit) {
  if (bits == 0) return;
  STAGE_ASSERT(IsInRegion(slot));
  TileCells& tile = tiles_[slot];
  STAGE_ASSERT((bits & ~tile.cells) == 0);
  STAGE_ASSERT(tile.bodies == id + 1 || (tile.bodies & kListFlag) != 0);
  const Body& body = bodies_[id];
  edit->rasterized_cells -= std::popcount(bits);
  const uint64_t crowded = bits & tile.crowded, alone = bits & ~crowded;
  tile.cells &= ~alone;
  if (IsEmpty(slot)) CountEmptiedTile(slot, edit);
  ClearBits(body.layers, slot, alone);
  if (!(tile.bodies & kListFlag)) {
    STAGE_ASSERT(crowded == 0);
    if (tile.cells == 0) SetBodies(slot, 0);
    return;
  }
  CellLists& lists = ListsOf(slot, edit);
  STAGE_ASSERT(AreListsOf(lists, alone, id));
  ForEachBit(crowded, [&](uint32_t bit) {
    BodyList& list = lists[bit];
    STAGE_ASSERT((list & kListFlag) != 0);
    RemoveFrom(&list, id, edit);
    if (!(list & kListFlag)) tile.crowded &= ~(uint64_t{1} << bit);
    ClearBits(UncoveredLayers(list, body.layers), slot, uint64_t{1} << bit);
  });
  DropListsOfOneBody(slot, edit);
}

/// True if the list of each of the cells holds this body alone.
bool Grid::AreListsOf(const CellLists& lists, uint64_t cells, BodyId id) {
  bool all = true;
  ForEachBit(cells, [&](uint32_t bit) { all = all && lists[bit] == id + 1; });
  return all;
}

/// True if the tile of this slot lies in a region that exists.
bool Grid::IsInRegion(uint32_t slot) const {
  const uint32_t index = slot / kTilesPerRegion;
  if (index == 0 || index >= regions_.size()) return false;
  const Region& region = regions_[index];
  return region_tables_[region.super * kRegionsPerSuper + region.place] == index;
}

void Grid::SetBodies(uint32_t slot, uint32_t bodies) {
  if (tiles_[slot].bodies == bodies) return;
  tiles_[slot].bodies = bodies;
  changed_bodies_.Note(slot);
}

void Grid::SetBits(uint32_t layers, uint32_t slot, uint64_t bits) {
  STAGE_ASSERT(layers >> layers_.size() == 0);
  ForEachBit(layers, [&](uint32_t layer) { layers_[layer].cells.Set(slot, bits); });
}

void Grid::ClearBits(uint32_t layers, uint32_t slot, uint64_t bits) {
  STAGE_ASSERT(layers >> layers_.size() == 0);
  ForEachBit(layers, [&](uint32_t layer) { layers_[layer].cells.Clear(slot, bits); });
}

/// The lists of the tile's cells. Makes them if the tile held a single body so far.
Grid::CellLists& Grid::ListsOf(uint32_t slot, Edit* edit) {
  const TileCells& tile = tiles_[slot];
  if (tile.bodies & kListFlag) return lists_[tile.bodies & ~kListFlag];
  STAGE_ASSERT(tile.bodies != 0 && tile.crowded == 0);
  const uint32_t index = lists_.Take(edit->lists());
  STAGE_ASSERT((index & kListFlag) == 0);
  CellLists& lists = lists_[index];
  ForEachBit(tile.cells, [&](uint32_t bit) { lists[bit] = tile.bodies; });
  SetBodies(slot, kListFlag | index);
  return lists;
}

/// Frees the tile's lists if only one body is left in the tile.
void Grid::DropListsOfOneBody(uint32_t slot, Edit* edit) {
  const TileCells& tile = tiles_[slot];
  STAGE_ASSERT((tile.bodies & kListFlag) != 0);
  if (tile.crowded != 0) return;
  const uint32_t index = tile.bodies & ~kListFlag;
  const CellLists& lists = lists_[index];
  BodyList only = 0;
  for (uint64_t left = tile.cells; left != 0; left &= left - 1) {
    const BodyList list = lists[static_cast<uint32_t>(std::countr_zero(left))];
    STAGE_ASSERT(list != 0 && (list & kListFlag) == 0);
    if (only != 0 && list != only) return;
    only = list;
  }
  SetBodies(slot, only);
  lists_.Give(index, edit->lists());
}

/// Subset of `layers` in which no body of the list shows.
uint32_t Grid::UncoveredLayers(BodyList list, uint32_t layers) const {
  AnyOf(list, [&](BodyId other) {
    layers &= ~bodies_[other].layers;
    return layers == 0;
  });
  return layers;
}

/// The body with the latest stamp in the list, which must not be empty.
BodyId Grid::LastOf(BodyList list) const {
  return list & kListFlag ? nodes_[nodes_[list & ~kListFlag].previous].id : list - 1;
}

void Grid::Append(BodyList* list, BodyId id, Edit* edit) {
  STAGE_ASSERT(*list != 0 && *list != id + 1);
  STAGE_ASSERT(stamps_[LastOf(*list)] < stamps_[id]);
  const uint32_t node = MakeNode(id, edit);
  if (!(*list & kListFlag)) {
    const uint32_t first = MakeNode(*list - 1, edit);
    nodes_[first].next = nodes_[first].previous = node;
    nodes_[node].next = nodes_[node].previous = first;
    *list = kListFlag | first;
    return;
  }
  const uint32_t first = *list & ~kListFlag, last = nodes_[first].previous;
  STAGE_ASSERT(nodes_[last].next == first);
  nodes_[node].next = first;
  nodes_[node].previous = last;
  nodes_[last].next = nodes_[first].previous = node;
}

/// Precondition: the list has several bodies.
void Grid::RemoveFrom(BodyList* list, BodyId id, Edit* edit) {
  STAGE_ASSERT((*list & kListFlag) != 0);
  const uint32_t first = *list & ~kListFlag, node = FindNode(first, id);
  const uint32_t next = nodes_[node].next, previous = nodes_[node].previous;
  STAGE_ASSERT(next != node && nodes_[next].previous == node && nodes_[previous].next == node);
  nodes_[previous].next = next;
  nodes_[next].previous = previous;
  if (node == first) *list = kListFlag | next;
  nodes_.Give(node, edit->nodes());
  if (next != previous) return;
  // Lists of a single body have no nodes.
  *list = nodes_[next].id + 1;
  nodes_.Give(next, edit->nodes());
}

/// Searches from both ends, because the body that leaves a cell is often the oldest or the newest.
uint32_t Grid::FindNode(uint32_t first, BodyId id) const {
  uint32_t old = first, young = nodes_[first].previous;
  for (;;) {
    if (nodes_[old].id == id) return old;
    if (nodes_[young].id == id) return young;
    old = nodes_[old].next;
    young = nodes_[young].previous;
    STAGE_ASSERT(old != first);  // the body must be in the list
  }
}

uint32_t Grid::MakeNode(BodyId id, Edit* edit) {
  STAGE_ASSERT(id < bodies_.size());
  const uint32_t node = nodes_.Take(edit->nodes());
  STAGE_ASSERT((node & kListFlag) == 0);
  nodes_[node] = {id, 0, 0};
  return node;
}

// ---- several threads at once --------------------------------------------------------------------

void Grid::BeginConcurrentEdit(const EditSize& limits, std::vector<Edit>* edits) {
  STAGE_ASSERT(!edits->empty());
  lists_.BeginConcurrentUse(limits.sets, edits->size());
  // A cell needs up to two nodes: if it held one body, both bodies get nodes.
  nodes_.BeginConcurrentUse(2 * limits.cells, edits->size());
  outline_fragments_.BeginConcurrentUse(limits.exact_sets, edits->size());
  for (Edit& edit : *edits) {
    edit.own_lists.Prepare();
    edit.own_nodes.Prepare();
    edit.own_outlines.Prepare();
  }
  for (Edit& edit : *edits) {
    STAGE_ASSERT(edit.rasterized_cells == 0 && edit.empty_regions == 0 && edit.extent.empty());
    edit.shared = true;
    edit.first_stamp = edit.last_stamp = serial_edit_.last_stamp;
  }
  serial_edit_.last_stamp += limits.bodies;
}

void Grid::EndConcurrentEdit(std::vector<Edit>* edits) {
  lists_.EndConcurrentUse();
  nodes_.EndConcurrentUse();
  outline_fragments_.EndConcurrentUse();
  for (Edit& edit : *edits) {
    STAGE_ASSERT(edit.last_stamp <=
                 serial_edit_.last_stamp);  // EditSize::bodies was an upper bound
    lists_.ReturnCache(edit.lists());
    nodes_.ReturnCache(edit.nodes());
    outline_fragments_.ReturnCache(edit.outlines());
    serial_edit_.rasterized_cells += std::exchange(edit.rasterized_cells, 0);
    serial_edit_.empty_regions += std::exchange(edit.empty_regions, 0);
    if (!edit.extent.empty()) Include(&serial_edit_.extent, std::exchange(edit.extent, CellBox()));
  }
  STAGE_ASSERT(serial_edit_.rasterized_cells >= 0 && serial_edit_.empty_regions >= 0);
  DropRegionsIfManyAreEmpty();
}

void Grid::Restamp(BodyId id, uint64_t stamp, std::span<const CellSet> sets) {
  STAGE_ASSERT(id < bodies_.size() && stamp <= serial_edit_.last_stamp);
  stamps_[id] = stamp;
  if (bodies_[id].exact()) return;  // lists of exact cells have no order
  for (const CellSet& set : sets)
    ForEachBit(Crowded(set), [&](uint32_t bit) {
      SortIn(&lists_[tiles_[set.slot].bodies & ~kListFlag][bit], id);
    });
}

void Grid::ChangeTile(BodyId id, uint32_t slot, uint64_t from, uint64_t to) {
  STAGE_ASSERT(id < bodies_.size() && !bodies_[id].exact() && IsInRegion(slot));
  const TileCells& tile = tiles_[slot];
  const uint64_t added = to & ~from;
  if (tile.bodies != 0 && tile.bodies != id + 1) {  // others are in the tile
    lists_.ReserveFree(1);
    nodes_.ReserveFree(2 * kTilesPerRegion);
  }
  if (added != 0) {
    const uint64_t stamp = stamps_[id];
    stamps_[id] = serial_edit_.last_stamp + 1;  // the body is appended to lists
    AddToTile(slot, added, id, &serial_edit_);
    stamps_[id] = stamp;
    ForEachBit(added & tile.crowded,
               [&](uint32_t bit) { SortIn(&lists_[tile.bodies & ~kListFlag][bit], id); });
  }
  RemoveFromTile(slot, from & ~to, id, &serial_edit_);
}

/// Moves a body to the place that its stamp demands. The rest of the list is sorted already.
void Grid::SortIn(BodyList* list, BodyId id) {
  STAGE_ASSERT((*list & kListFlag) != 0);
  const uint32_t node = FindNode(*list & ~kListFlag, id);
  const uint32_t next = nodes_[node].next, previous = nodes_[node].previous;
  uint32_t first = *list & ~kListFlag;
  if (first == node) first = next;
  nodes_[previous].next = next;
  nodes_[next].previous = previous;
  uint32_t before = first;  // first node with a later stamp, or the head if there is none
  bool is_last = false;
  while (stamps_[nodes_[before].id] < stamps_[id] && !is_last) {
    before = nodes_[before].next;
    is_last = before == first;
  }
  nodes_[node].next = before;
  nodes_[node].previous = nodes_[before].previous;
  nodes_[nodes_[before].previous].next = node;
  nodes_[before].previous = node;
  *list = kListFlag | (before == first && !is_last ? node : first);
}

/// Recomputes the cells of the cell set in all layers of thin outlines.
void Grid::RefreshCells(const CellSet& set) {
  const uint32_t all = LayersOfKind(false);
  ForEachCell(set, [&](CellRef cell) {
    uint32_t occupied_in = 0;
    AnyIn(cell, [&](BodyId id) {
      occupied_in |= bodies_[id].layers;
      return false;
    });
    const uint64_t bit = uint64_t{1} << (cell & 63);
    SetBits(occupied_in, set.slot, bit);
    ClearBits(all & ~occupied_in, set.slot, bit);
  });
}

void Grid::Coordinates(CellRef cell, int32_t* x, int32_t* y) const {
  STAGE_ASSERT(cell >> 12 != 0 && cell >> 12 < regions_.size());
  const Region& region = regions_[static_cast<uint32_t>(cell >> 12)];
  const Super& super = supers_[region.super];
  const auto coordinate = [&](int32_t s, uint32_t r, CellRef tile, CellRef bit) {
    return s << RAY_SUPER_SHIFT |
           static_cast<int32_t>(r << RAY_REGION_SHIFT | (tile & 7) << RAY_TILE_SHIFT | (bit & 7));
  };
  *x = coordinate(super.x, region.place & 15, cell >> 6, cell);
  *y = coordinate(super.y, region.place >> 4, cell >> 9, cell >> 3);
}

// ---- regions, superregions ----------------------------------------------------------------------

bool Grid::FindSlots(std::span<CellSet> sets) const {
  bool all = true;
  FillInSlots(sets, [&](int32_t x, int32_t y) {
    const uint32_t region = FindRegion(x, y);
    all &= region != 0;
    return region;
  });
  return all;
}

void Grid::MakeSlots(std::span<CellSet> sets) {
  FillInSlots(sets, [&](int32_t x, int32_t y) { return MakeRegion(x, y); });
}

/// Calls f(x, y), with one cell of each region in the rectangle, until f returns false.
template <typename F>
void Grid::ForEachRegionOf(const CellBox& tiles, F f) {
  constexpr int kShift = RAY_REGION_SHIFT - RAY_TILE_SHIFT;
  if (tiles.empty()) return;
  for (int32_t y = tiles.min_y >> kShift; y <= tiles.max_y >> kShift; y++)
    for (int32_t x = tiles.min_x >> kShift; x <= tiles.max_x >> kShift; x++)
      if (!f(x << RAY_REGION_SHIFT, y << RAY_REGION_SHIFT)) return;
}

bool Grid::HasRegions(const CellBox& tiles) const {
  bool all = true;
  ForEachRegionOf(tiles, [&](int32_t x, int32_t y) { return all = FindRegion(x, y) != 0; });
  return all;
}

void Grid::MakeRegions(const CellBox& tiles) {
  ForEachRegionOf(tiles, [&](int32_t x, int32_t y) { return MakeRegion(x, y) != 0; });
}

/// Fills in the slots of the cell sets. region_of(x, y) returns the region of a cell, or 0.
template <typename F>
void Grid::FillInSlots(std::span<CellSet> sets, F region_of) {
  constexpr int kShift = RAY_REGION_SHIFT - RAY_TILE_SHIFT;
  const CellSet* before = nullptr;
  uint32_t region = 0;
  for (CellSet& set : sets) {
    const int32_t x = set.x << RAY_TILE_SHIFT, y = set.y << RAY_TILE_SHIFT;
    const bool same = before != nullptr && before->x >> kShift == set.x >> kShift &&
                      before->y >> kShift == set.y >> kShift;
    if (!same) region = region_of(x, y);
    set.slot = region == 0 ? 0 : region * kTilesPerRegion + TileOf(x, y);
    before = &set;
  }
}

uint32_t Grid::FindRegion(int32_t x, int32_t y) const {
  ray_grid_t view{};
  view.directory = directory_.data();
  view.directory_mask = static_cast<uint32_t>(directory_.size() - 1);
  const uint32_t super = ray_find_super(&view, x >> RAY_SUPER_SHIFT, y >> RAY_SUPER_SHIFT);
  if (super == 0) return 0;
  const int32_t place = ray_place(x >> RAY_REGION_SHIFT, y >> RAY_REGION_SHIFT, 4);
  return region_tables_[super * kRegionsPerSuper + static_cast<uint32_t>(place)];
}

uint32_t Grid::MakeRegion(int32_t x, int32_t y) {
  uint32_t region = FindRegion(x, y);
  if (region != 0) return region;
  if (free_regions_.empty()) AddFreeRegion();
  const uint32_t super = MakeSuper(x >> RAY_SUPER_SHIFT, y >> RAY_SUPER_SHIFT);
  STAGE_ASSERT(super != 0 && super < supers_.size() && supers_[super].in_use);
  region = free_regions_.back();
  STAGE_ASSERT(region != 0 && regions_[region].tiles == 0);  // empty since it was dropped
  free_regions_.pop_back();
  const int32_t rx = x >> RAY_REGION_SHIFT, ry = y >> RAY_REGION_SHIFT;
  const uint32_t place = static_cast<uint32_t>(ray_place(rx, ry, 4));
  regions_[region] = {super, place, 0};
  serial_edit_.empty_regions++;
  STAGE_ASSERT(region_tables_[super * kRegionsPerSuper + place] == 0);
  region_tables_[super * kRegionsPerSuper + place] = region;
  supers_[super].regions++;
  Include(&occupied_, SquareBox(rx, ry, RAY_REGION_SHIFT));
  structure_version_++;
  return region;
}

/// Allocates before it counts the region, so that bad_alloc does not leave half a region.
void Grid::AddFreeRegion() {
  const size_t count = regions_.size() + 1;
  ReserveFor(count, &free_regions_);  // so that DropEmptyRegions() does not allocate
  tiles_.resize(count * kTilesPerRegion);
  if (outlines_.size() > 0) outlines_.resize(count * kTilesPerRegion);
  changed_bodies_.Resize(count);
  changed_outlines_.Resize(count);
  for (Layer& layer : layers_) layer.cells.Resize(static_cast<uint32_t>(count));
  regions_.emplace_back();
  free_regions_.push_back(static_cast<uint32_t>(count - 1));
}

void Grid::WidenExtent(std::span<const CellSet> sets) {
  for (const CellSet& set : sets) Include(&serial_edit_.extent, SuperOf(set.slot));
}

bool Grid::LiesInExtent() const {
  const CellBox& all = serial_edit_.extent;
  for (uint32_t slot = 0; slot < tiles_.size(); slot++) {
    if (tiles_[slot].cells == 0) continue;
    const CellBox box = SuperOf(slot);
    if (box.min_x < all.min_x || box.min_y < all.min_y || box.max_x > all.max_x ||
        box.max_y > all.max_y)
      return false;
  }
  return true;
}

/// Cells of the superregion that contains the tile. The tile's region must exist.
CellBox Grid::SuperOf(uint32_t slot) const {
  STAGE_ASSERT(IsInRegion(slot));
  const Super& super = supers_[regions_[slot / kTilesPerRegion].super];
  return SquareBox(super.x, super.y, RAY_SUPER_SHIFT);
}

uint32_t Grid::MakeSuper(int32_t x, int32_t y) {
  const ray_grid_t view = View(kEverything);
  uint32_t super = ray_find_super(&view, x, y);
  if (super != 0) return super;
  if (free_supers_.empty()) AddFreeSuper();
  // The directory is rebuilt only when it must grow. A rebuild per superregion would take quadratic
  // time for scattered bodies.
  if (directory_.size() < kSlotsPerSuper * (CountSupers() + 1)) RebuildDirectory(CountSupers() + 1);
  super = free_supers_.back();
  free_supers_.pop_back();
  STAGE_ASSERT(super != 0 && !supers_[super].in_use && supers_[super].regions == 0);
  supers_[super] = {x, y, 0, true};
  Enter(super);
  structure_version_++;
  return super;
}

void Grid::AddFreeSuper() {
  const size_t count = supers_.size() + 1;
  ReserveFor(count, &free_supers_);  // so that DropEmptyRegions() does not allocate
  region_tables_.resize(count * kRegionsPerSuper, 0);
  region_maps_.resize(count * kMapsPerSuper, 0);
  supers_.emplace_back();
  free_supers_.push_back(static_cast<uint32_t>(count - 1));
}

/// Sets or clears the region's bit in its region map.
void Grid::MarkRegion(const Region& region, bool filled) {
  const std::atomic_ref<uint64_t> map(region_maps_[MapOf(region.super, region.place)]);
  const uint64_t bit = uint64_t{1} << ((region.place & 7) | (region.place >> 4 & 7) << 3);
  if (filled)
    map.fetch_or(bit, std::memory_order_acq_rel);
  else
    map.fetch_and(~bit, std::memory_order_acq_rel);
}

// Other threads may count tiles of the same region concurrently.
void Grid::CountFilledTile(uint32_t slot, Edit* edit) {
  STAGE_ASSERT(IsInRegion(slot));
  Region& region = regions_[slot / kTilesPerRegion];
  const std::atomic_ref<uint32_t> tiles(region.tiles);
  const uint32_t before = tiles.fetch_add(1, std::memory_order_relaxed);
  STAGE_ASSERT(before < kTilesPerRegion);
  if (before != 0) return;
  edit->empty_regions--;
  MarkRegion(region, true);
}
void Grid::CountEmptiedTile(uint32_t slot, Edit* edit) {
  STAGE_ASSERT(IsInRegion(slot));
  Region& region = regions_[slot / kTilesPerRegion];
  const std::atomic_ref<uint32_t> tiles(region.tiles);
  const uint32_t before = tiles.fetch_sub(1, std::memory_order_relaxed);
  STAGE_ASSERT(before > 0);
  if (before != 1) return;
  edit->empty_regions++;
  MarkRegion(region, false);
  // Another thread may have filled a tile and set the mark before it was cleared above.
  if (tiles.load(std::memory_order_relaxed) != 0) MarkRegion(region, true);
}

/// Keeps empty regions until there are many, because robots often return to regions they left.
void Grid::DropRegionsIfManyAreEmpty() {
  constexpr int64_t kFew = 256;
  const int64_t many = std::max(kFew, static_cast<int64_t>(CountRegions() / 2));
  if (serial_edit_.empty_regions > many) DropEmptyRegions();
}

/// Does not allocate, because destructors erase bodies.
void Grid::DropEmptyRegions() {
  for (uint32_t super = 1; super < supers_.size(); super++) {
    if (supers_[super].regions == 0) continue;
    for (uint32_t place = 0; place < kRegionsPerSuper; place++) {
      uint32_t& region = region_tables_[super * kRegionsPerSuper + place];
      if (region == 0 || regions_[region].tiles != 0) continue;
      STAGE_ASSERT(supers_[super].in_use && regions_[region].super == super);
      free_regions_.push_back(region);
      region = 0;
      serial_edit_.empty_regions--;
      if (--supers_[super].regions > 0) continue;
      supers_[super].in_use = false;
      free_supers_.push_back(super);
    }
  }
  STAGE_ASSERT(serial_edit_.empty_regions == 0);
  RebuildDirectory(CountSupers());
  RecomputeOccupied();
}

/// Rebuilds the directory with capacity for `supers` superregions.
void Grid::RebuildDirectory(size_t supers) {
  size_t slots = 16;
  while (slots < kSlotsPerSuper * supers) slots *= 2;
  directory_.assign(slots, ray_super_t{0, 0, 0, 0});
  for (uint32_t super = 1; super < supers_.size(); super++)
    if (supers_[super].in_use) Enter(super);
  structure_version_++;
}

/// Inserts a superregion into the directory, which must have a free slot.
void Grid::Enter(uint32_t super) {
  const uint32_t mask = static_cast<uint32_t>(directory_.size() - 1);
  STAGE_ASSERT(directory_.size() > CountSupers() && (directory_.size() & mask) == 0);
  uint32_t slot = ray_hash(supers_[super].x, supers_[super].y) & mask;
  while (directory_[slot].index != 0) slot = (slot + 1) & mask;
  directory_[slot] = {supers_[super].x, supers_[super].y, super, 0};
  entered_++;
}

void Grid::RecomputeOccupied() {
  occupied_ = CellBox();
  for (uint32_t super = 1; super < supers_.size(); super++) {
    if (supers_[super].regions == 0) continue;
    for (uint32_t place = 0; place < kRegionsPerSuper; place++) {
      if (region_tables_[super * kRegionsPerSuper + place] == 0) continue;
      const int32_t rx = supers_[super].x * 16 + static_cast<int32_t>(place & 15);
      const int32_t ry = supers_[super].y * 16 + static_cast<int32_t>(place >> 4);
      Include(&occupied_, SquareBox(rx, ry, RAY_REGION_SHIFT));
    }
  }
}

Grid::Statistics Grid::statistics() const {
  Statistics s;
  s.superregions = CountSupers();
  s.entered = entered_;
  s.regions = CountRegions();
  s.tiles = 0;
  for (const Region& region : regions_) s.tiles += region.tiles;
  const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
  s.bytes = bytes(bodies_) + bytes(tiles_) + lists_.bytes() + nodes_.bytes() + bytes(outlines_) +
            outline_fragments_.bytes() + bytes(regions_) + bytes(region_tables_) +
            bytes(region_maps_) + bytes(directory_);
  for (const Layer& layer : layers_) s.bytes += layer.cells.bytes();
  return s;
}

}  // namespace Stg::internal::grid
