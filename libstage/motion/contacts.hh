// SPDX-License-Identifier: GPL-2.0-or-later
//
// A step of all bodies of a world: they go to their targets as far as outlines let them, slide
// along what they touch, and push what can be pushed.
//
// Results depend on nothing but the columns, the shapes and the walls: not on threads, nor on the
// processor. Islands of bodies that may touch are solved independently of each other.

#ifndef STAGE_MOTION_CONTACTS_HH
#define STAGE_MOTION_CONTACTS_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "motion/island.hh"

namespace Stg::motion {

/// A move counts as hindered if less than this share of it was made.
inline constexpr double kHindered = 0.95;

class Contacts {
 public:
  Effort effort;
  bool tell = true;  // whether contacts() are wanted

  /// Moves all bodies, on the threads of `workers` unless it is null.
  void Step(const Shapes& shapes, const Walls& walls, Columns* columns,
            threads::WorkerPool* workers = nullptr);

  /// Finds what is in contact at the present poses, for contacts(). Moves nothing.
  void FindContacts(const Shapes& shapes, const Walls& walls, const Columns& columns);

  /// The contacts after the step, among pairs of which one could move, or those that FindContacts()
  /// found. Their order does not depend on threads.
  std::span<const Contact> contacts() const { return contacts_; }

  const Nearby& nearby() const { return nearby_; }

 private:
  struct Worker {
    IslandSolver solver;
    std::vector<Contact> contacts;
  };
  // The contacts of an island, in those of the worker that solved it.
  struct Range {
    size_t worker, first, last;
  };
  void MoveFree(size_t begin, size_t end, Columns* columns) const;
  void OrderIslands(bool by_size);
  void Solve(const Shapes& shapes, const Walls& walls, size_t island, unsigned thread,
             Columns* columns);
  void CollectContacts();

  Nearby nearby_;
  std::vector<Worker> workers_;
  std::vector<uint32_t> order_;  // of the islands
  std::vector<Range> ranges_;    // of each island
  std::vector<Contact> contacts_;
};

}  // namespace Stg::motion

#endif
