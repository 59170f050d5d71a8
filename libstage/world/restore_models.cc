// SPDX-License-Identifier: GPL-2.0-or-later
//
// Restores rows of a world that has other models now: deletes and creates models.

#include <algorithm>
#include <string>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/model_type_names.hh"
#include "models/ranger.hh"
#include "world/restorer.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

std::string World::Restorer::RestoreAll(const StateRow& row) {
  if (std::string wrong = ReadList(row); !wrong.empty()) return wrong;
  FindModels();
  try {
    MakeMissing();
  } catch (const LoadError& error) {
    return error.what();
  }
  Arrange();
  EraseSurplus();
  std::string wrong = RestoreSections(row, [](size_t) { return false; });
  if (!wrong.empty()) return wrong;
  if (!IsTree()) return "found a model with two parents";
  DeleteSurplus();
  engine_.fiducials->Forget(nullptr);
  engine_.topology_version++;
  return "";
}

std::string World::Restorer::ReadList(const StateRow& row) {
  const std::vector<Model*> none;
  const std::span<const unsigned char> section =
      row.count() > 0 ? row.section(kList) : std::span<const unsigned char>();
  StateExchange exchange(none, section.data(), section.size());
  exchange(list_);
  if (exchange.failed()) return exchange.message();
  if (exchange.left() > 0 || row.count() != list_.size() + kOtherSections)
    return "found an invalid list of models";
  return Check();
}

std::string World::Restorer::Check() const {
  for (size_t i = 0; i < list_.size(); i++) {
    const Listed& listed = list_[i];
    if (listed.parent > list_.size() || listed.parent == i + 1 ||
        (i > 0 && listed.id <= list_[i - 1].id) || !FindCreator(listed.type))
      return "found an invalid list of models";
  }
  if (HasCycle()) return "found a model that is its own ancestor";
  if (!world_.ground || (!list_.empty() && list_[0].type != world_.ground->type))
    return "found a list of models without the ground";
  if (list_.empty() || list_[0].id != world_.ground->id)
    return "found models with other ids: restore into a world that was loaded once, "
           "or reset";
  for (const Listed& listed : list_)
    if (!Fits(listed)) return "found a snapshot of another world file";
  return "";
}

bool World::Restorer::HasCycle() const {
  std::vector<size_t> reached_from(list_.size(), 0);  // index + 1 of the first model below it
  for (size_t i = 0; i < list_.size(); i++) {
    size_t place = i + 1;
    while (place > 0 && reached_from[place - 1] == 0) {
      reached_from[place - 1] = i + 1;
      place = list_[place - 1].parent;
    }
    if (place > 0 && reached_from[place - 1] == i + 1) return true;
  }
  return false;
}

/// True if the model may belong to this world: the file has its entity, and the id is not that of
/// another model of the file. Those are never replaced: controllers hold pointers to them.
bool World::Restorer::Fits(const Listed& listed) const {
  Worldfile* const file = world_.wf.get();
  if (listed.entity < 0) return false;
  if (listed.entity > 0 && (!file || listed.entity >= file->GetEntityCount() ||
                            file->GetEntityType(listed.entity) != listed.type))
    return false;
  const Model* const there = world_.FindModel(listed.id);
  if (!there || (there->wf_entity == 0 && listed.entity == 0)) return true;
  return there->wf_entity == listed.entity && there->type == listed.type;
}

/// Finds the listed models that exist. Deletes models that have the id of a listed model but
/// another type: both were created while a world ran.
void World::Restorer::FindModels() {
  models_.assign(list_.size(), nullptr);
  std::vector<uint32_t> id_conflicts;
  size_t i = 0;
  for (Model* model : engine_.models) {
    while (i < list_.size() && list_[i].id < model->id) i++;
    if (i == list_.size() || list_[i].id != model->id)
      surplus_.push_back(model);
    else if (list_[i].type == model->type)
      models_[i] = model;
    else
      id_conflicts.push_back(model->id);
  }
  if (id_conflicts.empty()) return;
  for (const uint32_t id : id_conflicts) delete world_.FindModel(id);  // with its descendants
  surplus_.clear();
  FindModels();
}

/// Creates missing models, parents first.
void World::Restorer::MakeMissing() {
  STAGE_ASSERT(models_.size() == list_.size());
  for (size_t i = 0; i < list_.size(); i++) {
    if (models_[i]) continue;
    // A parent with a higher id does not exist yet; Arrange() sets it later.
    Model* parent = list_[i].parent > 0 ? models_[list_[i].parent - 1] : nullptr;
    models_[i] = Make(list_[i], parent);
    created_.push_back(i);
  }
  // Initialized only now because controllers look for other models.
  for (const size_t i : created_) models_[i]->InitOrThrow();
}

Model* World::Restorer::Make(const Listed& listed, Model* parent) {
  engine_.next_model_id = listed.id;
  Model* const model = engine_.Make(&world_, parent, listed.type, FindCreator(listed.type));
  if (!model)
    throw LoadError("found a model of type " + messages::Quoted(listed.type) +
                    " that was deleted while it was being made");
  if (listed.entity == 0) return model;
  Worldfile* const file = world_.wf.get();
  const ScopedValue loading(&engine_.loading, true);
  model->Load(file, listed.entity);
  LoadParts(model, listed.entity);
  return model;
}

void World::Restorer::LoadParts(Model* model, int entity) {
  Worldfile* const file = world_.wf.get();
  for (int part = entity + 1; part < file->GetEntityCount(); part++) {
    if (file->GetEntityParent(part) != entity) continue;
    const std::string type = file->GetEntityType(part);
    auto* const ranger = dynamic_cast<ModelRanger*>(model);
    if (type == "block") model->LoadBlock(file, part);
    if (type == "sensor" && ranger) ranger->LoadSensor(file, part);
  }
  model->blockgroup->Fit(model->geom.size);
  model->blockgroup->NoteLoaded();
}

/// Gives each model its parent. Moves between trees go through the top level, so that no model is
/// ever its own descendant.
void World::Restorer::Arrange() {
  std::vector<size_t> misplaced;
  const auto parent_of = [&](size_t i) {
    return list_[i].parent > 0 ? models_[list_[i].parent - 1] : nullptr;
  };
  for (size_t i = 0; i < list_.size(); i++)
    if (models_[i]->parent != parent_of(i)) misplaced.push_back(i);
  for (const size_t i : misplaced) models_[i]->MoveTo(nullptr);
  for (const size_t i : misplaced)
    if (Model* const parent = parent_of(i)) models_[i]->MoveTo(parent);
}

/// Erases the bodies of the models to be deleted, so that they block nothing.
void World::Restorer::EraseSurplus() {
  for (Model* other : surplus_) other->blockgroup->Erase();
}

/// True if each model is a child of exactly one parent.
bool World::Restorer::IsTree() const {
  size_t children = world_.children.size();
  for (const Model* model : models_) children += model->children.size();
  std::vector<const Model*> all(world_.children.begin(), world_.children.end());
  for (const Model* model : models_)
    all.insert(all.end(), model->children.begin(), model->children.end());
  std::ranges::sort(all);
  return children == models_.size() && std::ranges::adjacent_find(all) == all.end();
}

/// Deletes models that are not in the list. The energy totals are already right and are kept.
void World::Restorer::DeleteSurplus() {
  const EnergyTotals totals = world_.engine_->energy_totals;
  std::vector<uint32_t> ids;
  for (const Model* other : surplus_) ids.push_back(other->id);
  for (const uint32_t id : ids) delete world_.FindModel(id);  // with its descendants
  world_.engine_->energy_totals = totals;
}

}  // namespace Stg
