// SPDX-License-Identifier: GPL-2.0-or-later
//
// The initial state of a world, to which World::RestartFrom() returns.

#ifndef STAGE_WORLD_INITIAL_STATE_HH
#define STAGE_WORLD_INITIAL_STATE_HH

#include <vector>

#include "world/snapshot.hh"

namespace Stg {

struct InitialState {
  Snapshot state;  ///< immediately after loading
  /// For each model in the order of creation: its index among siblings of the same type.
  std::vector<unsigned> indices;
};

/// The index of each model among its siblings of the same type.
std::vector<unsigned> IndicesOf(const std::vector<Model*>& models);

}  // namespace Stg

#endif
