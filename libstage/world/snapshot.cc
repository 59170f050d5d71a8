// SPDX-License-Identifier: GPL-2.0-or-later
//
// Takes and restores snapshots of worlds.
//
// A snapshot that fits the world, see Restorer::Fits(), is restored directly. For any other one,
// the world's state is saved first, and put back if restoring fails.

#include "world/snapshot.hh"

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/state_exchange.hh"
#include "random/fnv1a.hh"
#include "world/engine.hh"
#include "world/restorer.hh"
#include "world/snapshot_buffers.hh"
#include "world/world.hh"

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

bool Refuse(const std::string& what) {
  messages::Report(LogLevel::kError, "stage: " + what);
  return false;
}

}  // namespace

OmittedReadings World::Restorer::FindDue() {
  OmittedReadings due(engine_.models.size(), 0);
  const usec_t next = world_.sim_time + world_.sim_interval;
  engine_.scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (time <= next && event.model && !event.callback &&
        event.model->ExpectsUpdate(event.generation))
      due[PlaceOf(event.model)] = 1;
  });
  return due;
}

void World::Restorer::Save(const OmittedReadings& omitted, StateRow* row) {
  const std::vector<Model*>& models = engine_.models;
  row->Clear();
  row->fit = Fit();
  StateExchange exchange(models, &row->bytes);
  const auto end_section = [&] { row->ends.push_back(static_cast<uint32_t>(exchange.saved())); };
  const auto copy_section = [&](const StateRow::Bytes& bytes) {
    exchange.Plain(const_cast<unsigned char*>(bytes.data()), bytes.size());
    end_section();
  };
  copy_section(List().section);
  OmittedReadings flags = omitted;
  flags.resize(models.size(), 0);
  copy_section(flags);
  world_.ExchangeHead(exchange);
  end_section();
  for (size_t i = 0; i < models.size(); i++) {
    exchange.OmitReadings(flags[i] != 0);
    models[i]->ExchangeState(exchange);
    end_section();
  }
  world_.ExchangeSchedules(exchange);
  end_section();
  copy_section(Names());
  world_.ExchangeGridState(exchange);
  end_section();
  STAGE_ASSERT(row->count() == models.size() + kOtherSections);
}

std::string World::Restorer::RestoreDirectly(const StateRow& row) {
  models_ = engine_.models;
  const size_t names = kModels + models_.size() + 1;
  std::string wrong = RestoreSections(
      row, [&](size_t i) { return i == names && SameBytes(row.section(i), Names()); });
  engine_.fiducials->Forget(nullptr);
  if (wrong.empty()) DropReadings(row);
  ReleaseIds();
  return wrong;
}

std::string World::Restorer::RestoreOrPutBack(const StateRow& row, bool validates) {
  StateRow& before = buffers_.before;
  std::string wrong;
  bool has_begun = false;
  try {
    const bool same_models = HasModelsOf(row);
    Save(same_models ? OmittedReadingsOf(row) : OmittedReadings(), &before);
    has_begun = true;
    wrong = same_models ? RestoreChanged(row, before) : RestoreAll(row);
    if (wrong.empty()) DropReadings(row);
    ReleaseIds();
    if (wrong.empty() && validates && !(IsIn(row) && engine_.scene.grid.LiesInExtent()))
      wrong = "found an inconsistent state";
  } catch (...) {  // out of memory, or thrown by a controller's Init()
    if (has_begun) Restorer(&world_).PutBack(before);
    throw;
  }
  if (!wrong.empty()) Restorer(&world_).PutBack(before);
  return wrong;
}

/// True if saving the world would give this row.
bool World::Restorer::IsIn(const StateRow& row) const {
  StateRow now;
  Restorer(&world_).Save(OmittedReadingsOf(row), &now);
  return now == row;
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
  for (size_t i = 0; i < omitted.size(); i++) {
    if (omitted[i] == 0) continue;
    Model& model = *engine_.models[i];
    model.DropReadings();
    if (!model.pose_before_push_) continue;
    model.pose_before_push_.reset();
    engine_.contacts_changed = true;  // the next step makes the pose again
  }
}

/// Restores only sections that differ from `before`. The models must be the same.
std::string World::Restorer::RestoreChanged(const StateRow& row, const StateRow& before) {
  models_ = engine_.models;
  std::string wrong =
      RestoreSections(row, [&](size_t i) { return SameBytes(row.section(i), before.section(i)); });
  engine_.fiducials->Forget(nullptr);
  return wrong;
}

/// is_same(i) tells whether the world is in the state of section i already. Returns "" or an error.
std::string World::Restorer::RestoreSections(const StateRow& row,
                                             const std::function<bool(size_t)>& is_same) {
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
  Restorer restorer(this);
  const std::string wrong = !from.is_from_file_ && restorer.Fits(row)
                                ? restorer.RestoreDirectly(row)
                                : restorer.RestoreOrPutBack(row, from.is_from_file_);
  if (!wrong.empty()) return Refuse("cannot restore the snapshot: " + wrong);
  if (from.difference_) buffers.shared = from.row_;
  engine_->metrics.Start(*this);
  return true;
}

}  // namespace Stg
