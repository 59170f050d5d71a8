// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of a world: everything that decides its future. docs/architecture.md says what else a
// world keeps, and why that has no part in it.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "models/block.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/wifi.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// In the order of creation, each once.
bool IsInOrder(const std::vector<Model*>& models) {
  for (size_t i = 0; i < models.size(); i++)
    if (!models[i] || (i > 0 && models[i - 1]->GetId() >= models[i]->GetId())) return false;
  return true;
}

}  // namespace

uint64_t World::StateHash() const {
  StateExchange exchange(engine_->models);
  const_cast<World*>(this)->ExchangeState(exchange);  // hashing changes nothing
  return exchange.hash();
}

void World::ExchangeState(StateExchange& exchange) {
  ExchangeHead(exchange);
  exchange.Expect(exchange.models().size(), "the number of models");
  for (Model* model : exchange.models()) model->ExchangeState(exchange);
  ExchangePlans(exchange);
  ExchangeNames(exchange);
  ExchangePlaces(exchange);
}

/// The world's own values that come before its models.
void World::ExchangeHead(StateExchange& exchange) {
  engine_->TraceBatch();
  exchange(sim_time, updates, sim_interval, random_);
  ExchangeOwn(exchange);
  Ancestor::ExchangeState(exchange);
}

/// Not hashed: values that have already decided the models' seeds and numbers, and count only for
/// models that are made later.
void World::ExchangeOwn(StateExchange& exchange) {
  if (exchange.hashing()) return;
  sensing::Scene& scene = engine_->scene;
  StateChoice ray_model(&scene.ray_model, RayModel::kExact);
  exchange(options_.seed, engine_->next_model_id, ray_model);
  double resolution = scene.cells_per_metre;
  exchange(resolution);
  if (resolution != scene.cells_per_metre) exchange.Fail("found another resolution of the grid");
}

/// Models have changed them while they were restored.
void World::ExchangeTotals(StateExchange& exchange) {
  EnergyTotals& totals = energy_totals_;
  if (!exchange.hashing())
    exchange(totals.stored, totals.capacity, totals.dissipated, totals.input);
}

/// Models whose bodies are not in the grid, as they were changed and not drawn since, are listed.
/// Others may lack a drawing because they have got another parent, or have just been made.
void World::ExchangeUndrawn(StateExchange& exchange) {
  if (exchange.hashing()) return;
  std::vector<Model*> undrawn;
  if (!exchange.restoring())
    for (Model* model : exchange.models())
      if (model->blockgroup->IsUndrawn()) undrawn.push_back(model);
  exchange(undrawn);
  if (!exchange.restoring() || exchange.failed()) return;
  for (Model* model : exchange.models())
    if (model->blockgroup->IsUndrawn() && std::ranges::find(undrawn, model) == undrawn.end())
      model->Map();
  for (Model* model : undrawn)
    if (model) model->blockgroup->Erase();
}

/// The schedule, and the lists of models that move and that use energy.
void World::ExchangePlans(StateExchange& exchange) {
  ExchangeSchedule(exchange);
  exchange(engine_->moving, engine_->energy);
  if (exchange.restoring() && !(IsInOrder(engine_->moving) && IsInOrder(engine_->energy)))
    exchange.Fail("found a list of models that is not in order");
  if (!exchange.hashing()) return;  // else they are what models there are
  exchange.Expect(engine_->radios.size(), "the number of radios");
  for (Model* radio : engine_->radios) exchange(radio);
}

/// In the order in which it will happen.
void World::ExchangeSchedule(StateExchange& exchange) {
  if (!exchange.hashing()) {
    size_t events = 0;
    engine_->scheduler.ForEach([&](usec_t, const Scheduler::Event& event) {
      events += !event.callback && event.model && event.model->ExpectsUpdate(event.chain);
    });
    events = exchange.Count(events);
    if (exchange.restoring()) return RestoreSchedule(events, exchange);
  }
  engine_->scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (event.callback ? !exchange.hashing()
                       : !event.model || !event.model->ExpectsUpdate(event.chain))
      return;
    Model* model = event.model;
    bool is_update = event.callback == nullptr;
    // Snapshots of different moments have as much in common as they can.
    if (!exchange.hashing()) time -= sim_time;
    exchange(time, model, is_update);
  });
}

