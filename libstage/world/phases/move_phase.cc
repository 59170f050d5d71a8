// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/move_phase.hh"

#include <algorithm>
#include <span>
#include <typeinfo>

#include "messages/assert.hh"
#include "models/actuator.hh"
#include "models/position.hh"
#include "sensing/scene.hh"
#include "world/engine.hh"

namespace Stg {

namespace {

constexpr size_t kAtOnce = 256;  // movers per thread, so that their plans stay in its cache
constexpr size_t kMostAtOnce = 4096;
constexpr int64_t kMostTiles = 256;  // a mover that uses more tiles moves alone
constexpr size_t kGrain = 16;
constexpr size_t kFew = 4;  // with fewer movers in a rank, waking threads does not pay
static_assert(kMostAtOnce <= TileClaims::kMost);

grid::CellBox TilesOf(const grid::CellBox& cells) {
  if (cells.empty()) return cells;
  return {cells.min_x >> RAY_TILE_SHIFT, cells.min_y >> RAY_TILE_SHIFT,
          cells.max_x >> RAY_TILE_SHIFT, cells.max_y >> RAY_TILE_SHIFT};
}

int64_t CountOf(const grid::CellBox& tiles) {
  return (int64_t{tiles.max_x} - tiles.min_x + 1) * (int64_t{tiles.max_y} - tiles.min_y + 1);
}

/// True if all parts are among the tiles.
[[maybe_unused]] bool LieIn(const grid::CellBox& tiles, std::span<const grid::TilePart> parts) {
  return std::ranges::all_of(parts, [&](const grid::TilePart& part) {
    return part.x >= tiles.min_x && part.x <= tiles.max_x && part.y >= tiles.min_y &&
           part.y <= tiles.max_y;
  });
}

}  // namespace

void TileRanks::Clear() {
  used_ = 0;
  round_++;
}

uint32_t TileRanks::Add(const grid::CellBox& tiles) {
  uint32_t rank = 0;
  FindParts(tiles);
  STAGE_ASSERT(std::ranges::all_of(parts_, [this](const Part& part) {
    return part.block < used_ && part.min_x >= 0 && part.min_y >= 0 && part.max_x < kSide &&
           part.max_y < kSide;
  }));
  ForEachRank([&](uint32_t next) { rank = std::max(rank, next); });
  ForEachRank([&](uint32_t& next) { next = rank + 1; });
  return rank;
}

/// Calls f(uint32_t&) for the next rank of each tile of the rectangle.
template <typename F>
void TileRanks::ForEachRank(F f) {
  for (const Part& part : parts_)
    for (int32_t y = part.min_y; y <= part.max_y; y++)
      for (int32_t x = part.min_x; x <= part.max_x; x++)
        f(blocks_[part.block].next_rank[y << kShift | x]);
}

void TileRanks::FindParts(const grid::CellBox& tiles) {
  parts_.clear();
  for (int32_t y = tiles.min_y >> kShift; y <= tiles.max_y >> kShift; y++)
    for (int32_t x = tiles.min_x >> kShift; x <= tiles.max_x >> kShift; x++) {
      const int32_t x0 = x << kShift, y0 = y << kShift;
      parts_.push_back({BlockOf(x, y), std::max(tiles.min_x - x0, 0), std::max(tiles.min_y - y0, 0),
                        std::min(tiles.max_x - x0, kSide - 1),
                        std::min(tiles.max_y - y0, kSide - 1)});
    }
}

uint32_t TileRanks::BlockOf(int32_t x, int32_t y) {
  if (slots_.size() <= size_t{2} * used_) MakeRoom();
  Slot& slot = SlotOf(x, y);
  if (slot.round == round_) return slot.block;
  if (used_ == blocks_.size()) blocks_.emplace_back();
  blocks_[used_] = {x, y, {}};
  slot = {round_, used_};
  return used_++;
}

/// Returns the block's slot, or the free slot where it belongs.
TileRanks::Slot& TileRanks::SlotOf(int32_t x, int32_t y) {
  STAGE_ASSERT(slots_.size() > used_);  // otherwise the loop might not end
  const size_t mask = slots_.size() - 1;
  for (size_t place = ray_hash(x, y) & mask;; place = (place + 1) & mask) {
    Slot& slot = slots_[place];
    if (slot.round != round_) return slot;
    const Block& block = blocks_[slot.block];
    if (block.x == x && block.y == y) return slot;
  }
}

void TileRanks::MakeRoom() {
  slots_.assign(std::max<size_t>(1024, 2 * slots_.size()), Slot{round_ - 1, 0});
  for (uint32_t i = 0; i < used_; i++) SlotOf(blocks_[i].x, blocks_[i].y) = {round_, i};
}

void TileClaims::Begin(const grid::Grid& grid) {
  const size_t tiles = grid.region_count() * size_t{grid::kTilesPerRegion};
  round_ = (round_ + 1) & 0xffff;
  if (round_ != 0 && claims_.size() >= tiles) return;
  // Reserves space for further regions, as the grid often grows gradually.
  claims_.assign(std::max(claims_.size(), tiles + tiles / 2), 0);
  round_ = 1;
  STAGE_ASSERT(claims_.size() >= tiles);
}

namespace {

bool StandsAlone(const Model& model) {
  return model.Parent() == nullptr && typeid(model) == typeid(ModelPosition);
}

}  // namespace

/// True for a top-level robot of class ModelPosition, and for any model that stays still. A model
/// on top of another one moves serially: its target depends on whether the other has moved.
bool MovePhase::MayShare(const Model& model) {
  if (StandsAlone(model)) return true;
  const std::type_info& type = typeid(model);
  if (type == typeid(ModelPosition)) return static_cast<const ModelPosition&>(model).StaysStill();
  return type == typeid(ModelActuator) && static_cast<const ModelActuator&>(model).StaysStill();
}

void MovePhase::Run(WorldEngine* engine) {
  STAGE_ASSERT(engine->stepping &&
               engine->scene.batch.fans().empty());  // rays see poses before moves
  std::vector<Model*>& moving = engine->moving;
  // By index: callbacks of models may change the list.
  for (size_t i = 0; i < moving.size();) {
    const size_t moved =
        engine->sharing.shares()
            ? MoveTogether(moving.data() + i, moving.size() - i, &engine->scene, engine->workers())
            : 0;
    if (moved == 0) moving[i]->Move();
    STAGE_ASSERT(moved == 0 || i + moved <= moving.size());
    i += std::max<size_t>(moved, 1);
  }
}

size_t MovePhase::MoveTogether(Model* const* models, size_t count, sensing::Scene* scene,
                               threads::WorkerPool* workers) {
  if (workers->threads() == 1) return 0;
  exact_ = scene->exact_drawing;
  count = runs_.Find(count, [&] {
    return workers->FindFirst(count, [&](size_t i) { return !MayShare(*models[i]); });
  });
  if (count == 0 || Placement::IsNearlyFull(*models[0])) return 0;
  grid_ = &scene->grid;
  edits_.resize(workers->threads());
  const size_t at_once = std::min(kMostAtOnce, kAtOnce * workers->threads());
  runs_.Do(count, workers->threads(), [&] {
    for (size_t begin = 0; begin < count; begin += at_once)
      MovePart(models + begin, std::min(at_once, count - begin), workers);
  });
  return count;
}

void MovePhase::MovePart(Model* const* models, size_t count, threads::WorkerPool* workers) {
  MakePlans(models, count, workers);
  if (!std::ranges::any_of(marks_, [](uint8_t marks) { return marks & kMovesAlone; }))
    return MoveRanks(0, count, workers);
  // Few models may lie between those that move alone; waking threads for them would not pay.
  const auto move_between = [&](size_t begin, size_t end) {
    if (end - begin >= runs_.later_fewest()) return MoveRanks(begin, end, workers);
    for (size_t i = begin; i < end; i++) MoveAlone(&plans_[i]);
  };
  size_t begin = 0;
  for (size_t i = 0; i < count; i++) {
    if (!(marks_[i] & kMovesAlone)) continue;
    move_between(begin, i);
    MoveAlone(&plans_[i]);
    begin = i + 1;
  }
  move_between(begin, count);
}

void MovePhase::MoveAlone(Plan* plan) {
  STAGE_ASSERT(!plan->moves || plan->model);
  if (plan->moves && plan->model->EndMove(plan->placement)) plan->placement.Commit();
}

void MovePhase::MakePlans(Model* const* models, size_t count, threads::WorkerPool* workers) {
  STAGE_ASSERT(count > 0 && count <= TileClaims::kMost);
  if (plans_.size() < count) plans_.resize(count);
  marks_.assign(count, 0);
  claims_.Begin(*grid_);
  parts_ = cells_ = exact_parts_ = 0;
  workers->Run(count, workers->Grain(count, kGrain), [&](size_t begin, size_t end, unsigned) {
    size_t parts = 0, cells = 0, exact_parts = 0;
    for (size_t i = begin; i < end; i++) {
      Plan& plan = plans_[i];
      plan.shared = plan.moves = false;
      plan.rank = 0;
      if (!StandsAlone(*models[i])) continue;
      plan.model = static_cast<ModelPosition*>(models[i]);
      plan.moves = plan.model->BeginMove(&plan.placement);
      if (!plan.moves) continue;
      Describe(i);
      parts += plan.placement.NewParts().size();
      cells += grid::CountCells(plan.placement.NewParts());
      if (plan.shared)
        exact_parts += plan.placement.MostExactParts(static_cast<size_t>(CountOf(plan.tiles)));
    }
    parts_.fetch_add(parts, std::memory_order_relaxed);
    cells_.fetch_add(cells, std::memory_order_relaxed);
    exact_parts_.fetch_add(exact_parts, std::memory_order_relaxed);
  });
}

void MovePhase::Describe(size_t index) {
  Plan& plan = plans_[index];
  plan.tiles = TilesOf(plan.placement.Cells());
  plan.shared = plan.placement.MayShareEdit() && CountOf(plan.tiles) <= kMostTiles;
  if (!plan.shared) return Mark(index, kMovesAlone);
  if (!grid_->FindSlots(plan.placement.NewParts()) || (exact_ && !grid_->HasRegions(plan.tiles)))
    Mark(index, kRegionsMissing);
  const auto met = [&](size_t other) {
    Mark(index, kContested);
    Mark(other, kContested);
  };
  if (!claims_.Claim(*grid_, plan.tiles, index, met)) Mark(index, kContested);
}

void MovePhase::Mark(size_t index, uint8_t marks) {
  STAGE_ASSERT(index < marks_.size());
  std::atomic_ref<uint8_t>(marks_[index]).fetch_or(marks, std::memory_order_relaxed);
}

/// Moves the models of [begin, end) that share the grid, rank by rank.
void MovePhase::MoveRanks(size_t begin, size_t end, threads::WorkerPool* workers) {
  if (begin == end) return;
  STAGE_ASSERT(std::none_of(marks_.data() + begin, marks_.data() + end,
                            [](uint8_t marks) { return marks & kMovesAlone; }));
  const uint64_t bodies = AssignRanks(begin, end);
  SortByRank();
  grid_->BeginSharedEdit(
      {.parts = parts_, .cells = cells_, .exact_parts = exact_parts_, .bodies = bodies}, &edits_);
  try {
    MoveRanksShared(begin, end, workers);
  } catch (...) {
    grid_->EndSharedEdit(&edits_);
    throw;
  }
  grid_->EndSharedEdit(&edits_);
}

void MovePhase::MoveRanksShared(size_t begin, size_t end, threads::WorkerPool* workers) {
  const size_t all = end - begin;
  workers->Run(all, workers->Grain(all, kGrain), [&](size_t from, size_t to, unsigned thread) {
    for (size_t i = begin + from; i < begin + to; i++)
      if (plans_[i].shared && plans_[i].rank == 0) MovePlan(&plans_[i], thread);
  });
  uint32_t first = 0;
  for (const uint32_t rank_end : rank_ends_) {
    const uint32_t* movers = order_.data() + first;
    const size_t count = rank_end - first;
    workers->Run(count, std::max(workers->Grain(count, kGrain), kFew),
                 [&](size_t from, size_t to, unsigned thread) {
                   for (size_t i = from; i < to; i++) MovePlan(&plans_[movers[i]], thread);
                 });
    first = rank_end;
  }
}

void MovePhase::MovePlan(Plan* plan, unsigned thread) {
  STAGE_ASSERT(plan->moves && thread < edits_.size());
  if (!plan->model->EndMove(plan->placement)) return;
  // Only claimed tiles may be drawn in: ranks keep other moves out of these.
  STAGE_ASSERT(LieIn(plan->tiles, plan->placement.NewParts()));
  edits_[thread].Follow(plan->bodies_before);
  plan->placement.Commit(&edits_[thread]);
}

/// Assigns ranks to contested moves and creates the regions that will be drawn in. Returns the
/// number of bodies that move.
uint64_t MovePhase::AssignRanks(size_t begin, size_t end) {
  later_.clear();
  ranks_.Clear();
  uint64_t bodies = 0;
  for (size_t i = begin; i < end; i++) {
    Plan& plan = plans_[i];
    plan.bodies_before = bodies;
    if (plan.moves) bodies += plan.placement.body_count();
    if (marks_[i] & kContested) {
      plan.rank = ranks_.Add(plan.tiles);
      if (plan.rank > 0) later_.push_back(static_cast<uint32_t>(i));
    }
    // Earlier moves of this chunk may have removed regions.
    const bool any_may_miss = begin > 0 && plan.shared;
    if (!any_may_miss && !(marks_[i] & kRegionsMissing)) continue;
    grid_->MakeSlots(plan.placement.NewParts());
    if (exact_) grid_->MakeRegions(plan.tiles);
  }
  return bodies;
}

void MovePhase::SortByRank() {
  rank_ends_.clear();
  for (const uint32_t i : later_) {
    const size_t place = plans_[i].rank - 1;
    if (place >= rank_ends_.size()) rank_ends_.resize(place + 1, 0);
    rank_ends_[place]++;
  }
  uint32_t sum = 0;
  for (uint32_t& end_of_rank : rank_ends_) {
    const uint32_t movers = end_of_rank;
    end_of_rank = sum;  // the begin of the rank, for now
    sum += movers;
  }
  order_.resize(sum);
  for (const uint32_t i : later_) order_[rank_ends_[plans_[i].rank - 1]++] = i;
  STAGE_ASSERT(sum == later_.size() && (rank_ends_.empty() || rank_ends_.back() == sum));
  STAGE_ASSERT(std::ranges::is_sorted(
      order_, [this](uint32_t a, uint32_t b) { return plans_[a].rank < plans_[b].rank; }));
}

}  // namespace Stg
