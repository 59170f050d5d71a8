// SPDX-License-Identifier: GPL-2.0-or-later
//
// Takes and restores snapshots of worlds. Sections of a row: the list of models; one byte per model
// that tells whether its readings are left out; the world's own state; the state of each model; and
// the three parts of World::ExchangeState() that follow the models.

#include "world/snapshot.hh"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/model_type_names.hh"
#include "models/ranger.hh"
#include "models/state_exchange.hh"
#include "random/fnv1a.hh"
#include "world/engine.hh"
#include "world/snapshot_buffers.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

size_t Snapshot::SizeOfRow() const { return row_ ? row_->bytes.size() : 0; }

size_t Snapshot::size() const { return difference_ ? difference_->size() : SizeOfRow(); }

const StateRow& Snapshot::Row(StateRow* buffer) const {
  if (!difference_) return *row_;
  Patch(*row_, *difference_, buffer);
  return *buffer;
}

uint64_t Snapshot::hash() const {
  StateRow buffer;
  const StateRow& row = empty() ? buffer : Row(&buffer);
  return Fnv1a(row.bytes.data(), row.bytes.size());
}

namespace {

constexpr size_t kList = 0, kOmitted = 1, kHead = 2, kModels = 3, kOtherSections = 6;

/// An entry of the list of models.
struct Listed {
  uint32_t id = 0;
  uint32_t parent = 0;  // index of the parent in the list + 1; 0: none
  int entity = 0;       // index in the world file; 0: none
  std::string type;

  void ExchangeState(StateExchange& exchange) { exchange(id, parent, entity, type); }
};

bool Refuse(const std::string& what) {
  messages::Report(LogLevel::kError, "stage: " + what);
  return false;
}

uint32_t PlaceOf(const std::vector<Model*>& models, const Model* model) {
  const auto found = std::ranges::lower_bound(models, model->GetId(), {}, &Model::GetId);
  STAGE_ASSERT(found != models.end() && *found == model);
  return static_cast<uint32_t>(found - models.begin());
}

}  // namespace

/// For each model, in the order of creation: whether its readings are left out. If empty, none are.
using OmittedReadings = std::vector<unsigned char>;

/// Saves or restores one row. Its functions must be called in the order of declaration.
class World::Restorer {
 public:
  explicit Restorer(World* world) : world_(*world), engine_(*world->engine_) {}

  /// Flags the models that update in the next step, before anything can read their readings.
  OmittedReadings FindDue();
  void Save(const OmittedReadings& omitted, StateRow* row);
  /// Restores `row`, and saves what that changes in *before. Returns "" or an error; after an error
  /// the world may be in any state.
  std::string Restore(const StateRow& row, StateRow* before);
  /// True if *before is complete and the world has begun to change.
  bool has_begun() const { return has_begun_; }
  /// Undoes Restore().
  void PutBack(const StateRow& before);
  static OmittedReadings OmittedReadingsOf(const StateRow& row);

 private:
  void SaveList(StateRow* row);
  void SaveRest(const OmittedReadings& omitted, StateRow* row);
  void ReleaseIds();
  std::string RestoreAll(const StateRow& row);
  std::string RestoreChanged(const StateRow& row, const StateRow& before);
  template <typename F>
  std::string RestoreSections(const StateRow& row, F is_same);
  void DropReadings(const StateRow& row);
  std::string ReadList(const StateRow& row);
  std::string Check() const;
  bool HasCycle() const;
  bool Fits(const Listed& listed) const;
  void FindModels();
  void MakeMissing();
  Model* Make(const Listed& listed, Model* parent);
  void LoadParts(Model* model, int entity);
  void Arrange();
  bool IsTree() const;
  void EraseSurplus();
  void DeleteSurplus();

  World& world_;
  WorldEngine& engine_;
  bool has_begun_ = false;
  std::vector<Listed> list_;
  std::vector<Model*> models_;   // one per entry of list_
  std::vector<Model*> surplus_;  // models not in the list, to be deleted
  std::vector<size_t> created_;  // indices of created models in the list
};

OmittedReadings World::Restorer::FindDue() {
  OmittedReadings due(engine_.models.size(), 0);
  const usec_t next = world_.sim_time + world_.sim_interval;
  engine_.scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (time <= next && event.model && !event.callback &&
        event.model->ExpectsUpdate(event.generation))
      due[PlaceOf(engine_.models, event.model)] = 1;
  });
  return due;
}

