// SPDX-License-Identifier: GPL-2.0-or-later
//
// Populations in rows: the seed decides where their members start.

#include <algorithm>
#include <functional>
#include <memory>
#include <string>

#include "geometry/load_error.hh"
#include "messages/assert.hh"
#include "models/body.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "world/engine.hh"
#include "world/initial_state.hh"
#include "world/populate.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace grid = internal::grid;

namespace {

/// True if the file gives some values of localization_origin, but not all.
bool HasPartOfOrigin(const Model& model, Worldfile* file, int entity) {
  return rows::IsRobot(model) && file->PropertyExists(entity, "localization_origin") &&
         file->TupleLength(entity, "localization_origin") != 4;
}

}  // namespace

/// Says why rows cannot hold the populations of a world; empty if they can.
std::string RowBridge::WhyNotPopulations(const World& world) {
  const PopulationPlan* const plan = world.engine_->populations.get();
  if (!plan) return "";
  for (const PopulationPlan::Group& group : plan->groups)
    for (const PopulationPlan::Member& member : group.members) {
      const Model& model = *world.FindModel(member.model);
      if (!rows::IsOfMover(model))
        return "the seed places " + rows::Named(model) + ", which stands";
      if (HasPartOfOrigin(model, world.wf.get(), model.wf_entity))
        return rows::Named(model) + " has a part of a localization_origin";
    }
  return "";
}

/// Captures the state after loading. RestartFrom() does not place populations, but Write() does.
std::shared_ptr<const InitialState> RowBridge::CaptureStart(World* prototype) {
  if (!prototype->engine_->populations) return prototype->CaptureInitialState();
  auto start = std::make_shared<InitialState>();
  if (!prototype->Take(&start->state)) return nullptr;
  start->indices = IndicesOf(prototype->engine_->models);
  return start;
}

void RowBridge::AddPopulations(World* prototype, rows::Scene* scene) {
  WorldEngine& engine = *prototype->engine_;
  scene->populations = engine.populations;
  if (!scene->populations) return;
  grid::Grid& cells = engine.scene.grid;
  const grid::CellBox extent = cells.extent();
  cells.SetExtent(grid::CellBox());
  for (const Model* model : engine.models) {
    if (scene->populations->Has(model->Root()->GetId())) continue;
    model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& sets) {
      if (!cells.body(id).exact()) cells.WidenExtent(sets);
    });
  }
  scene->extent_of_others = cells.extent();
  cells.SetExtent(extent);
}

void RowBridge::PlacePopulations(const rows::Scene& scene, uint64_t seed,
                                 const std::function<void(uint32_t mover, const Pose&)>& put) {
  size_t placed = 0;
  const PopulationPlan::Group* const full = scene.populations->Place(
      seed,
      [&](uint32_t model, const point_t& place, double heading) {
        const std::optional<uint32_t> mover = scene.FindMover(model);
        STAGE_ASSERT(mover);
        put(*mover, Pose(place.x, place.y, scene.movers[*mover].z, normalize(heading)));
      },
      &placed);
  if (full) throw LoadError("population " + full->name + ": " + NoRoomFor(*full, placed));
}

/// Brings the members to the state after loading.
void RowBridge::WritePopulations(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  PlacePopulations(scene, LoadingSeedOf(from, row), [&](uint32_t k, const Pose& pose) {
    Model& model = *world->FindModel(scene.movers[k].model->GetId());
    model.pose = pose;
    if (!scene.movers[k].robot) return;
    auto& robot = static_cast<ModelPosition&>(model);
    robot.StartLocalization();
    robot.sensed_at_ = 0;
  });
}

}  // namespace Stg
