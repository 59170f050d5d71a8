// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of a world: everything that decides its future. docs/architecture.md lists what else a
// world holds and why that is not part of the state.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/wifi.hh"
#include "world/engine.hh"
#include "world/rasterized_body.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// True if the models are in the order of creation, without duplicates.
bool IsInOrder(const std::vector<Model*>& models) {
  for (size_t i = 0; i < models.size(); i++)
    if (!models[i] || (i > 0 && models[i - 1]->GetId() >= models[i]->GetId())) return false;
  return true;
}

}  // namespace

uint64_t World::StateHash() const {
  StateExchange exchange(engine_->models);
  const_cast<World*>(this)->ExchangeState(exchange);  // hashing does not modify the world
  return exchange.hash();
}

void World::ExchangeState(StateExchange& exchange) {
  ExchangeHead(exchange);
  exchange.Expect(exchange.models().size(), "the number of models");
  for (Model* model : exchange.models()) model->ExchangeState(exchange);
  ExchangeSchedules(exchange);
  ExchangeNames(exchange);
  ExchangeGridState(exchange);
}

/// Exchanges the world's own values that precede its models.
void World::ExchangeHead(StateExchange& exchange) {
  engine_->TraceBatch();
  exchange(sim_time, updates, sim_interval, random_);
  ExchangeOwn(exchange);
  Ancestor::ExchangeState(exchange);
}

/// Not hashed: values that determined the seeds and ids of existing models and otherwise matter
/// only for models created later.
void World::ExchangeOwn(StateExchange& exchange) {
  if (exchange.hashing()) return;
  sensing::Scene& scene = engine_->scene;
  StateChoice ray_model(&scene.ray_model, RayModel::kExact);
  StateChoice contact_model(&engine_->contact_model, ContactModel::kOutlines);
  exchange(options_.seed, engine_->next_model_id, ray_model, contact_model);
  if (exchange.restoring()) engine_->contacts_known = false;
  double resolution = scene.cells_per_metre;
  exchange(resolution);
  if (resolution != scene.cells_per_metre) exchange.Fail("found another resolution of the grid");
}

/// Comes after the models, since restoring them changes the totals.
void World::ExchangeTotals(StateExchange& exchange) {
  EnergyTotals& totals = engine_->energy_totals;
  if (!exchange.hashing())
    exchange(totals.stored, totals.capacity, totals.dissipated, totals.input);
}

/// Lists models that are missing from the grid because they were changed and not rasterized again.
/// When restoring, other models may be missing because they were created or got another parent.
void World::ExchangeUnrasterized(StateExchange& exchange) {
  if (exchange.hashing()) return;
  std::vector<Model*> unrasterized;
  if (!exchange.restoring())
    for (Model* model : exchange.models())
      if (model->blockgroup->IsUnrasterized()) unrasterized.push_back(model);
  exchange(unrasterized);
  if (!exchange.restoring() || exchange.failed()) return;
  for (Model* model : exchange.models())
    if (model->blockgroup->IsUnrasterized() &&
        std::ranges::find(unrasterized, model) == unrasterized.end())
      model->Map();
  for (Model* model : unrasterized)
    if (model) model->blockgroup->Erase();
}

/// Exchanges the schedule and the lists of models that move and that use energy.
void World::ExchangeSchedules(StateExchange& exchange) {
  ExchangeSchedule(exchange);
  exchange(engine_->moving, engine_->energy);
  if (exchange.restoring() && !(IsInOrder(engine_->moving) && IsInOrder(engine_->energy)))
    exchange.Fail("found a list of models that is not in order");
  if (!exchange.hashing()) return;  // otherwise they follow from the models
  exchange.Expect(engine_->radios.size(), "the number of radios");
  for (Model* radio : engine_->radios) exchange(radio);
}

/// Exchanges the events in the order in which they will run.
void World::ExchangeSchedule(StateExchange& exchange) {
  if (!exchange.hashing()) {
    size_t events = 0;
    engine_->scheduler.ForEach([&](usec_t, const Scheduler::Event& event) {
      events += !event.callback && event.model && event.model->ExpectsUpdate(event.generation);
    });
    events = exchange.Count(events);
    if (exchange.restoring()) return RestoreSchedule(events, exchange);
  }
  engine_->scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (event.callback ? !exchange.hashing()
                       : !event.model || !event.model->ExpectsUpdate(event.generation))
      return;
    Model* model = event.model;
    bool is_update = event.callback == nullptr;
    // Relative times make snapshots of different moments more similar, and so smaller.
    if (!exchange.hashing()) time -= sim_time;
    exchange(time, model, is_update);
  });
}

