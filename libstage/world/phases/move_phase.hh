// SPDX-License-Identifier: GPL-2.0-or-later
//
// Moves robots on several threads, with the very outcome of moving one after the other.
//
// A robot's move looks at and changes the cells around it, and the robots that move before it may
// have been there. So moves are put into ranks: a robot comes one rank after the last one before it
// that uses a tile of the grid which it uses too. Robots of one rank have no tile in common, hence
// nothing to say to each other; ranks follow one another. In a crowd there are some twenty ranks,
// in the open one or two.

#ifndef STAGE_WORLD_PHASES_MOVE_PHASE_HH
#define STAGE_WORLD_PHASES_MOVE_PHASE_HH

#include <atomic>
#include <cstdint>
#include <vector>

#include "models/block.hh"
#include "sensing/scene.hh"
#include "threads/worker_pool.hh"
#include "world/phases/run_finder.hh"

namespace Stg {

class ModelPosition;
class WorldEngine;

/// The ranks of rectangles of tiles that come one after the other.
class TileRanks {
 public:
  /// Begins anew.
  void Clear();
  /// One more than the highest rank so far of a rectangle that has a tile in common with this one;
  /// 0 if there is none.
  uint32_t Add(const grid::CellBox& tiles);

 private:
  // 4 x 4 tiles: a rectangle has a few of them.
  static constexpr int kShift = 2, kSide = 1 << kShift;
  struct Block {
    int32_t x, y;
    uint32_t next_rank[kSide * kSide];
  };
  struct Slot {
    uint32_t round;  // it is free if that isn't the present one
    uint32_t block;
  };
  // What a rectangle has of a block, in tiles of the block.
  struct Part {
    uint32_t block;
    int32_t min_x, min_y, max_x, max_y;
  };
  void FindParts(const grid::CellBox& tiles);
  uint32_t BlockOf(int32_t x, int32_t y);
  Slot& SlotOf(int32_t x, int32_t y);
  void MakeRoom();
  template <typename F>
  void ForEachRank(F f);

  std::vector<Slot> slots_;    // by a hash of the block, with linear probing
  std::vector<Block> blocks_;  // the first `used_` are in use
  uint32_t used_ = 0, round_ = 0;
  std::vector<Part> parts_;  // of the rectangle that is being added
};

/// Finds out, on several threads, which of many rectangles of tiles have tiles in common.
class TileClaims {
 public:
  static constexpr size_t kMost = 0x10000;  ///< rectangles

  /// Begins anew, with the present regions of the grid.
  void Begin(const grid::Grid& grid);
  /// Takes the tiles for a rectangle and calls met(other) with the numbers of some that have taken
  /// tiles of it before: enough of them that in the end everyone has been named, or has met
  /// another, who shares a tile. False if some tiles are in no region, and may be anybody's.
  template <typename F>
  bool Claim(const grid::Grid& grid, const grid::CellBox& tiles, size_t number, F met);

 private:
  std::vector<uint32_t> claims_;  // round << 16 | number, by region and tile
  uint32_t round_ = 0;
};

template <typename F>
bool TileClaims::Claim(const grid::Grid& grid, const grid::CellBox& tiles, size_t number, F met) {
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
      const uint32_t before =
          std::atomic_ref(claims_[tile]).exchange(claim, std::memory_order_relaxed);
      if (before >> 16 == round_) met(before & 0xffff);
    }
  }
  return all_known;
}

class MovePhase {
 public:
  /// See RunOptions::share_from.
  void SetFewest(size_t models) { runs_.SetFewest(models); }
  /// Between steps.
  void EndStep() { runs_.EndStep(); }
  uint64_t looks() const { return runs_.looks(); }  ///< see RunFinder
  /// Moves all that asked for it. Callbacks among that may delete the world; who calls this shares
  /// in the engine.
  void Run(WorldEngine* engine);

 private:
  /// Moves the first few of these models together, as if one after the other. Returns how many: up
  /// to one that is on another model, or of a class of its own; 0 if it isn't worth while.
  size_t MoveTogether(Model* const* models, size_t count, sensing::Scene* scene,
                      threads::WorkerPool* workers);
  struct Plan {
    ModelPosition* model;  // if it moves
    bool moves, shared;    // it moves; beside others
    grid::CellBox tiles;   // that it may look at
    uint32_t rank;
    uint64_t bodies_before;  // of the robots that move before it, together with it
    Placement placement;
  };
  static bool MayShare(const Model& model);
  void MovePart(Model* const* models, size_t count, threads::WorkerPool* workers);
  static void MoveAlone(Plan* plan);
  void MakePlans(Model* const* models, size_t count, threads::WorkerPool* workers);
  void Describe(size_t index);
  void Mark(size_t index, uint8_t marks);
  void MoveRanks(size_t begin, size_t end, threads::WorkerPool* workers);
  void MoveRanksShared(size_t begin, size_t end, threads::WorkerPool* workers);
  uint64_t AssignRanks(size_t begin, size_t end);
  void SortByRank();
  void MovePlan(Plan* plan, unsigned thread);

  RunFinder runs_;
  std::vector<Plan> plans_;
  // What one thread looks at of all plans, which it has not made.
  static constexpr uint8_t kMovesAlone = 1, kContested = 2, kRegionsMissing = 4;
  std::vector<uint8_t> marks_;
  bool exact_ = false;                       // bodies are drawn for the exact ray model too
  std::atomic<size_t> parts_{0}, cells_{0};  // that may be drawn
  std::atomic<size_t> exact_parts_{0};
  TileClaims claims_;
  std::vector<grid::Grid::Edit> edits_;  // one for each thread
  TileRanks ranks_;
  std::vector<uint32_t> later_;      // indices of plans behind the first rank
  std::vector<uint32_t> rank_ends_;  // in order_
  std::vector<uint32_t> order_;      // the same by rank
  grid::Grid* grid_ = nullptr;
};

}  // namespace Stg

#endif
