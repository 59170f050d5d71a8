// SPDX-License-Identifier: GPL-2.0-or-later
//
// Moves robots on several threads, with the very outcome of moving one after the other.
//
// A robot's move looks at and changes the cells around it, and the robots that move before it may
// have been there. So moves are put into ranks: a robot comes one rank after the last one before it
// that uses a tile of the grid which it uses too. Robots of one rank have no tile in common, hence
// nothing to say to each other; ranks follow one another. In a crowd there are some twenty ranks,
// in the open one or two.

#ifndef STAGE_WORLD_MOVE_PHASE_HH
#define STAGE_WORLD_MOVE_PHASE_HH

#include <cstdint>
#include <vector>

#include "models/block.hh"
#include "sensing/scene.hh"
#include "sensing/worker_pool.hh"
#include "world/run_finder.hh"

namespace Stg {

class ModelPosition;

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

class MovePhase {
 public:
  /// See RunOptions::share_from.
  void SetFewest(size_t models) { runs_.SetFewest(models); }
  /// Between steps.
  void EndStep() { runs_.Begin(); }
  /// Moves the first few of these models as if one after the other. Returns how many: up to one
  /// that is on another model, or of a class of its own; 0 if it isn't worth while.
  size_t Move(Model* const* models, size_t count, sensing::Scene* scene,
              sensing::WorkerPool* workers);

 private:
  struct Plan {
    ModelPosition* model;
    enum { kStays, kShared, kAlone } kind;
    grid::CellBox tiles;  // that it may look at
    size_t new_cells;     // that it may be drawn in
    bool tiles_missing;   // in the grid, of those of the new cells
    uint32_t rank;
    Placement placement;
  };
  void MovePart(Model* const* models, size_t count, sensing::WorkerPool* workers);
  void MakePlans(Model* const* models, size_t count, sensing::WorkerPool* workers);
  static void Describe(Plan* plan, const grid::Grid& grid);
  void MoveRanks(size_t begin, size_t end, sensing::WorkerPool* workers);
  void AssignRanks(size_t begin, size_t end);
  void SortByRank(size_t begin, size_t end);

  RunFinder runs_;
  std::vector<Plan> plans_;
  std::vector<grid::Grid::Edit> edits_;  // one for each thread
  size_t parts_ = 0, cells_ = 0;         // that may be drawn, of what is ranked
  TileRanks ranks_;
  std::vector<uint32_t> rank_ends_;  // in order_
  std::vector<uint32_t> order_;      // indices of plans, by rank
  grid::Grid* grid_ = nullptr;
};

}  // namespace Stg

#endif