/// Voids pending updates and schedules those of the snapshot with new generation numbers.
void World::RestoreSchedule(uint64_t events, StateExchange& exchange) {
  engine_->scheduler.Clear();
  for (Model* model : exchange.models())
    model->update_generation_ = UpdateGeneration::Next(UpdateGeneration::First(model->id));
  for (uint64_t i = 0; i < events && !exchange.failed(); i++) {
    usec_t time = 0;
    Model* model = nullptr;
    bool is_update = true;
    exchange(time, model, is_update);
    if (exchange.failed()) return;
    if (!model || !is_update)
      return exchange.Fail("found an event that is not an update of a model");
    engine_->scheduler.Add(time + sim_time, {model, nullptr, nullptr, model->update_generation_});
  }
}

void World::ExchangeNames(StateExchange& exchange) {
  std::vector<std::pair<std::string, Model*>> names;
  engine_->names.ForEach([&](const std::string& name, uint32_t id) {
    if (Model* bearer = engine_->FindModel(id)) names.push_back({name, bearer});
  });
  if (!exchange.hashing()) names.resize(exchange.Count(names.size()));
  if (exchange.restoring()) engine_->names.Clear();
  for (auto& [name, bearer] : names) {
    exchange(name, bearer);
    if (exchange.restoring() && bearer) engine_->names.Add(bearer, name);
  }
}

/// Exchanges energy totals, models that are not rasterized, and the order and extent of bodies in
/// the grid.
void World::ExchangeGridState(StateExchange& exchange) {
  ExchangeTotals(exchange);
  ExchangeUnrasterized(exchange);
  ExchangeGrid(exchange);
}

namespace {

/// True if the body shares a cell with another one.
bool SharesCells(const grid::Grid& cells, const Block& block) {
  const auto is_other = [&](grid::BodyId id) { return id != block.body(); };
  return std::ranges::any_of(block.cells(), [&](const grid::CellSet& set) {
    bool shared = false;
    grid::ForEachBit(cells.Crowded(set), [&](uint32_t bit) {
      shared = shared || cells.AnyIn(grid::CellOf(set.slot, bit), is_other);
    });
    return shared;
  });
}

}  // namespace

/// Unless `all`, returns only bodies of models that have been rasterized since loading.
std::vector<World::RasterizedBody> World::BodiesOf(const std::vector<Model*>& models,
                                                   const grid::Grid& grid, bool all) {
  std::vector<RasterizedBody> bodies;
  for (uint32_t i = 0; i < models.size(); i++) {
    if (!all && !models[i]->body().rasterized_since_loading()) continue;
    uint32_t number = 0;
    for (const auto& block : models[i]->body().blocks())
      if (block->rasterized())
        bodies.push_back({i, number++, block.get(), grid.Stamp(block->body()), false});
  }
  return bodies;
}

/// In a shared cell, bodies are tested against a ray in the order in which they were rasterized.
/// The extent matters because cameras look as far as the grid extends.
void World::ExchangeGrid(StateExchange& exchange) {
  grid::Grid& grid = engine_->scene.grid;
  if (exchange.hashing())
    HashOrder(exchange);
  else
    ExchangeOrder(exchange);
  grid::CellBox extent_of_grid = grid.extent();
  exchange(extent_of_grid.min_x, extent_of_grid.min_y, extent_of_grid.max_x, extent_of_grid.max_y);
  if (exchange.restoring() && !exchange.failed()) grid.SetExtent(extent_of_grid);
}

/// Only bodies that share a cell are ordered; the others are not hashed.
void World::HashOrder(StateExchange& exchange) {
  const grid::Grid& grid = engine_->scene.grid;
  std::vector<uint64_t> stamps;
  for (const RasterizedBody& body : BodiesOf(engine_->models, grid, true))
    stamps.push_back(SharesCells(grid, *body.block) ? body.stamp : 0);
  std::vector<uint64_t> order = stamps;
  std::ranges::sort(order);
  for (const uint64_t stamp : stamps) {
    if (stamp == 0) continue;
    uint64_t rank = static_cast<uint64_t>(std::ranges::lower_bound(order, stamp) - order.begin());
    exchange(rank);
  }
}

