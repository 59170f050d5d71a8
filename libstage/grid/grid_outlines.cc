// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exact rasterization: which outlines lie in which tiles.

#include <algorithm>

#include "grid/grid.hh"
#include "messages/assert.hh"

namespace Stg::internal::grid {

void Grid::RasterizeOutline(BodyId id, std::span<const CellSet> from, std::span<CellSet> to,
                            Edit* edit) {
  if (edit->shared) {
    [[maybe_unused]] const bool all_exist = FindSlots(to);
    STAGE_ASSERT(all_exist);
  } else {
    MakeSlots(to);
    outline_fragments_.ReserveFree(to.size());
  }
  size_t next = 0;
  for (const CellSet& set : to) {
    while (next < from.size() && from[next].ComesBefore(set)) RemoveOutline(from[next++], id, edit);
    if (next < from.size() && from[next].SameTile(set))
      ChangeOutline(from[next++], set, id);
    else
      AddOutline(set, id, edit);
  }
  while (next < from.size()) RemoveOutline(from[next++], id, edit);
  if (!edit->shared) DropRegionsIfManyAreEmpty();
}

void Grid::AddOutline(const CellSet& set, BodyId id, Edit* edit) {
  STAGE_ASSERT(set.slot >= kTilesPerRegion && set.slot < tiles_.size());
  STAGE_ASSERT(set.cells != 0 && set.edges >> (bodies_[id].edges - 1) >> 1 == 0);
  STAGE_ASSERT(!HasOutline(set.slot, id));
  if (IsEmpty(set.slot)) CountFilledTile(set.slot, edit);
  const uint32_t number = outline_fragments_.Take(edit->outlines());
  OutlineList& first = outlines_[set.slot];
  outline_fragments_[number] = {set.cells, id, set.edges, first};
  first = number;
  changed_outlines_.Note(set.slot);
  SetBits(bodies_[id].layers, set.slot, set.cells);
}

void Grid::ChangeOutline(const CellSet& from, const CellSet& to, BodyId id) {
  STAGE_ASSERT(from.slot == to.slot);
  OutlineFragment& fragment = outline_fragments_[*FindOutline(to.slot, id)];
  STAGE_ASSERT(fragment.cells == from.cells && fragment.edges == from.edges);
  if (fragment.edges != to.edges) changed_outlines_.Note(to.slot);
  fragment.cells = to.cells;
  fragment.edges = to.edges;
  ClearOutlineCells(to.slot, from.cells & ~to.cells, id);
  SetBits(bodies_[id].layers, to.slot, to.cells & ~from.cells);
}

void Grid::RemoveOutline(const CellSet& set, BodyId id, Edit* edit) {
  OutlineList* const place = FindOutline(set.slot, id);
  const uint32_t number = *place;
  STAGE_ASSERT(outline_fragments_[number].cells == set.cells);
  *place = outline_fragments_[number].next;
  outline_fragments_.Give(number, edit->outlines());
  changed_outlines_.Note(set.slot);
  ClearOutlineCells(set.slot, set.cells, id);
  if (IsEmpty(set.slot)) CountEmptiedTile(set.slot, edit);
}

bool Grid::HasOutline(uint32_t slot, BodyId id) const {
  bool has = false;
  ForEachOutline(OutlinesIn(slot),
                 [&](const OutlineFragment& fragment) { has = has || fragment.id == id; });
  return has;
}

/// Clears `cells` in the body's layers, except cells that other bodies of the layer still cover.
void Grid::ClearOutlineCells(uint32_t slot, uint64_t cells, BodyId id) {
  if (cells == 0) return;
  ForEachBit(bodies_[id].layers, [&](uint32_t layer) {
    uint64_t others = 0;
    ForEachOutline(outlines_[slot], [&](const OutlineFragment& fragment) {
      if (fragment.id != id && (bodies_[fragment.id].layers >> layer & 1) != 0)
        others |= fragment.cells;
    });
    ClearBits(1u << layer, slot, cells & ~others);
  });
}

/// Address of the list link to the body's outline in the tile, which must exist.
OutlineList* Grid::FindOutline(uint32_t slot, BodyId id) {
  OutlineList* place = &outlines_[slot];
  STAGE_ASSERT(HasOutline(slot, id));  // otherwise the loop would not end
  while (outline_fragments_[*place].id != id) place = &outline_fragments_[*place].next;
  return place;
}

/// Recomputes the tile in all layers of exact outlines.
void Grid::RefreshOutlines(uint32_t slot) {
  ForEachBit(LayersOfKind(true), [&](uint32_t layer) {
    uint64_t cells = 0;
    ForEachOutline(OutlinesIn(slot), [&](const OutlineFragment& fragment) {
      if ((bodies_[fragment.id].layers >> layer & 1) != 0) cells |= fragment.cells;
    });
    SetBits(1u << layer, slot, cells);
    ClearBits(1u << layer, slot, ~cells);
  });
}

void Grid::ForgetChangedOutlines() const {
  changed_outlines_.Forget();
  std::fill(changed_exact_bodies_.begin(), changed_exact_bodies_.end(), uint8_t{0});
}

/// Another grid, and one with another layer, has other layers of outlines.
uint64_t Grid::OutlinesVersion() const {
  uint64_t version = 0;
  for (const Layer& layer : layers_) version = 31 * version + (layer.exact ? layer.cells.id() : 0);
  return version;
}

}  // namespace Stg::internal::grid
