// SPDX-License-Identifier: GPL-2.0-or-later
//
// A step of all bodies of a world: they go to their targets as far as outlines let them, slide
// along what they touch, and push what can be pushed.
//
// Results depend on nothing but the columns, the shapes and the walls: not on threads, nor on the
// processor. Begin() and End() are called by one thread. Between them, islands can be solved by
// several threads at once, in any order.

#ifndef STAGE_MOTION_CONTACTS_HH
#define STAGE_MOTION_CONTACTS_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "motion/island.hh"

namespace Stg::motion {

class Contacts {
 public:
  Effort effort;
  bool tell = true;  // whether contacts() are wanted

  /// Finds the islands, for up to `threads` threads that will solve them, and moves all bodies that
  /// are in none to their targets.
  void Begin(const Shapes& shapes, const Walls& walls, Columns* columns, size_t threads = 1);

  size_t island_count() const { return nearby_.islands.size(); }
  /// The number of bodies that can move in an island: a measure of the work.
  size_t size_of(size_t island) const {
    return nearby_.islands[island].last_member - nearby_.islands[island].first_member;
  }

  /// Moves the bodies of an island. Each thread has its own number.
  void Solve(const Shapes& shapes, const Walls& walls, size_t island, size_t thread,
             Columns* columns);

  /// Collects the contacts.
  void End();

  /// Finds what is in contact at the present poses, for contacts(). Moves nothing.
  void FindContacts(const Shapes& shapes, const Walls& walls, const Columns& columns);

  /// A whole step with one thread.
  void Step(const Shapes& shapes, const Walls& walls, Columns* columns);

  /// The contacts after the step, among pairs of which one could move, or those that FindContacts()
  /// found. Their order does not depend on threads.
  std::span<const Contact> contacts() const { return contacts_; }

  const Nearby& nearby() const { return nearby_; }

 private:
  struct Worker {
    IslandSolver solver;
    std::vector<Contact> contacts;
  };
  struct Range {
    size_t worker, first, last;
  };

  Nearby nearby_;
  std::vector<Worker> workers_;
  std::vector<Range> ranges_;  // of each island's contacts
  std::vector<Contact> contacts_;
};

}  // namespace Stg::motion

#endif
