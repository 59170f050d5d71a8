// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/move_phase.hh"

#include <algorithm>
#include <typeinfo>

#include "models/position.hh"
#include "sensing/scene.hh"

namespace Stg {

namespace {

constexpr size_t kAtOnce = 4096;     // movers; so that their plans stay in the cache
constexpr int64_t kMostTiles = 256;  // a mover that uses more moves alone
constexpr size_t kGrain = 16;

grid::CellBox TilesOf(const grid::CellBox& cells) {
  if (cells.empty()) return cells;
  return {cells.min_x >> RAY_TILE_SHIFT, cells.min_y >> RAY_TILE_SHIFT,
          cells.max_x >> RAY_TILE_SHIFT, cells.max_y >> RAY_TILE_SHIFT};
}

int64_t CountOf(const grid::CellBox& tiles) {
  return (int64_t{tiles.max_x} - tiles.min_x + 1) * (int64_t{tiles.max_y} - tiles.min_y + 1);
}

template <typename F>
void ForEachTile(const grid::CellBox& tiles, F f) {
  for (int32_t y = tiles.min_y; y <= tiles.max_y; y++)
    for (int32_t x = tiles.min_x; x <= tiles.max_x; x++) f(x, y);
}

}  // namespace

void TileRanks::Clear(size_t tiles) {
  size_t size = 1024;
  while (size < 2 * tiles) size *= 2;
  if (entries_.size() < size) entries_.assign(size, Entry{round_, 0, 0, 0});
  round_++;
}

TileRanks::Entry& TileRanks::EntryOf(int32_t x, int32_t y) {
  const size_t mask = entries_.size() - 1;
  size_t place = ray_hash(x, y) & mask;
  for (;; place = (place + 1) & mask) {
    Entry& entry = entries_[place];
    if (entry.round == round_ && (entry.x != x || entry.y != y)) continue;
    if (entry.round != round_) entry = {round_, x, y, 0};
    return entry;
  }
}

uint32_t TileRanks::Add(const grid::CellBox& tiles) {
  uint32_t rank = 0;
  of_box_.clear();
  ForEachTile(tiles, [&](int32_t x, int32_t y) {
    Entry& entry = EntryOf(x, y);
    rank = std::max(rank, entry.next_rank);
    of_box_.push_back(&entry);
  });
  for (Entry* entry : of_box_) entry->next_rank = rank + 1;
  return rank;
}

namespace {

/// A robot that stands by itself and moves as ModelPosition does.
bool MovesPlainly(const Model& model) {
  return model.Parent() == nullptr && typeid(model) == typeid(ModelPosition);
}

}  // namespace

size_t MovePhase::Move(Model* const* models, size_t count, sensing::Scene* scene,
                       sensing::WorkerPool* workers) {
  if (workers->threads() == 1 || scene->exact_drawing) return 0;
  count = runs_.Find(count, [&] {
    return workers->FindFirst(count, [&](size_t i) { return !MovesPlainly(*models[i]); });
  });
  if (count == 0 || Placement::IsNearlyFull(*models[0])) return 0;
  grid_ = &scene->grid;
  edits_.resize(workers->threads());
  for (size_t begin = 0; begin < count; begin += kAtOnce)
    MovePart(models + begin, std::min(kAtOnce, count - begin), workers);
  return count;
}

void MovePhase::MovePart(Model* const* models, size_t count, sensing::WorkerPool* workers) {
  MakePlans(models, count, workers);
  size_t begin = 0;
  for (size_t i = 0; i < count; i++) {
    Plan& plan = plans_[i];
    if (plan.kind != Plan::kAlone) continue;
    MoveRanks(begin, i, workers);
    if (plan.model->EndMove(plan.placement)) plan.placement.Commit();
    begin = i + 1;
  }
  MoveRanks(begin, count, workers);
}

void MovePhase::MakePlans(Model* const* models, size_t count, sensing::WorkerPool* workers) {
  if (plans_.size() < count) plans_.resize(count);
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    for (size_t i = begin; i < end; i++) {
      Plan& plan = plans_[i];
      plan.model = static_cast<ModelPosition*>(models[i]);
      plan.kind = Plan::kStays;
      if (plan.model->BeginMove(&plan.placement)) Describe(&plan, *grid_);
    }
  });
}

void MovePhase::Describe(Plan* plan, const grid::Grid& grid) {
  const Placement& placement = plan->placement;
  plan->tiles = TilesOf(placement.Cells());
  plan->new_cells = placement.CountNewCells();
  plan->kind =
      placement.MayShareEdit() && CountOf(plan->tiles) <= kMostTiles ? Plan::kShared : Plan::kAlone;
  if (plan->kind == Plan::kAlone) return;
  plan->new_tiles = TilesOf(placement.NewCells());
  plan->tiles_missing = false;
  ForEachTile(plan->new_tiles,
              [&](int32_t x, int32_t y) { plan->tiles_missing |= !grid.HasTile(x, y); });
}

/// Moves those of [begin, end) that share the grid.
void MovePhase::MoveRanks(size_t begin, size_t end, sensing::WorkerPool* workers) {
  if (begin == end) return;
  grid_->BeginSharedEdit(AssignRanks(begin, end), &edits_);
  SortByRank(begin, end);
  uint32_t first = 0;
  for (const uint32_t rank_end : rank_ends_) {
    const uint32_t* movers = order_.data() + first;
    const size_t count = rank_end - first;
    workers->Run(count, workers->Grain(count, kGrain),
                 [&](size_t from, size_t to, unsigned thread) {
                   for (size_t i = from; i < to; i++) {
                     Plan& plan = plans_[movers[i]];
                     if (plan.model->EndMove(plan.placement))
                       plan.placement.Commit(&edits_[thread]);
                   }
                 });
    first = rank_end;
  }
  grid_->EndSharedEdit(&edits_);
}

/// Ranks, and room in the grid. Returns how many cells may be drawn.
size_t MovePhase::AssignRanks(size_t begin, size_t end) {
  size_t tiles = 0, cells = 0;
  for (size_t i = begin; i < end; i++)
    if (plans_[i].kind == Plan::kShared) tiles += static_cast<size_t>(CountOf(plans_[i].tiles));
  ranks_.Clear(tiles);
  for (size_t i = begin; i < end; i++) {
    Plan& plan = plans_[i];
    if (plan.kind != Plan::kShared) continue;
    plan.rank = ranks_.Add(plan.tiles);
    cells += plan.new_cells;
    // Tiles that were there may be gone if others of this part have moved since.
    if (plan.tiles_missing || begin > 0)
      ForEachTile(plan.new_tiles, [&](int32_t x, int32_t y) { grid_->PrepareTile(x, y); });
  }
  return cells;
}

void MovePhase::SortByRank(size_t begin, size_t end) {
  rank_ends_.clear();
  for (size_t i = begin; i < end; i++) {
    if (plans_[i].kind != Plan::kShared) continue;
    if (plans_[i].rank >= rank_ends_.size()) rank_ends_.resize(plans_[i].rank + 1, 0);
    rank_ends_[plans_[i].rank]++;
  }
  uint32_t sum = 0;
  for (uint32_t& end_of_rank : rank_ends_) {
    const uint32_t movers = end_of_rank;
    end_of_rank = sum;  // its begin, for now
    sum += movers;
  }
  order_.resize(sum);
  for (size_t i = begin; i < end; i++)
    if (plans_[i].kind == Plan::kShared)
      order_[rank_ends_[plans_[i].rank]++] = static_cast<uint32_t>(i);
}

}  // namespace Stg