void World::Restorer::Save(const OmittedReadings& omitted, StateRow* row) {
  SaveList(row);
  SaveRest(omitted, row);
}

/// Saves the sections after the list.
void World::Restorer::SaveRest(const OmittedReadings& omitted, StateRow* row) {
  const std::vector<Model*>& models = engine_.models;
  STAGE_ASSERT(row->count() == kOmitted);  // after SaveList()
  StateExchange exchange(models, &row->bytes);
  const auto end_section = [&] { row->ends.push_back(static_cast<uint32_t>(exchange.saved())); };
  OmittedReadings flags = omitted;
  flags.resize(models.size(), 0);
  exchange.Plain(flags.data(), flags.size());
  end_section();
  world_.ExchangeHead(exchange);
  end_section();
  for (size_t i = 0; i < models.size(); i++) {
    exchange.OmitReadings(flags[i] != 0);
    models[i]->ExchangeState(exchange);
    end_section();
  }
  world_.ExchangeSchedules(exchange);
  end_section();
  world_.ExchangeNames(exchange);
  end_section();
  world_.ExchangeGridState(exchange);
  end_section();
  STAGE_ASSERT(row->count() == models.size() + kOtherSections);
}

/// Saves the list as the first section, in the format of a vector of Listed.
void World::Restorer::SaveList(StateRow* row) {
  row->Clear();
  const std::vector<Model*>& models = engine_.models;
  StateExchange exchange(models, &row->bytes);
  exchange.Count(models.size());
  for (const Model* model : models) {
    Listed listed{model->id, model->parent ? PlaceOf(models, model->parent) + 1 : 0,
                  model->wf_entity, model->type};
    exchange(listed);
  }
  exchange.Finish();
  row->ends.push_back(static_cast<uint32_t>(row->bytes.size()));
}

std::string World::Restorer::Restore(const StateRow& row, StateRow* before) {
  SaveList(before);
  const bool same_models = row.count() > kModels &&
                           row.count() == engine_.models.size() + kOtherSections &&
                           SameBytes(row.section(kList), before->section(kList));
  SaveRest(same_models ? OmittedReadingsOf(row) : OmittedReadings(), before);
  has_begun_ = true;
  std::string wrong = same_models ? RestoreChanged(row, *before) : RestoreAll(row);
  if (wrong.empty()) DropReadings(row);
  ReleaseIds();
  return wrong;
}

/// Allows models created from now on to reuse the ids of deleted ones.
void World::Restorer::ReleaseIds() {
  engine_.scheduler.RemoveCancelled();
  engine_.names.RemoveStale(engine_);
}

void World::Restorer::PutBack(const StateRow& before) {
  RestoreAll(before);
  ReleaseIds();
}

OmittedReadings World::Restorer::OmittedReadingsOf(const StateRow& row) {
  const std::span<const unsigned char> flags = row.section(kOmitted);
  return OmittedReadings(flags.begin(), flags.end());
}

void World::Restorer::DropReadings(const StateRow& row) {
  const std::span<const unsigned char> omitted = row.section(kOmitted);
  STAGE_ASSERT(omitted.size() == engine_.models.size());
  for (size_t i = 0; i < omitted.size(); i++)
    if (omitted[i] != 0) engine_.models[i]->DropReadings();
}

/// Restores only sections that differ from `before`. The models must be the same.
std::string World::Restorer::RestoreChanged(const StateRow& row, const StateRow& before) {
  models_ = engine_.models;
  std::string wrong =
      RestoreSections(row, [&](size_t i) { return SameBytes(row.section(i), before.section(i)); });
  engine_.fiducials->Forget(nullptr);
  return wrong;
}

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

