// SPDX-License-Identifier: GPL-2.0-or-later
//
// Taking snapshots of worlds, and going back to them. The bytes of a snapshot are a list of the
// models that there are, and then what World::ExchangeState() saves.

#include "world/snapshot.hh"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/block.hh"
#include "models/model_type_names.hh"
#include "models/ranger.hh"
#include "models/state_exchange.hh"
#include "world/engine.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

uint64_t Snapshot::hash() const {
  uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a, as in StateExchange
  if (bytes_)
    for (const unsigned char byte : *bytes_) hash = (hash ^ byte) * 0x100000001b3u;
  return hash;
}

namespace {

/// A model in the list.
struct Listed {
  uint32_t id = 0;
  uint32_t parent = 0;  // its place in the list + 1; 0: none
  int entity = 0;       // of the world file; 0: none
  std::string type;

  void ExchangeState(StateExchange& exchange) { exchange(id, parent, entity, type); }
};

bool Refuse(const std::string& what) {
  messages::Report(LogLevel::kError, "stage: " + what);
  return false;
}

uint32_t PlaceOf(const std::vector<Model*>& models, const Model* model) {
  const auto found = std::ranges::lower_bound(models, model->GetId(), {}, &Model::GetId);
  return static_cast<uint32_t>(found - models.begin());
}

}  // namespace

/// One use of it restores one row. The order of its calls is that of its functions.
class World::Restorer {
 public:
  explicit Restorer(World* world) : world_(*world), engine_(*world->engine_) {}

  static StateExchange::Bytes Save(World* world);
  /// Empty, or why not; then the world may be in any state.
  std::string Restore(const StateExchange::Bytes& row);

 private:
  bool ReadList(StateExchange* exchange);
  bool Fits(const Listed& listed) const;
  void FindModels();
  void MakeMissing();
  Model* Make(const Listed& listed, Model* parent);
  void LoadParts(Model* model, int entity);
  void Arrange();
  bool IsATree() const;
  void SetAside();
  void DeleteOthers();

  World& world_;
  WorldEngine& engine_;
  std::vector<Listed> list_;
  std::vector<Model*> models_;  // of the list
  std::vector<Model*> others_;  // that are to be deleted
  std::vector<size_t> made_;    // places in the list
};

StateExchange::Bytes World::Restorer::Save(World* world) {
  const std::vector<Model*>& models = world->engine_->models;
  std::vector<Listed> list;
  for (Model* model : models)
    list.push_back({model->id, model->parent ? PlaceOf(models, model->parent) + 1 : 0,
                    model->wf_entity, model->type});
  StateExchange::Bytes row;
  StateExchange exchange(models, &row);
  exchange(list);
  world->ExchangeState(exchange);
  return row;
}

std::string World::Restorer::Restore(const StateExchange::Bytes& row) {
  const std::vector<Model*> none;
  StateExchange reader(none, row.data(), row.size());
  if (!ReadList(&reader)) return reader.message();
  FindModels();
  try {
    MakeMissing();
  } catch (const LoadError& error) {
    return error.what();
  }
  Arrange();
  SetAside();
  StateExchange exchange(models_, row.data() + (row.size() - reader.left()), reader.left());
  world_.ExchangeState(exchange);
  if (!exchange.failed() && exchange.left() > 0) exchange.Fail("found more than a world's state");
  if (!exchange.failed() && !IsATree()) exchange.Fail("found models that are in two places");
  if (exchange.failed()) return exchange.message();
  DeleteOthers();
  engine_.fiducials.Forget(nullptr);
  engine_.family_changes++;
  return "";
}

bool World::Restorer::ReadList(StateExchange* exchange) {
  (*exchange)(list_);
  for (size_t i = 0; i < list_.size() && !exchange->failed(); i++) {
    const Listed& listed = list_[i];
    if (listed.parent > list_.size() || listed.parent == i + 1 ||
        (i > 0 && listed.id <= list_[i - 1].id) || !FindCreator(listed.type))
      exchange->Fail("found a list of models that is none");
  }
  if (!exchange->failed() && (list_.empty() || list_[0].id != world_.ground->id))
    exchange->Fail(
        "found models that are numbered otherwise: restore into a world that was loaded "
        "once, or reset");
  for (size_t i = 0; i < list_.size() && !exchange->failed(); i++)
    if (!Fits(list_[i])) exchange->Fail("found a snapshot of another world file");
  return !exchange->failed();
}

/// The model may be one of this world: its file has it, if it is from a file, and no other model of
/// the file has its number. Controllers hold on to models of the file, so these are not replaced.
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

/// Those of the list that there are. A model of another type that has the number of one of them
/// goes now: both were made while the world ran.
void World::Restorer::FindModels() {
  models_.assign(list_.size(), nullptr);
  std::vector<uint32_t> in_the_way;
  size_t i = 0;
  for (Model* model : engine_.models) {
    while (i < list_.size() && list_[i].id < model->id) i++;
    if (i == list_.size() || list_[i].id != model->id)
      others_.push_back(model);
    else if (list_[i].type == model->type)
      models_[i] = model;
    else
      in_the_way.push_back(model->id);
  }
  if (in_the_way.empty()) return;
  for (const uint32_t id : in_the_way) delete world_.FindModel(id);  // with all below it
  others_.clear();
  FindModels();
}

