// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exact rasterization: which outlines lie in which tiles.

#include "grid/grid.hh"
#include "messages/assert.hh"

namespace Stg::internal::grid {

void Grid::RedrawOutline(BodyId id, std::span<const TilePart> from, std::span<TilePart> to,
                         Edit* edit) {
  if (edit->shared) {
    [[maybe_unused]] const bool all_exist = FindSlots(to);
    STAGE_ASSERT(all_exist);
  } else {
    MakeSlots(to);
    outline_parts_.PrepareToTake(to.size());
  }
  size_t next = 0;
  for (const TilePart& part : to) {
    while (next < from.size() && from[next].ComesBefore(part)) EraseOutline(from[next++], id, edit);
    if (next < from.size() && from[next].SameTile(part))
      ChangeOutline(from[next++], part, id);
    else
      DrawOutline(part, id, edit);
  }
  while (next < from.size()) EraseOutline(from[next++], id, edit);
  if (!edit->shared) DropRegionsIfManyAreEmpty();
}

void Grid::DrawOutline(const TilePart& part, BodyId id, Edit* edit) {
  STAGE_ASSERT(part.slot >= kTilesPerRegion && part.slot < tiles_.size());
  STAGE_ASSERT(part.cells != 0 && part.edges >> (bodies_[id].edges - 1) >> 1 == 0);
  STAGE_ASSERT(!HasOutline(part.slot, id));
  if (IsEmpty(part.slot)) CountFilledTile(part.slot, edit);
  const uint32_t number = outline_parts_.Take(edit->outlines());
  OutlineList& first = outlines_[part.slot];
  outline_parts_[number] = {part.cells, id, part.edges, first};
  first = number;
  SetBits(bodies_[id].layers, part.slot, part.cells);
}

void Grid::ChangeOutline(const TilePart& from, const TilePart& to, BodyId id) {
  STAGE_ASSERT(from.slot == to.slot);
  OutlinePart& part = outline_parts_[*FindOutline(to.slot, id)];
  STAGE_ASSERT(part.cells == from.cells && part.edges == from.edges);
  part.cells = to.cells;
  part.edges = to.edges;
  HideOutline(to.slot, from.cells & ~to.cells, id);
  SetBits(bodies_[id].layers, to.slot, to.cells & ~from.cells);
}

void Grid::EraseOutline(const TilePart& part, BodyId id, Edit* edit) {
  OutlineList* const place = FindOutline(part.slot, id);
  const uint32_t number = *place;
  STAGE_ASSERT(outline_parts_[number].cells == part.cells);
  *place = outline_parts_[number].next;
  outline_parts_.Give(number, edit->outlines());
  HideOutline(part.slot, part.cells, id);
  if (IsEmpty(part.slot)) CountEmptiedTile(part.slot, edit);
}

bool Grid::HasOutline(uint32_t slot, BodyId id) const {
  bool has = false;
  ForEachOutline(OutlinesIn(slot), [&](const OutlinePart& part) { has = has || part.id == id; });
  return has;
}

/// Clears `cells` in the body's layers, except cells that other bodies of the layer still cover.
void Grid::HideOutline(uint32_t slot, uint64_t cells, BodyId id) {
  if (cells == 0) return;
  ForEachBit(bodies_[id].layers, [&](uint32_t layer) {
    uint64_t others = 0;
    ForEachOutline(outlines_[slot], [&](const OutlinePart& part) {
      if (part.id != id && (bodies_[part.id].layers >> layer & 1) != 0) others |= part.cells;
    });
    ClearBits(1u << layer, slot, cells & ~others);
  });
}

/// Address of the list link to the body's outline in the tile, which must exist.
OutlineList* Grid::FindOutline(uint32_t slot, BodyId id) {
  OutlineList* place = &outlines_[slot];
  STAGE_ASSERT(HasOutline(slot, id));  // otherwise the loop would not end
  while (outline_parts_[*place].id != id) place = &outline_parts_[*place].next;
  return place;
}

/// Recomputes the tile in all layers of exact outlines.
void Grid::RefreshOutlines(uint32_t slot) {
  ForEachBit(LayersOfDrawing(true), [&](uint32_t layer) {
    uint64_t cells = 0;
    ForEachOutline(OutlinesIn(slot), [&](const OutlinePart& part) {
      if ((bodies_[part.id].layers >> layer & 1) != 0) cells |= part.cells;
    });
    SetBits(1u << layer, slot, cells);
    ClearBits(1u << layer, slot, ~cells);
  });
}

}  // namespace Stg::internal::grid
