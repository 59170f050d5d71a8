// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random worlds of models that rows know: see rows/row_bridge.hh.

#ifndef STAGE_TESTS_SUPPORT_CLOSED_WORLD_HH
#define STAGE_TESTS_SUPPORT_CLOSED_WORLD_HH

#include <cstdint>
#include <string>

#include "support/random_source.hh"

namespace Stg {
class World;
}

namespace Stg::test {

/// Properties that all worlds of a test have in common.
struct ClosedWorldKind {
  bool outlines = true;
  bool exact = false;
  int robots = 4;     ///< 1 or more
  double room = 4.0;  ///< m: side of the square in which robots start
};

/// A world file with robots of several kinds, scenery and sensors.
std::string ClosedWorld(const ClosedWorldKind& kind, RandomSource* random);

/// Subscribes to all robots and rangers.
void SubscribeToAll(World* world);

}  // namespace Stg::test

#endif