/// Parents first.
void World::Restorer::MakeMissing() {
  for (size_t i = 0; i < list_.size(); i++) {
    if (models_[i]) continue;
    // A parent that is younger gets it later.
    Model* parent = list_[i].parent > 0 ? models_[list_[i].parent - 1] : nullptr;
    models_[i] = Make(list_[i], parent);
    made_.push_back(i);
  }
  // Only now, as controllers look for models that belong to theirs.
  for (const size_t i : made_) models_[i]->InitOrThrow();
}

Model* World::Restorer::Make(const Listed& listed, Model* parent) {
  engine_.next_model_id = listed.id;
  Model* const model = FindCreator(listed.type)(&world_, parent, listed.type);
  if (listed.entity == 0) return model;
  Worldfile* const file = world_.wf.get();
  const While loading(&engine_.loading, true);
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

/// Gives each model its parent. From one tree to another by way of the top level, so that no model
/// is ever below itself.
void World::Restorer::Arrange() {
  std::vector<size_t> misplaced;
  const auto parent_of = [&](size_t i) {
    return list_[i].parent > 0 ? models_[list_[i].parent - 1] : nullptr;
  };
  for (size_t i = 0; i < list_.size(); i++)
    if (models_[i]->parent != parent_of(i)) misplaced.push_back(i);
  for (const size_t i : misplaced) models_[i]->MoveTo(nullptr);
  for (const size_t i : misplaced)
    if (Model* const parent = parent_of(i); parent && !parent->IsDescendent(models_[i]))
      models_[i]->MoveTo(parent);
}

/// Takes the others' bodies off the grid: they are in nobody's way any more.
void World::Restorer::SetAside() {
  for (Model* other : others_) other->blockgroup->Erase();
}

/// Each model is a child of one parent, once.
bool World::Restorer::IsATree() const {
  size_t children = world_.children.size();
  for (const Model* model : models_) children += model->children.size();
  std::vector<const Model*> all(world_.children.begin(), world_.children.end());
  for (const Model* model : models_)
    all.insert(all.end(), model->children.begin(), model->children.end());
  std::ranges::sort(all);
  return children == models_.size() && std::ranges::adjacent_find(all) == all.end();
}

void World::Restorer::DeleteOthers() {
  std::vector<uint32_t> ids;
  for (const Model* other : others_) ids.push_back(other->id);
  for (const uint32_t id : ids) delete world_.FindModel(id);  // with all below it
}

bool World::Take(Snapshot* to) const {
  World* const world = const_cast<World*>(this);  // it only looks
  if (!engine_->IsIdle()) return Refuse("a snapshot can't be taken by a callback");
  for (const Model* model : engine_->models)
    if (!model->StateIsKept())
      return Refuse("a snapshot can't be taken: a controller of " +
                    messages::Quoted(model->TokenStr()) +
                    " doesn't say what it remembers, with KeepState() or KeepsNoState()");
  if (const std::string waiting = world->WhoWaits(); !waiting.empty())
    return Refuse("a snapshot can't be taken: " + waiting);
  auto row = std::make_shared<StateExchange::Bytes>(Restorer::Save(world));
  row->shrink_to_fit();
  to->bytes_ = std::move(row);
  to->time_ = sim_time;
  to->is_from_file_ = false;
  return true;
}

/// Who has put off a callback, if anybody has: what it is called with is known to them alone.
std::string World::WhoWaits() {
  std::string who;
  engine_->scheduler.ForEach([&](usec_t, const Scheduler::Event& event) {
    if (!event.callback || !who.empty()) return;
    who = "a callback that was put off with Enqueue() is to be called";
    if (event.model) who += " for " + messages::Quoted(event.model->TokenStr());
  });
  return who;
}

bool World::Restore(const Snapshot& from) {
  if (from.empty()) return Refuse("a world can't go back to a snapshot that was never taken");
  if (!engine_->IsIdle()) return Refuse("a callback can't go back to a snapshot");
  if (const std::string waiting = WhoWaits(); !waiting.empty())
    return Refuse("can't go back to a snapshot: " + waiting);
  engine_->LetOrphansGo();
  engine_->TraceBatch();
  const StateExchange::Bytes before = Restorer::Save(this);
  std::string wrong;
  try {
    wrong = Restorer(this).Restore(*from.bytes_);
    if (wrong.empty() && from.is_from_file_ && Restorer::Save(this) != *from.bytes_)
      wrong = "found a state that no world is in";
  } catch (...) {  // there is too little memory, or a controller's Init() threw something
    Restorer(this).Restore(before);
    throw;
  }
  if (wrong.empty()) return true;
  Restorer(this).Restore(before);
  return Refuse("can't go back to a snapshot: " + wrong);
}

}  // namespace Stg
