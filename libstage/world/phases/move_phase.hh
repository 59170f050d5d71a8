// SPDX-License-Identifier: GPL-2.0-or-later
//
// Moves robots on several threads. The result equals that of moving them one after the other.
//
// A robot's move reads and changes the cells around it, which earlier moves may have changed. Each
// robot therefore gets a color: one more than the highest color of the earlier robots that use one
// of its tiles, or 0. Robots of equal color share no tile and can move in parallel; the colors run
// one after the other. Dense crowds have about twenty colors, sparse scenes one or two.

#ifndef STAGE_WORLD_PHASES_MOVE_PHASE_HH
#define STAGE_WORLD_PHASES_MOVE_PHASE_HH

#include <atomic>
#include <cstdint>
#include <vector>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/model.hh"
#include "models/placement.hh"
#include "sensing/scene.hh"
#include "threads/worker_pool.hh"
#include "world/phases/interval_finder.hh"

namespace Stg {

class WorldEngine;

/// Assigns colors to a sequence of rectangles of tiles.
class TileColoring {
 public:
  /// Starts a new sequence.
  void Clear();
  /// Returns the color: one more than the highest color of an earlier rectangle with a common tile,
  /// or 0 if there is none.
  uint32_t ColorOf(const grid::CellBox& tiles);

 private:
  // A block is 4 x 4 tiles; a rectangle overlaps a few blocks.
  static constexpr int kShift = 2, kSide = 1 << kShift;
  struct Block {
    int32_t x, y;
    uint32_t next_color[kSide * kSide];
  };
  struct Slot {
    uint32_t round;  // the slot is free if this differs from round_
    uint32_t block;
  };
  // Intersection of a rectangle with a block, in tiles relative to the block.
  struct Overlap {
    uint32_t block;
    int32_t min_x, min_y, max_x, max_y;
  };
  void FindOverlaps(const grid::CellBox& tiles);
  uint32_t BlockOf(int32_t x, int32_t y);
  Slot& SlotOf(int32_t x, int32_t y);
  void Grow();
  template <typename F>
  void ForEachNextColor(F f);

  std::vector<Slot> slots_;    // hash table of blocks with linear probing
  std::vector<Block> blocks_;  // the first `used_` are in use
  uint32_t used_ = 0, round_ = 0;
  std::vector<Overlap> overlaps_;  // of the rectangle being added
};

/// Detects, on several threads, which rectangles of tiles overlap.
class TileOwnership {
 public:
  static constexpr size_t kMaxRectangles = 0x10000;  ///< rectangles

  /// Starts a new set of rectangles, for the present regions of the grid.
  void Begin(const grid::Grid& grid);
  /// Claims the tiles for rectangle `number` and calls report(other) for each previous owner found.
  /// Every rectangle that overlaps another takes part in at least one such call, as `number` or as
  /// `other`. Returns false if some tiles lie in no region: these are not tracked.
  template <typename F>
  bool Claim(const grid::Grid& grid, const grid::CellBox& tiles, size_t number, F report);

