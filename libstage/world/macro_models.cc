// SPDX-License-Identifier: GPL-2.0-or-later
//
// Makes the models of a macro in a world that has been loaded. Their entities become part of the
// world file, so that snapshots can make them again; a reset removes them.

#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "world/engine.hh"
#include "world/load_checks.hh"
#include "world/restorer.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

Model* World::Restorer::MakeMacro(const std::string& macro) {
  const RandomScope random_numbers(&world_.random_);
  const uint64_t epoch = engine_.epoch;
  const int first = world_.wf->GetEntityCount();
  const uint32_t next_id = engine_.next_model_id;
  const auto counts = world_.child_type_counts;  // for default names
  try {
    if (engine_.loading)
      throw LoadError("found a macro to be made while a world is loaded, expected a type of model");
    world_.wf->Add(macro);
    LoadAdded(first);
  } catch (const LoadError& error) {
    if (engine_.epoch == epoch) {
      DeleteAdded(first);
      engine_.next_model_id = next_id;
      world_.child_type_counts = counts;
      ReleaseIds();
    }
    messages::Report(LogLevel::kError, error.what());
    return nullptr;
  }
  if (engine_.epoch != epoch) return nullptr;  // a callback has unloaded the world
  Model* top = nullptr;
  for (Model* model : engine_.models)
    if (model->wf_entity == first) top = model;
  if (top) top->Map();
  {
    // Snapshots make the new models in copies of the world, whose files must have their entities.
    const std::lock_guard<std::mutex> lock(engine_.image_mutex);
    engine_.image.reset();
  }
  const int end = world_.wf->GetEntityCount();
  world_.wf->WarnUnused();
  engine_.ForEachModel([&](Model* model) {
    if (model->wf_entity >= first && model->wf_entity < end) model->InitOrThrow();
  });
  return top;
}

/// Creates the models of entities from `first` on, but does not rasterize them.
void World::Restorer::LoadAdded(int first) {
  Worldfile& file = *world_.wf;
  const uint64_t epoch = engine_.epoch;
  const int end = file.GetEntityCount();
  const ScopedValue loading(&engine_.loading, true);
  engine_.made.assign(static_cast<size_t>(end), nullptr);
  for (int entity = first; entity < end && engine_.epoch == epoch; entity++)
    world_.LoadEntity(entity);
  if (engine_.epoch != epoch) return;
  const std::vector<Model*> made = std::exchange(engine_.made, {});
  for (Model* model : made) {
    if (!model) continue;
    model->blockgroup->FillHeights();
    model->blockgroup->Fit(model->geom.size);
  }
  CheckFieldNames(engine_, made, file);
  world_.CheckOutlines(made);
}

/// Deletes the models of entities from `first` on, and these entities.
void World::Restorer::DeleteAdded(int first) {
  engine_.made.clear();
  std::vector<uint32_t> ids;
  for (const Model* model : engine_.models)
    if (model->wf_entity >= first) ids.push_back(model->id);
  for (const uint32_t id : ids) delete world_.FindModel(id);  // with its descendants
  world_.wf->RemoveAdded(first);
}

}  // namespace Stg
