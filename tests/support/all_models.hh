// SPDX-License-Identifier: GPL-2.0-or-later
//
// Lists all models of a world, including the ground, in a reproducible order.
// World::GetAllModels() returns a set that is sorted by addresses.

#ifndef TESTS_SUPPORT_ALL_MODELS_HH
#define TESTS_SUPPORT_ALL_MODELS_HH

#include <algorithm>
#include <vector>

#include "stage.hh"

namespace all_models {

/// All models, parents before their children.
inline std::vector<Stg::Model*> InTree(Stg::World* world) {
  std::vector<Stg::Model*> models;
  world->ForEachDescendant(
      [](Stg::Model* model, void* list) {
        static_cast<std::vector<Stg::Model*>*>(list)->push_back(model);
        return 0;
      },
      &models);
  return models;
}

/// All models in the order of creation.
inline std::vector<Stg::Model*> ByNumber(Stg::World* world) {
  std::vector<Stg::Model*> models = InTree(world);
  std::ranges::sort(models, {}, &Stg::Model::GetId);
  return models;
}

}  // namespace all_models

#endif
