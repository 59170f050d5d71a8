// SPDX-License-Identifier: GPL-2.0-or-later
//
// How a world begins: what World::BeginAgain() goes back to.

#ifndef STAGE_WORLD_BEGINNING_HH
#define STAGE_WORLD_BEGINNING_HH

#include <vector>

#include "world/snapshot.hh"

namespace Stg {

struct WorldBeginning {
  Snapshot state;  ///< right after loading
  /// For each model, in the order of creation: its number among those of its type below its parent.
  std::vector<unsigned> indices;
};

}  // namespace Stg

#endif
