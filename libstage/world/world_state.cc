// SPDX-License-Identifier: GPL-2.0-or-later
//
// What decides the future of a world.

#include <algorithm>

#include "models/block.hh"
#include "models/state_exchange.hh"
#include "models/wifi.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

uint64_t World::StateHash() const {
  StateExchange exchange(engine_->models);
  const_cast<World*>(this)->ExchangeState(exchange);  // hashing changes nothing
  return exchange.hash();
}

void World::ExchangeState(StateExchange& exchange) {
  engine_->TraceBatch();
  exchange(sim_time, updates, sim_interval, random_);
  Ancestor::ExchangeState(exchange);
  exchange.Expect(engine_->models.size(), "the number of models");
  for (Model* model : engine_->models) model->ExchangeState(exchange);
  ExchangeSchedule(exchange);
  ExchangeLists(exchange);
  ExchangeGrid(exchange);
}

/// In the order in which it will happen.
void World::ExchangeSchedule(StateExchange& exchange) {
  engine_->scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (!event.callback && !(event.model && event.model->ExpectsUpdate(event.chain))) return;
    Model* model = event.model;
    bool is_update = event.callback == nullptr;
    exchange(time, model, is_update);
  });
}

/// Whose turn it is in a step, in which order.
void World::ExchangeLists(StateExchange& exchange) {
  exchange(engine_->moving, engine_->energy);
  exchange.Expect(engine_->radios.size(), "the number of radios");
  for (Model* radio : engine_->radios) exchange(radio);
  engine_->names.ForEach([&](std::string name, uint32_t id) {
    Model* bearer = engine_->FindModel(id);
    if (bearer) exchange(name, bearer);
  });
}

namespace {

/// It shares a cell with others. The drawing for the exact ray model doesn't count: it is there as
/// soon as anybody wants it.
bool SharesCells(const grid::Grid& cells, grid::BodyId body,
                 const std::vector<grid::TilePart>& parts) {
  const auto is_other = [&](grid::BodyId id) { return id != body && !cells.body(id).exact(); };
  return std::ranges::any_of(parts, [&](const grid::TilePart& part) {
    bool shared = false;
    grid::ForEachBit(cells.Crowded(part), [&](uint32_t bit) {
      shared = shared || cells.AnyIn(grid::CellOf(part.slot, bit), is_other);
    });
    return shared;
  });
}

}  // namespace

/// Where several bodies share a cell, the one that was drawn there first is asked first whether it
/// stops a ray; and cameras look as far as the grid extends.
void World::ExchangeGrid(StateExchange& exchange) {
  const grid::Grid& grid = engine_->scene.grid;
  std::vector<uint64_t> stamps;
  for (const Model* model : engine_->models)
    model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::TilePart>& parts) {
      if (grid.body(id).exact()) return;
      stamps.push_back(SharesCells(grid, id, parts) ? grid.Stamp(id) : 0);
    });
  std::vector<uint64_t> order = stamps;
  std::ranges::sort(order);
  for (const uint64_t stamp : stamps) {
    if (stamp == 0) continue;
    uint64_t rank = static_cast<uint64_t>(std::ranges::lower_bound(order, stamp) - order.begin());
    exchange(rank);
  }
  grid::CellBox extent_of_grid = grid.extent();
  exchange(extent_of_grid.min_x, extent_of_grid.min_y, extent_of_grid.max_x, extent_of_grid.max_y);
}

}  // namespace Stg