/// Exchanges the bodies rasterized since loading, in rasterization order. All others, mostly
/// scenery, precede them in the order of creation.
void World::ExchangeOrder(StateExchange& exchange) {
  const std::vector<Model*>& models = exchange.models();
  const grid::Grid& grid = engine_->scene.grid;
  std::vector<RasterizedBody> recent;
  if (!exchange.restoring()) {
    for (const RasterizedBody& body : BodiesOf(models, grid, false))
      if (body.stamp > engine_->last_stamp_of_loading) recent.push_back(body);
    std::ranges::sort(recent, {}, &RasterizedBody::stamp);
  }
  exchange(recent);
  if (!exchange.restoring() || exchange.failed()) return;
  if (!RestoreOrder(models, &recent)) exchange.Fail("found an invalid order of bodies");
}

/// Puts the bodies in *recent, in this order, after all others, which return to the order of
/// creation. Returns false if one does not exist or is listed twice.
bool World::RestoreOrder(const std::vector<Model*>& models, std::vector<RasterizedBody>* recent) {
  grid::Grid& grid = engine_->scene.grid;
  for (const RasterizedBody& listed : *recent)
    if (listed.model < models.size())
      models[listed.model]->blockgroup->SetRasterizedSinceLoading(true);
  std::vector<RasterizedBody> bodies = BodiesOf(models, grid, false);
  if (!MarkRecent(&bodies, recent)) return false;
  RestoreCreationOrder(models, bodies);
  for (const RasterizedBody& body : *recent)
    grid.MoveToEnd(body.block->body(), body.block->cells());
  return true;
}

/// Finds the late bodies among all bodies and completes their entries. Returns false if one does
/// not exist or is listed twice.
bool World::MarkRecent(std::vector<RasterizedBody>* bodies, std::vector<RasterizedBody>* recent) {
  for (RasterizedBody& listed : *recent) {
    const auto body = std::lower_bound(
        bodies->begin(), bodies->end(), listed,
        [](const RasterizedBody& a, const RasterizedBody& b) { return a.IsBefore(b); });
    if (body == bodies->end() || listed.IsBefore(*body) || body->is_recent) return false;
    body->is_recent = true;
    listed = *body;
  }
  return true;
}

/// Bodies that are not late but have been rasterized in this world since loading return to their
/// place in the order of creation.
void World::RestoreCreationOrder(const std::vector<Model*>& models,
                                 const std::vector<RasterizedBody>& bodies) {
  grid::Grid& grid = engine_->scene.grid;
  const auto is_out_of_order = [&](const RasterizedBody& body) {
    return !body.is_recent && body.stamp > engine_->last_stamp_of_loading;
  };
  const bool all_known = std::ranges::all_of(bodies, [&](const RasterizedBody& body) {
    return !is_out_of_order(body) || body.block->loading_stamp() != 0;
  });
  if (!all_known) return ReorderAll(models);
  for (const RasterizedBody& body : bodies)
    if (is_out_of_order(body))
      grid.Restamp(body.block->body(), body.block->loading_stamp(), body.block->cells());
}

/// Reorders all bodies in the order of creation, as after loading.
void World::ReorderAll(const std::vector<Model*>& models) {
  grid::Grid& grid = engine_->scene.grid;
  for (const RasterizedBody& body : BodiesOf(models, grid, true)) {
    grid.MoveToEnd(body.block->body(), body.block->cells());
    body.block->NoteLoadingStamp(grid.last_stamp());
  }
  engine_->last_stamp_of_loading = grid.last_stamp();
  STAGE_ASSERT(std::ranges::is_sorted(BodiesOf(models, grid, true), {}, &RasterizedBody::stamp));
}

/// Call it when all models have just been rasterized in the order of creation.
void World::MarkAllRasterized() {
  const grid::Grid& grid = engine_->scene.grid;
  engine_->last_stamp_of_loading = grid.last_stamp();
  const std::vector<RasterizedBody> bodies = BodiesOf(engine_->models, grid, true);
  if (std::ranges::is_sorted(bodies, {}, &RasterizedBody::stamp))
    for (const RasterizedBody& body : bodies) body.block->NoteLoadingStamp(body.stamp);
  else  // a type created models before their parents, or a body lies outside the range of cells
    ReorderAll(engine_->models);
  for (Model* model : engine_->models) model->blockgroup->SetRasterizedSinceLoading(false);
}

/// Call it when all models have been rasterized, some of them after `stamp` and in any order.
/// Restores the order of creation.
void World::MarkAllRasterizedSince(uint64_t stamp) {
  STAGE_ASSERT(stamp <= engine_->scene.grid.last_stamp());
  engine_->last_stamp_of_loading = stamp;
  RestoreCreationOrder(engine_->models, BodiesOf(engine_->models, engine_->scene.grid, true));
  MarkAllRasterized();
}

}  // namespace Stg
