// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tests whether proposed placements collide with other bodies.

#include "grid/grid.hh"
#include "models/host.hh"
#include "models/model.hh"
#include "models/placement.hh"
#include "sensing/scene.hh"

namespace Stg {

Model* Placement::Collision(Model* ground) const {
  for (const Item& item : items_) {
    if (!item.model->vis.obstacle_return) continue;
    if (item.z.min < 0) return ground;
    if (Model* hit = CollisionOf(item)) return hit;
  }
  return nullptr;
}

Model* Placement::CollisionOf(const Item& item) const {
  const grid::Grid& grid = item.model->scene().grid;
  const void* tree = item.model->Root();
  Model* hit = nullptr;
  const auto runs_into = [&](grid::BodyId id) {
    const grid::Body& other = grid.body(id);
    if (other.tree == tree || !other.model->vis.obstacle_return) return false;
    if (other.z_min > item.z.max || other.z_max < item.z.min) return false;
    hit = other.model;
    return true;
  };

  const auto probe = [&](uint32_t slot, uint64_t cells) {
    grid::ForEachCell({.slot = slot, .cells = cells}, [&](grid::CellRef cell) {
      if (hit == nullptr) grid.AnyIn(cell, runs_into);
    });
  };

  // In cells where the body already is, only those with several bodies matter.
  const std::vector<grid::CellSet>& now = item.block->cells_;
  if (!item.moved) {
    for (const grid::CellSet& set : now) probe(set.slot, grid.Crowded(set));
    return hit;
  }
  auto next = now.begin();
  for (const grid::CellSet& set : NewCellsOf(item)) {
    while (next != now.end() && next->ComesBefore(set)) ++next;
    if (next != now.end() && next->SameTile(set))
      probe(next->slot, set.cells & ~(next->cells & ~grid.Crowded(*next)));
    else
      probe(set.slot != 0 ? set.slot : grid.FindTileSlot(set), set.cells);
    if (hit != nullptr) return hit;
  }
  return nullptr;
}

}  // namespace Stg
