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
  int robots = 4;
  double room = 4.0;           ///< m: side of the square in which robots start
  bool controlled = false;     ///< some robots have built-in controllers
  bool several_rates = false;  ///< models have different update intervals
};

/// A world file with robots of several kinds, scenery and sensors.
std::string ClosedWorld(const ClosedWorldKind& kind, RandomSource* random);

/// Subscribes to robots and sensors. Models whose bit in `idle`, at their id modulo 64, is set get
/// no subscriber.
void SubscribeToMost(World* world, uint64_t idle);

}  // namespace Stg::test

#endif
