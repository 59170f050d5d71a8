// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/phases/move_phase.hh"

#include <algorithm>
#include <span>

#include "messages/assert.hh"
#include "models/model_type.hh"
#include "sensing/scene.hh"
#include "world/engine.hh"
#include "world/phases/moves_tree.hh"

namespace Stg {

namespace {

constexpr size_t kAtOnce = 256;  // movers per thread, so that their proposals stay in its cache
constexpr size_t kMaxAtOnce = 4096;
constexpr int64_t kMaxTiles = 256;  // a mover that uses more tiles moves alone
constexpr size_t kMoveGrain = 16;
constexpr size_t kFew = 4;  // with fewer movers in a color, waking threads does not pay
static_assert(kMaxAtOnce <= TileOwnership::kMaxRectangles);

grid::CellBox TilesOf(const grid::CellBox& cells) {
  if (cells.empty()) return cells;
  return {cells.min_x >> RAY_TILE_SHIFT, cells.min_y >> RAY_TILE_SHIFT,
          cells.max_x >> RAY_TILE_SHIFT, cells.max_y >> RAY_TILE_SHIFT};
}

int64_t CountOf(const grid::CellBox& tiles) {
  return (int64_t{tiles.max_x} - tiles.min_x + 1) * (int64_t{tiles.max_y} - tiles.min_y + 1);
}

/// True if all of the cell sets are in the tiles.
[[maybe_unused]] bool LieIn(const grid::CellBox& tiles, std::span<const grid::CellSet> sets) {
  return std::ranges::all_of(sets, [&](const grid::CellSet& set) {
    return set.x >= tiles.min_x && set.x <= tiles.max_x && set.y >= tiles.min_y &&
           set.y <= tiles.max_y;
  });
}

}  // namespace

void TileColoring::Clear() {
  used_ = 0;
  round_++;
}

uint32_t TileColoring::ColorOf(const grid::CellBox& tiles) {
  uint32_t color = 0;
  FindOverlaps(tiles);
  STAGE_ASSERT(std::ranges::all_of(overlaps_, [this](const Overlap& overlap) {
    return overlap.block < used_ && overlap.min_x >= 0 && overlap.min_y >= 0 &&
           overlap.max_x < kSide && overlap.max_y < kSide;
  }));
  ForEachNextColor([&](uint32_t next) { color = std::max(color, next); });
  ForEachNextColor([&](uint32_t& next) { next = color + 1; });
  return color;
}

/// Calls f(uint32_t&) for the next color of each tile of the rectangle.
template <typename F>
void TileColoring::ForEachNextColor(F f) {
  for (const Overlap& overlap : overlaps_)
    for (int32_t y = overlap.min_y; y <= overlap.max_y; y++)
      for (int32_t x = overlap.min_x; x <= overlap.max_x; x++)
        f(blocks_[overlap.block].next_color[y << kShift | x]);
}

void TileColoring::FindOverlaps(const grid::CellBox& tiles) {
  overlaps_.clear();
  for (int32_t y = tiles.min_y >> kShift; y <= tiles.max_y >> kShift; y++)
    for (int32_t x = tiles.min_x >> kShift; x <= tiles.max_x >> kShift; x++) {
      const int32_t x0 = x << kShift, y0 = y << kShift;
      overlaps_.push_back({BlockOf(x, y), std::max(tiles.min_x - x0, 0),
                           std::max(tiles.min_y - y0, 0), std::min(tiles.max_x - x0, kSide - 1),
                           std::min(tiles.max_y - y0, kSide - 1)});
    }
}

uint32_t TileColoring::BlockOf(int32_t x, int32_t y) {
  if (slots_.size() <= size_t{2} * used_) Grow();
  Slot& slot = SlotOf(x, y);
  if (slot.round == round_) return slot.block;
  if (used_ == blocks_.size()) blocks_.emplace_back();
  blocks_[used_] = {x, y, {}};
  slot = {round_, used_};
  return used_++;
}

/// Returns the block's slot, or the free slot where it belongs.
TileColoring::Slot& TileColoring::SlotOf(int32_t x, int32_t y) {
  STAGE_ASSERT(slots_.size() > used_);  // otherwise the loop might not end
  const size_t mask = slots_.size() - 1;
  for (size_t place = ray_hash(x, y) & mask;; place = (place + 1) & mask) {
    Slot& slot = slots_[place];
    if (slot.round != round_) return slot;
    const Block& block = blocks_[slot.block];
    if (block.x == x && block.y == y) return slot;
  }
}

void TileColoring::Grow() {
  slots_.assign(std::max<size_t>(1024, 2 * slots_.size()), Slot{round_ - 1, 0});
  for (uint32_t i = 0; i < used_; i++) SlotOf(blocks_[i].x, blocks_[i].y) = {round_, i};
}

void TileOwnership::Begin(const grid::Grid& grid) {
  const size_t tiles = grid.region_count() * size_t{grid::kTilesPerRegion};
  round_ = (round_ + 1) & 0xffff;
  if (round_ != 0 && owners_.size() >= tiles) return;
  // Reserves space for further regions, as the grid often grows gradually.
  owners_.assign(std::max(owners_.size(), tiles + tiles / 2), 0);
  round_ = 1;
  STAGE_ASSERT(owners_.size() >= tiles);
}

bool MovePhase::CanRunInParallel(const Model& model) {
  return MovesTree(model) || (FindModelType(model) && model.StaysStill());
}

void MovePhase::Run(WorldEngine* engine, double seconds) {
  STAGE_ASSERT(engine->stepping &&
               engine->scene.batch.fans().empty());  // rays see poses before moves
  std::vector<Model*>& moving = engine->moving;
  STAGE_ASSERT(std::ranges::is_sorted(moving, {}, &Model::GetId));  // moves do not commute
  only_rasterizes_ = engine->contact_model == ContactModel::kOutlines;
  if (only_rasterizes_) {
    engine->contacts.Run(engine, seconds);
    Rasterize(engine->contacts.moved(), engine);
    return MoveOthers(moving);
  }
  MoveAll(moving, engine, [](Model* model) { model->Move(); });
}

/// Moves models in parallel where that pays, and calls move(model) for the others.
template <typename Models, typename F>
void MovePhase::MoveAll(const Models& models, WorldEngine* engine, F move) {
  const bool parallel = engine->parallel_choice.is_parallel();
  // By index: callbacks of models may change the list.
  for (size_t i = 0; i < models.size();) {
    const size_t moved = parallel ? MoveParallel(models.data() + i, models.size() - i,
                                                 &engine->scene, engine->workers())
                                  : 0;
    if (moved == 0) move(models[i]);
    STAGE_ASSERT(moved == 0 || i + moved <= models.size());
    i += std::max<size_t>(moved, 1);
  }
}

void MovePhase::Rasterize(std::span<Model* const> models, WorldEngine* engine) {
  MoveAll(models, engine, [engine](Model* model) {
    engine->placement.Propose(*model, true);
    engine->placement.Commit();
  });
}

void MovePhase::MoveOthers(const std::vector<Model*>& models) {
  // By index: callbacks of models may change the list.
  for (size_t i = 0; i < models.size(); i++)
    if (!MovesTree(*models[i])) models[i]->Move();
}

bool MovePhase::BeginMove(Model* model, MoveProposal* proposal) const {
  if (!only_rasterizes_) {
    if (!model->GetWantedMove(&proposal->wanted)) return false;
    proposal->before = model->pose;
    model->pose = proposal->wanted.pose;
  }
  proposal->placement.Propose(*model, true);
  return true;
}

/// Returns true if the bodies are to be rasterized where they were proposed.
bool MovePhase::EndMove(MoveProposal* proposal) const {
  if (only_rasterizes_) return true;
  Model& model = *proposal->model;
  model.stall = proposal->placement.Collision(model.world_base().GetGround()) != nullptr;
  if (model.stall) model.pose = proposal->before;
  model.EndMove(model.stall ? Velocity() : proposal->wanted.velocity);
  return !model.stall;
}

size_t MovePhase::MoveParallel(Model* const* models, size_t count, sensing::Scene* scene,
                               threads::WorkerPool* workers) {
  if (workers->threads() == 1) return 0;
  exact_ = scene->exact_rasterization;
  count = interval_finder_.Find(count, [&] {
    return workers->FindFirst(
        count, [&](size_t i) { return !only_rasterizes_ && !CanRunInParallel(*models[i]); });
  });
  if (count == 0 || Placement::IsNearlyFull(*models[0])) return 0;
  grid_ = &scene->grid;
  edits_.resize(workers->threads());
  const size_t at_once = std::min(kMaxAtOnce, kAtOnce * workers->threads());
  interval_finder_.Do(count, workers->threads(), [&] {
    for (size_t begin = 0; begin < count; begin += at_once)
      MoveChunk(models + begin, std::min(at_once, count - begin), workers);
  });
  return count;
}

void MovePhase::MoveChunk(Model* const* models, size_t count, threads::WorkerPool* workers) {
  ProposeMoves(models, count, workers);
  if (!std::ranges::any_of(marks_, [](uint8_t marks) { return marks & kMovesSerially; }))
    return MoveColors(0, count, workers);
  // Few models may lie between those that move alone; waking threads for them would not pay.
  const auto move_between = [&](size_t begin, size_t end) {
    if (end - begin >= interval_finder_.later_min_length()) return MoveColors(begin, end, workers);
    for (size_t i = begin; i < end; i++) MoveSerially(&proposals_[i]);
  };
  size_t begin = 0;
  for (size_t i = 0; i < count; i++) {
    if (!(marks_[i] & kMovesSerially)) continue;
    move_between(begin, i);
    MoveSerially(&proposals_[i]);
    begin = i + 1;
  }
  move_between(begin, count);
}

void MovePhase::MoveSerially(MoveProposal* proposal) const {
  STAGE_ASSERT(!proposal->moves || proposal->model);
  if (proposal->moves && EndMove(proposal)) proposal->placement.Commit();
}

void MovePhase::ProposeMoves(Model* const* models, size_t count, threads::WorkerPool* workers) {
  STAGE_ASSERT(count > 0 && count <= TileOwnership::kMaxRectangles);
  if (proposals_.size() < count) proposals_.resize(count);
  marks_.assign(count, 0);
  ownership_.Begin(*grid_);
  sets_ = cells_ = exact_sets_ = 0;
  workers->Run(count, workers->Grain(count, kMoveGrain), [&](size_t begin, size_t end, unsigned) {
    size_t sets = 0, cells = 0, exact_sets = 0;
    for (size_t i = begin; i < end; i++) {
      MoveProposal& proposal = proposals_[i];
      proposal.shared = proposal.moves = false;
      proposal.color = 0;
      if (!only_rasterizes_ && !MovesTree(*models[i])) continue;
      proposal.model = models[i];
      proposal.moves = BeginMove(models[i], &proposal);
      if (!proposal.moves) continue;
      Describe(i);
      sets += proposal.placement.NewCells().size();
      cells += grid::CountCells(proposal.placement.NewCells());
      if (proposal.shared)
        exact_sets += proposal.placement.MaxExactSets(static_cast<size_t>(CountOf(proposal.tiles)));
    }
    sets_.fetch_add(sets, std::memory_order_relaxed);
    cells_.fetch_add(cells, std::memory_order_relaxed);
    exact_sets_.fetch_add(exact_sets, std::memory_order_relaxed);
  });
}

void MovePhase::Describe(size_t index) {
  MoveProposal& proposal = proposals_[index];
  proposal.tiles = TilesOf(proposal.placement.Cells());
  proposal.shared =
      proposal.placement.CanJoinConcurrentEdit() && CountOf(proposal.tiles) <= kMaxTiles;
  if (!proposal.shared) return Mark(index, kMovesSerially);
  if (!grid_->FindSlots(proposal.placement.NewCells()) ||
      (exact_ && !grid_->HasRegions(proposal.tiles)))
    Mark(index, kRegionsMissing);
  const auto report = [&](size_t other) {
    Mark(index, kContested);
    Mark(other, kContested);
  };
  if (!ownership_.Claim(*grid_, proposal.tiles, index, report)) Mark(index, kContested);
}

void MovePhase::Mark(size_t index, uint8_t marks) {
  STAGE_ASSERT(index < marks_.size());
  std::atomic_ref<uint8_t>(marks_[index]).fetch_or(marks, std::memory_order_relaxed);
}

/// Moves the models of [begin, end) that share the grid, color by color.
void MovePhase::MoveColors(size_t begin, size_t end, threads::WorkerPool* workers) {
  if (begin == end) return;
  STAGE_ASSERT(std::none_of(marks_.data() + begin, marks_.data() + end,
                            [](uint8_t marks) { return marks & kMovesSerially; }));
  const uint64_t bodies = AssignColors(begin, end);
  SortByColor();
  grid_->BeginConcurrentEdit(
      {.sets = sets_, .cells = cells_, .exact_sets = exact_sets_, .bodies = bodies}, &edits_);
  try {
    MoveColorsParallel(begin, end, workers);
  } catch (...) {
    grid_->EndConcurrentEdit(&edits_);
    throw;
  }
  grid_->EndConcurrentEdit(&edits_);
}

void MovePhase::MoveColorsParallel(size_t begin, size_t end, threads::WorkerPool* workers) {
  const size_t all = end - begin;
  workers->Run(all, workers->Grain(all, kMoveGrain), [&](size_t from, size_t to, unsigned thread) {
    for (size_t i = begin + from; i < begin + to; i++)
      if (proposals_[i].shared && proposals_[i].color == 0) ExecuteMove(&proposals_[i], thread);
  });
  uint32_t first = 0;
  for (const uint32_t color_end : color_ends_) {
    const uint32_t* movers = order_.data() + first;
    const size_t count = color_end - first;
    workers->Run(count, std::max(workers->Grain(count, kMoveGrain), kFew),
                 [&](size_t from, size_t to, unsigned thread) {
                   for (size_t i = from; i < to; i++) ExecuteMove(&proposals_[movers[i]], thread);
                 });
    first = color_end;
  }
}

void MovePhase::ExecuteMove(MoveProposal* proposal, unsigned thread) {
  STAGE_ASSERT(proposal->moves && thread < edits_.size());
  if (!EndMove(proposal)) return;
  // Only claimed tiles may be rasterized in: colors keep other moves out of these.
  STAGE_ASSERT(LieIn(proposal->tiles, proposal->placement.NewCells()));
  edits_[thread].SetNextStamp(proposal->bodies_before);
  proposal->placement.Commit(&edits_[thread]);
}

/// Assigns colors to contested moves and creates the regions that will be rasterized in. Returns
/// the number of bodies that move.
uint64_t MovePhase::AssignColors(size_t begin, size_t end) {
  later_.clear();
  coloring_.Clear();
  uint64_t bodies = 0;
  for (size_t i = begin; i < end; i++) {
    MoveProposal& proposal = proposals_[i];
    proposal.bodies_before = bodies;
    if (proposal.moves) bodies += proposal.placement.body_count();
    if (marks_[i] & kContested) {
      proposal.color = coloring_.ColorOf(proposal.tiles);
      if (proposal.color > 0) later_.push_back(static_cast<uint32_t>(i));
    }
    // Earlier moves of this chunk may have removed regions.
    const bool any_may_miss = begin > 0 && proposal.shared;
    if (!any_may_miss && !(marks_[i] & kRegionsMissing)) continue;
    grid_->MakeSlots(proposal.placement.NewCells());
    if (exact_) grid_->MakeRegions(proposal.tiles);
  }
  return bodies;
}

void MovePhase::SortByColor() {
  color_ends_.clear();
  for (const uint32_t i : later_) {
    const size_t place = proposals_[i].color - 1;
    if (place >= color_ends_.size()) color_ends_.resize(place + 1, 0);
    color_ends_[place]++;
  }
  uint32_t sum = 0;
  for (uint32_t& end_of_color : color_ends_) {
    const uint32_t movers = end_of_color;
    end_of_color = sum;  // the begin of the color, for now
    sum += movers;
  }
  order_.resize(sum);
  for (const uint32_t i : later_) order_[color_ends_[proposals_[i].color - 1]++] = i;
  STAGE_ASSERT(sum == later_.size() && (color_ends_.empty() || color_ends_.back() == sum));
  STAGE_ASSERT(std::ranges::is_sorted(order_, [this](uint32_t a, uint32_t b) {
    return proposals_[a].color < proposals_[b].color;
  }));
}

}  // namespace Stg