/// is_same(i) tells whether the world is in the state of section i already. Returns "" or an error.
template <typename F>
std::string World::Restorer::RestoreSections(const StateRow& row, F is_same) {
  std::string wrong;
  const std::span<const unsigned char> omitted = row.section(kOmitted);
  STAGE_ASSERT(row.count() == models_.size() + kOtherSections);
  if (omitted.size() != models_.size())
    return "found a number of models that differs from the list";
  const auto restore = [&](size_t i, auto exchange_state) {
    if (!wrong.empty()) return;
    const std::span<const unsigned char> section = row.section(i);
    StateExchange exchange(models_, section.data(), section.size());
    exchange_state(exchange);
    if (exchange.left() > 0) exchange.Fail("found extra bytes after the state of a section");
    if (exchange.failed()) wrong = exchange.message();
  };
  restore(kHead, [&](StateExchange& exchange) { world_.ExchangeHead(exchange); });
  for (size_t i = 0; i < models_.size(); i++) {
    if (is_same(kModels + i)) continue;
    restore(kModels + i, [&](StateExchange& exchange) {
      exchange.OmitReadings(omitted[i] != 0);
      models_[i]->ExchangeState(exchange);
    });
  }
  const size_t plans = kModels + models_.size(), names = plans + 1, places = names + 1;
  restore(plans, [&](StateExchange& exchange) { world_.ExchangeSchedules(exchange); });
  if (!is_same(names))
    restore(names, [&](StateExchange& exchange) { world_.ExchangeNames(exchange); });
  restore(places, [&](StateExchange& exchange) { world_.ExchangeGridState(exchange); });
  return wrong;
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

bool World::Take(Snapshot* to, Snapshot::Keep keep) const {
  World* const world = const_cast<World*>(this);  // it is not modified
  if (!engine_->IsIdle()) return Refuse("a snapshot can't be taken by a callback");
  for (const Model* model : engine_->models)
    if (!model->DeclaresState())
      return Refuse("a snapshot can't be taken: a controller of " +
                    messages::Quoted(model->TokenStr()) +
                    " does not declare its state with KeepState() or DeclareNoState()");
  if (const std::string waiting = world->PendingCallback(); !waiting.empty())
    return Refuse("a snapshot can't be taken: " + waiting);
  SnapshotBuffers& buffers = *engine_->snapshot_buffers;
  Restorer saver(world);
  saver.Save(keep == Snapshot::kLean ? saver.FindDue() : OmittedReadings(), &buffers.row);
  if (keep == Snapshot::kLean) {
    buffers.KeepDifference(&to->row_, &to->difference_);
  } else {
    to->row_ = std::make_shared<const StateRow>(buffers.row);
    to->difference_.reset();
  }
  to->time_ = sim_time;
  to->is_from_file_ = false;
  return true;
}

/// Name of a pending Enqueue() callback, if any: its argument cannot be saved.
std::string World::PendingCallback() {
  std::string who;
  engine_->scheduler.ForEach([&](usec_t, const Scheduler::Event& event) {
    if (!event.callback || !who.empty()) return;
    who = "a callback of Enqueue() is pending";
    if (event.model) who += " for " + messages::Quoted(event.model->TokenStr());
  });
  return who;
}

bool World::Restore(const Snapshot& from) {
  if (from.empty()) return Refuse("cannot restore a snapshot that was never taken");
  if (!engine_->IsIdle()) return Refuse("a callback cannot restore a snapshot");
  if (const std::string waiting = PendingCallback(); !waiting.empty())
    return Refuse("cannot restore the snapshot: " + waiting);
  engine_->RunDeferredDeletes();
  engine_->TraceBatch();
  SnapshotBuffers& buffers = *engine_->snapshot_buffers;
  const StateRow& row = from.Row(&buffers.row);
  std::string wrong;
  Restorer restorer(this);
  try {
    wrong = restorer.Restore(row, &buffers.before);
    if (wrong.empty() && from.is_from_file_ && !(IsIn(row) && engine_->scene.grid.LiesInExtent()))
      wrong = "found an inconsistent state";
  } catch (...) {  // out of memory, or thrown by a controller's Init()
    if (restorer.has_begun()) Restorer(this).PutBack(buffers.before);
    throw;
  }
  if (wrong.empty()) {
    if (from.difference_) buffers.shared = from.row_;
    engine_->metrics.Start(*this);
    return true;
  }
  Restorer(this).PutBack(buffers.before);
  return Refuse("cannot restore the snapshot: " + wrong);
}

bool World::IsIn(const StateRow& row) {
  Restorer saver(this);
  StateRow now;
  saver.Save(Restorer::OmittedReadingsOf(row), &now);
  return now == row;
}

}  // namespace Stg
