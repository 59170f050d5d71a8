// SPDX-License-Identifier: GPL-2.0-or-later
//
// The broad phase: which bodies may touch which bodies and walls within a step, and the islands
// that they form.
//
// Each body has a reach, the distance by which its points may move within the step. A mover's comes
// from its target. A pushable body's is that of the movers that may touch it, directly or by way of
// other pushable bodies; it is twice as long, because a push beside the centre makes a body turn.

#ifndef STAGE_MOTION_NEARBY_HH
#define STAGE_MOTION_NEARBY_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/body_index.hh"
#include "motion/columns.hh"
#include "motion/shape.hh"
#include "motion/walls.hh"
#include "threads/worker_pool.hh"

namespace Stg::motion {

/// Two bodies that may touch, a < b; or a body and a wall's edge.
struct NearPair {
  uint32_t a, b;
};

/// Bodies that may touch each other, directly or by way of others. All ranges are half-open.
struct Island {
  uint32_t first_member, last_member;  // in Nearby::members
  uint32_t first_pair, last_pair;      // in Nearby::pairs
  uint32_t first_wall, last_wall;      // in Nearby::walls
};

class Nearby {
 public:
  /// Finds all of the following, on the threads of `workers` unless it is null. `least_reach`:
  /// reach of bodies that want less, even of those that stand.
  void Find(const Shapes& shapes, const Walls& walls, const Columns& columns,
            threads::WorkerPool* workers = nullptr, double least_reach = 0.0);

  std::vector<double> reach;  // of each body
  // In the order of their smallest members; members, pairs and walls of an island ascend. A body
  // that cannot move during the step is in no island, though pairs may mention it.
  std::vector<Island> islands;
  std::vector<uint32_t> members;
  std::vector<NearPair> pairs, walls;
  // For each body its place within its island, or kNone.
  static constexpr uint32_t kNone = UINT32_MAX;
  std::vector<uint32_t> place;

 private:
  template <typename F>
  void Collect(threads::WorkerPool* workers, std::vector<NearPair>* all, F f);
  void FindReach(uint32_t body, const Shapes& shapes, const Columns& columns, double least_reach);
  void TryPair(uint32_t a, uint32_t b, const Columns& columns, std::vector<NearPair>* found) const;
  void FindPairs(const Columns& columns, threads::WorkerPool* workers);
  void FindPairsOf(uint32_t body, const Columns& columns);
  void SpreadReaches(const Columns& columns);
  void FindWallsOf(uint32_t body, const Walls& edges, const Columns& columns,
                   std::vector<NearPair>* found) const;
  void SortPairs();
  void FormIslands(const Columns& columns);
  void SortByIsland(std::vector<NearPair>* of, uint32_t Island::*first, uint32_t Island::*last);
  uint32_t Root(uint32_t body);
  void SetBox(uint32_t body, const Columns& columns);

  std::vector<double> bound_;  // of each body's shape
  std::vector<double> push_;   // the reach that each body gives to what it pushes
  std::vector<Box> boxes_;     // of each body with its reach
  BodyIndex index_;
  std::vector<std::vector<NearPair>> found_;  // by each part of the bodies
  std::vector<uint32_t> queue_, root_, island_of_, count_;
  std::vector<NearPair> sorted_;
};

}  // namespace Stg::motion

#endif
