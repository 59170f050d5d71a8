// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tells whether a model moves as a whole tree, in contacts or in parallel.

#ifndef STAGE_WORLD_PHASES_MOVES_TREE_HH
#define STAGE_WORLD_PHASES_MOVES_TREE_HH

#include "models/model.hh"
#include "models/model_type.hh"

namespace Stg {

/// True if the model is at the top level and its type is registered with ModelType::kMovesTree. A
/// model on top of another one moves serially: its target depends on whether the other has moved.
inline bool MovesTree(const Model& model) {
  if (model.Parent() != nullptr) return false;
  const ModelType* const type = FindModelType(model);
  return type && type->moves == ModelType::kMovesTree;
}

}  // namespace Stg

#endif