/// Pending updates become void, and those of the snapshot get new numbers.
void World::RestoreSchedule(uint64_t events, StateExchange& exchange) {
  engine_->scheduler.Clear();
  for (Model* model : exchange.models())
    model->update_chain_ = UpdateChain::Next(UpdateChain::First(model->id));
  for (uint64_t i = 0; i < events && !exchange.failed(); i++) {
    usec_t time = 0;
    Model* model = nullptr;
    bool is_update = true;
    exchange(time, model, is_update);
    if (exchange.failed()) return;
    if (!model || !is_update) return exchange.Fail("found an event that is no model's update");
    engine_->scheduler.Add(time + sim_time, {model, nullptr, nullptr, model->update_chain_});
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

/// Where bodies are, but for what the models' poses say.
void World::ExchangePlaces(StateExchange& exchange) {
  ExchangeTotals(exchange);
  ExchangeUndrawn(exchange);
  ExchangeGrid(exchange);
}

/// A body that is drawn, not for the exact ray model.
struct World::DrawnBody {
  uint32_t model = 0, number = 0;  // of the model's place, and among its bodies
  Block* block = nullptr;
  uint64_t stamp = 0;
  bool drawn_late = false;

  void ExchangeState(StateExchange& exchange) { exchange(model, number); }
  bool IsBefore(const DrawnBody& o) const {
    return model != o.model ? model < o.model : number < o.number;
  }
};

namespace {

/// It shares a cell with others.
bool SharesCells(const grid::Grid& cells, const Block& block) {
  const auto is_other = [&](grid::BodyId id) { return id != block.body(); };
  return std::ranges::any_of(block.cells(), [&](const grid::TilePart& part) {
    bool shared = false;
    grid::ForEachBit(cells.Crowded(part), [&](uint32_t bit) {
      shared = shared || cells.AnyIn(grid::CellOf(part.slot, bit), is_other);
    });
    return shared;
  });
}

}  // namespace

/// `all`: not only those of models that have been drawn since the world was loaded.
std::vector<World::DrawnBody> World::BodiesOf(const std::vector<Model*>& models,
                                              const grid::Grid& grid, bool all) {
  std::vector<DrawnBody> bodies;
  for (uint32_t i = 0; i < models.size(); i++) {
    if (!all && !models[i]->body().drawn_since_loading()) continue;
    uint32_t number = 0;
    for (const auto& block : models[i]->body().blocks())
      if (block->drawn())
        bodies.push_back({i, number++, block.get(), grid.Stamp(block->body()), false});
  }
  return bodies;
}

/// Where several bodies share a cell, the one that was drawn there first is asked first whether it
/// stops a ray; and cameras look as far as the grid extends.
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

/// Bodies that are alone have no order.
void World::HashOrder(StateExchange& exchange) {
  const grid::Grid& grid = engine_->scene.grid;
  std::vector<uint64_t> stamps;
  for (const DrawnBody& body : BodiesOf(engine_->models, grid, true))
    stamps.push_back(SharesCells(grid, *body.block) ? body.stamp : 0);
  std::vector<uint64_t> order = stamps;
  std::ranges::sort(order);
  for (const uint64_t stamp : stamps) {
    if (stamp == 0) continue;
    uint64_t rank = static_cast<uint64_t>(std::ranges::lower_bound(order, stamp) - order.begin());
    exchange(rank);
  }
}

/// Saves the bodies that have been drawn since the world was loaded, in the order of drawing. All
/// others, mostly scenery, are in the order of creation and come before these.
void World::ExchangeOrder(StateExchange& exchange) {
  const std::vector<Model*>& models = exchange.models();
  const grid::Grid& grid = engine_->scene.grid;
  std::vector<DrawnBody> late;
  if (!exchange.restoring()) {
    for (const DrawnBody& body : BodiesOf(models, grid, false))
      if (body.stamp > engine_->last_stamp_of_loading) late.push_back(body);
    std::ranges::sort(late, {}, &DrawnBody::stamp);
  }
  exchange(late);
  if (!exchange.restoring() || exchange.failed()) return;
  for (const DrawnBody& listed : late)
    if (listed.model < models.size()) models[listed.model]->blockgroup->NoteDrawnSinceLoading(true);
  std::vector<DrawnBody> bodies = BodiesOf(models, grid, false);
  if (!MarkLate(&bodies, &late)) return exchange.Fail("found an order of bodies that is none");
  ReturnEarly(models, bodies);
  for (const DrawnBody& body : late)
    engine_->scene.grid.MoveToEnd(body.block->body(), body.block->cells());
}

/// Finds the late ones among the bodies, and fills in what is known of them. False if one is not
/// there, or is listed twice.
bool World::MarkLate(std::vector<DrawnBody>* bodies, std::vector<DrawnBody>* late) {
  for (DrawnBody& listed : *late) {
    const auto body =
        std::lower_bound(bodies->begin(), bodies->end(), listed,
                         [](const DrawnBody& a, const DrawnBody& b) { return a.IsBefore(b); });
    if (body == bodies->end() || listed.IsBefore(*body) || body->drawn_late) return false;
    body->drawn_late = true;
    listed = *body;
  }
  return true;
}

/// Bodies that are not late, but have been drawn in this world since it was loaded, go back to
/// their place in the order of creation.
void World::ReturnEarly(const std::vector<Model*>& models, const std::vector<DrawnBody>& bodies) {
  grid::Grid& grid = engine_->scene.grid;
  const auto is_out_of_order = [&](const DrawnBody& body) {
    return !body.drawn_late && body.stamp > engine_->last_stamp_of_loading;
  };
  const bool all_known = std::ranges::all_of(bodies, [&](const DrawnBody& body) {
    return !is_out_of_order(body) || body.block->loading_stamp() != 0;
  });
  if (!all_known) return DrawInOrder(models);
  for (const DrawnBody& body : bodies)
    if (is_out_of_order(body))
      grid.Restamp(body.block->body(), body.block->loading_stamp(), body.block->cells());
}

/// Brings all bodies into the order of creation, in which a world is loaded.
void World::DrawInOrder(const std::vector<Model*>& models) {
  grid::Grid& grid = engine_->scene.grid;
  for (const DrawnBody& body : BodiesOf(models, grid, true)) {
    grid.MoveToEnd(body.block->body(), body.block->cells());
    body.block->NoteLoadingStamp(grid.last_stamp());
  }
  engine_->last_stamp_of_loading = grid.last_stamp();
}

/// To be called when all models have just been drawn, the older ones first.
void World::NoteAllDrawn() {
  const grid::Grid& grid = engine_->scene.grid;
  engine_->last_stamp_of_loading = grid.last_stamp();
  const std::vector<DrawnBody> bodies = BodiesOf(engine_->models, grid, true);
  if (std::ranges::is_sorted(bodies, {}, &DrawnBody::stamp))
    for (const DrawnBody& body : bodies) body.block->NoteLoadingStamp(body.stamp);
  else  // a type has made models before those that stand above it, or a body lies beyond all cells
    DrawInOrder(engine_->models);
  for (Model* model : engine_->models) model->blockgroup->NoteDrawnSinceLoading(false);
}

/// To be called when all models have been drawn, some of them after this stamp and in any order:
/// the order becomes that of creation.
void World::NoteAllDrawnSince(uint64_t stamp) {
  engine_->last_stamp_of_loading = stamp;
  ReturnEarly(engine_->models, BodiesOf(engine_->models, engine_->scene.grid, true));
  NoteAllDrawn();
}

}  // namespace Stg
