// SPDX-License-Identifier: GPL-2.0-or-later
//
// Tells whether a row fits a world, so that restoring it directly cannot fail half-way.
//
// A row fits if the world has the models of its list, and as many sensors, callbacks, controllers
// with state and so on with each of them as ExchangeState() expects. The latter are compared as one
// hash. Rows never fit if code of clients takes part that may refuse them: model types of plug-ins,
// and keepers without StateKeeper::FitsAlways().

#include <algorithm>
#include <bit>
#include <cstdint>
#include <string>
#include <typeinfo>
#include <vector>

#include "messages/assert.hh"
#include "models/bumper.hh"
#include "models/field.hh"
#include "models/groundsensor.hh"
#include "models/model.hh"
#include "models/model_type_list.hh"
#include "models/power_pack.hh"
#include "models/ranger.hh"
#include "random/fnv1a.hh"
#include "world/restorer.hh"

namespace Stg {

namespace {

bool IsBuiltIn(const std::type_info& type) {
  static const std::vector<const std::type_info*> built_in = [] {
    std::vector<const std::type_info*> types;
    for (const ModelType& known : BuiltInModelTypes()) types.push_back(known.of);
    return types;
  }();
  return std::ranges::any_of(built_in, [&](const auto* known) { return *known == type; });
}

ModelList::Parts PartsOf(const Model& model) {
  const std::type_info& type = typeid(model);
  if (!IsBuiltIn(type)) return ModelList::kUnknown;
  if (type == typeid(ModelRanger)) return ModelList::kSensors;
  if (type == typeid(ModelField)) return ModelList::kCells;
  if (type == typeid(ModelGroundSensor)) return ModelList::kPoints;
  return type == typeid(ModelBumper) ? ModelList::kBumpers : ModelList::kNone;
}

}  // namespace

uint32_t World::Restorer::PlaceOf(const Model* model) const {
  const auto found = std::ranges::lower_bound(engine_.models, model->GetId(), {}, &Model::GetId);
  STAGE_ASSERT(found != engine_.models.end() && *found == model);
  return static_cast<uint32_t>(found - engine_.models.begin());
}

/// The present list of models, in the format of a vector of Listed.
const ModelList& World::Restorer::List() {
  ModelList& list = buffers_.list;
  if (list.topology_version == engine_.topology_version) return list;
  list = ModelList();
  StateExchange exchange(engine_.models, &list.section);
  exchange.Count(engine_.models.size());
  for (const Model* model : engine_.models) {
    Listed listed{model->id, model->parent ? PlaceOf(model->parent) + 1 : 0, model->wf_entity,
                  model->type};
    exchange(listed);
    list.parts.push_back(PartsOf(*model));
  }
  exchange.Finish();
  list.topology_version = engine_.topology_version;
  return list;
}

/// The present names as a section.
const StateRow::Bytes& World::Restorer::Names() {
  NameList& names = buffers_.names;
  if (names.topology_version == engine_.topology_version &&
      names.names_version == engine_.names.version())
    return names.section;
  names = NameList();
  StateExchange exchange(engine_.models, &names.section);
  world_.ExchangeNames(exchange);
  exchange.Finish();
  names.topology_version = engine_.topology_version;
  names.names_version = engine_.names.version();
  return names.section;
}

/// Adds what restoring a model expects of it. Returns false if that is unknown.
bool World::Restorer::AddFit(const Model& model, ModelList::Parts parts, uint64_t* hash) {
  if (parts == ModelList::kUnknown) return false;
  const auto add = [hash](uint64_t number) { *hash = Fnv1aStep(*hash, number); };
  if (parts == ModelList::kSensors) add(static_cast<const ModelRanger&>(model).GetSensors().size());
  if (parts == ModelList::kCells) {
    add(static_cast<const ModelField&>(model).columns());
    add(static_cast<const ModelField&>(model).rows());
  }
  if (parts == ModelList::kPoints)
    add(static_cast<const ModelGroundSensor&>(model).points().size());
  if (parts == ModelList::kBumpers) add(static_cast<const ModelBumper&>(model).bumper_count);
  add(model.power_pack ? 1 : 0);
  if (model.callbacks_)
    for (const Model::Callback& entry : model.callbacks_->all)
      if (entry.function) add(uint64_t{2} + entry.type * 2 + entry.parallel);
  for (const Model::KeptState& kept : model.kept_state_) {
    if (kept.keeper && !kept.keeper->FitsAlways()) return false;
    add(Fnv1a(kept.name));
    add(kept.bytes);
  }
  return true;
}

/// The value of StateRow::fit that the world has now; 0: unknown.
uint64_t World::Restorer::Fit() {
  const std::vector<ModelList::Parts>& parts = List().parts;
  uint64_t hash = Fnv1aStep(kFnv1aStart, std::bit_cast<uint64_t>(engine_.scene.cells_per_metre));
  for (size_t i = 0; i < engine_.models.size(); i++)
    if (!AddFit(*engine_.models[i], parts[i], &hash)) return 0;
  return std::max(hash, uint64_t{1});
}

bool World::Restorer::HasModelsOf(const StateRow& row) {
  return row.count() == engine_.models.size() + kOtherSections &&
         SameBytes(row.section(kList), List().section);
}

bool World::Restorer::Fits(const StateRow& row) {
  return row.fit != 0 && HasModelsOf(row) && row.fit == Fit();
}

}  // namespace Stg