 private:
  std::vector<uint32_t> owners_;  // round << 16 | number, indexed by region and tile
  uint32_t round_ = 0;
};

template <typename F>
bool TileOwnership::Claim(const grid::Grid& grid, const grid::CellBox& tiles, size_t number,
                          F report) {
  STAGE_ASSERT(number < kMaxRectangles && round_ > 0);
  const uint32_t claim = round_ << 16 | static_cast<uint32_t>(number);
  bool all_known = true;
  for (int32_t y = tiles.min_y; y <= tiles.max_y; y++) {
    uint32_t region = 0;
    for (int32_t x = tiles.min_x; x <= tiles.max_x; x++) {
      const int32_t cell_x = x << RAY_TILE_SHIFT, cell_y = y << RAY_TILE_SHIFT;
      if (x == tiles.min_x || (x & 7) == 0) region = grid.FindRegion(cell_x, cell_y);
      if (region == 0) {
        all_known = false;
        continue;
      }
      const size_t tile =
          region * size_t{grid::kTilesPerRegion} + grid::Grid::TileOf(cell_x, cell_y);
      STAGE_ASSERT(tile < owners_.size());
      const uint32_t before =
          std::atomic_ref(owners_[tile]).exchange(claim, std::memory_order_relaxed);
      if (before >> 16 == round_) report(before & 0xffff);
    }
  }
  return all_known;
}

class MovePhase {
 public:
  /// See RunOptions::share_from.
  void SetMinLength(size_t models) { interval_finder_.SetMinLength(models); }
  /// Call between steps.
  void EndStep() { interval_finder_.EndStep(); }
  uint64_t examined() const { return interval_finder_.examined(); }  ///< see IntervalFinder
  /// Moves all models that asked to be moved. Callbacks may delete the world, so the caller must
  /// share ownership of the engine. `seconds`: duration of the step.
  void Run(WorldEngine* engine, double seconds);

 private:
  /// Moves a prefix of these models in parallel, with the result of serial moves. Returns its
  /// length: it ends before a model that is on another model or of another class; 0 if sharing does
  /// not pay.
  size_t MoveParallel(Model* const* models, size_t count, sensing::Scene* scene,
                      threads::WorkerPool* workers);
  struct MoveProposal {
    Model* model;  // null if the model stays
    Model::WantedMove wanted;
    Pose before;          // pose before the move
    bool moves, shared;   // it moves; it moves in parallel
    grid::CellBox tiles;  // may be read or changed by the move
    uint32_t color;
    uint64_t bodies_before;  // number of bodies of earlier robots that move in parallel
    Placement placement;
  };
  /// Moves the models of `models` whose moves contacts of outlines do not cover.
  static void MoveOthers(const std::vector<Model*>& models);
  template <typename Models, typename F>
  void MoveAll(const Models& models, WorldEngine* engine, F move);
  /// Rasterizes the trees of models that have moved.
  void Rasterize(std::span<Model* const> models, WorldEngine* engine);
  static bool CanRunInParallel(const Model& model);
  bool BeginMove(Model* model, MoveProposal* proposal) const;
  bool EndMove(MoveProposal* proposal) const;
  void MoveChunk(Model* const* models, size_t count, threads::WorkerPool* workers);
  void MoveSerially(MoveProposal* proposal) const;
  void ProposeMoves(Model* const* models, size_t count, threads::WorkerPool* workers);
  void Describe(size_t index);
  void Mark(size_t index, uint8_t marks);
  void MoveColors(size_t begin, size_t end, threads::WorkerPool* workers);
  void MoveColorsParallel(size_t begin, size_t end, threads::WorkerPool* workers);
  uint64_t AssignColors(size_t begin, size_t end);
  void SortByColor();
  void ExecuteMove(MoveProposal* proposal, unsigned thread);

  IntervalFinder interval_finder_;
  std::vector<MoveProposal> proposals_;
  // Marks of a proposal, kept apart so that one thread can scan them quickly.
  static constexpr uint8_t kMovesSerially = 1, kContested = 2, kRegionsMissing = 4;
  std::vector<uint8_t> marks_;
  bool only_rasterizes_ = false;            // models have been moved already
  bool exact_ = false;                      // bodies are also rasterized for the exact ray model
  std::atomic<size_t> sets_{0}, cells_{0};  // upper bounds of what may be rasterized
  std::atomic<size_t> exact_sets_{0};
  TileOwnership ownership_;
  std::vector<grid::Grid::Edit> edits_;  // one per thread
  TileColoring coloring_;
  std::vector<uint32_t> later_;       // indices of proposals with a color above 0
  std::vector<uint32_t> color_ends_;  // ends of the colors in order_
  std::vector<uint32_t> order_;       // later_ sorted by color
  grid::Grid* grid_ = nullptr;
};

}  // namespace Stg

#endif
