// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks the invariants of a world: see World::Validate().

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_set>
#include <vector>

#include "models/body.hh"
#include "models/field.hh"
#include "models/groundsensor.hh"
#include "models/light.hh"
#include "models/placement.hh"
#include "models/position.hh"
#include "models/radio.hh"
#include "models/wifi.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

/// Each Check function returns the first fault of one kind, or "". Pointers to models are compared
/// with the list of models before they are followed, because a fault may leave dangling ones.
class World::Validator {
 public:
  explicit Validator(const World& world)
      : world_(world),
        engine_(*world.engine_),
        grid_(engine_.scene.grid),
        models_(engine_.models.begin(), engine_.models.end()) {}

  std::string Check() {
    if (engine_.scene.tearing_down) return "";  // the world is being deleted
    for (const auto check :
         {&Validator::CheckModels, &Validator::CheckTree, &Validator::CheckLists,
          &Validator::CheckHidden, &Validator::CheckSchedule, &Validator::CheckBatch}) {
      std::string fault = (this->*check)();
      if (!fault.empty()) return fault;
    }
    if (std::string fault = grid_.Validate(); !fault.empty()) return "the grid: " + fault;
    if (std::string fault = CheckBodies(); !fault.empty()) return fault;
    return engine_.loading ? "" : CheckPlaces();  // bodies are rasterized after loading
  }

 private:
  static std::string About(const Model* model, const std::string& fault) {
    std::string text = fault;
    text.append(", model ").append(std::to_string(model->id)).append(" (");
    return text.append(model->token).append(")");
  }

  std::string CheckModels() {
    if (const std::string fault = CheckList("models", engine_.models); !fault.empty()) return fault;
    for (const Model* model : engine_.models) {
      if (model->id >= engine_.next_model_id) return About(model, "an id that is yet to be given");
      if (model->world != &world_ || model->scene_ != &engine_.scene)
        return About(model, "a model of another world");
      if (model->drives_ != (dynamic_cast<const ModelPosition*>(model) != nullptr))
        return About(model, "a wrong mark whether it drives");
      if (!std::isfinite(model->pose.x + model->pose.y + model->pose.z + model->pose.a))
        return About(model, "a pose that is not finite");
      if (model->update_generation_ >> 32 != model->id)
        return About(model, "an update chain of another model");
    }
    if (world_.ground && !models_.contains(world_.ground)) return "a ground that does not exist";
    return "";
  }

  std::string CheckTree() {
    size_t children = 0;
    std::string fault = CheckChildren(world_.children, nullptr, &children);
    for (const Model* model : engine_.models)
      if (fault.empty()) fault = CheckChildren(model->children, model, &children);
    if (fault.empty() && children != models_.size()) return "models that are no children";
    for (const Model* model : engine_.models) {
      if (!fault.empty()) break;
      if (model->root != (model->parent ? model->parent->root : model))
        fault = About(model, "a wrong root");
    }
    return fault;
  }

  std::string CheckChildren(const std::vector<Model*>& children, const Model* parent,
                            size_t* count) const {
    std::unordered_set<const Model*> seen;
    for (const Model* child : children) {
      if (!models_.contains(child)) return "a child that does not exist";
      if (child->parent != parent) return About(child, "another parent than the one it is under");
      if (!seen.insert(child).second) return About(child, "a child that is listed twice");
    }
    *count += children.size();
    return "";
  }

  /// Checks that the models exist and are in the order of creation.
  template <typename Type>
  std::string CheckList(const char* name, const std::vector<Type*>& list) const {
    const Model* before = nullptr;
    for (const Type* entry : list) {
      const Model* const model = entry;
      if (!models_.contains(model))
        return std::string("a model that does not exist in the list of ").append(name);
      if (before && before->id >= model->id)
        return About(model, std::string("wrong order in the list of ").append(name));
      before = model;
    }
    return "";
  }

  std::vector<const Model*> LightModels() const {
    std::vector<const Model*> lights;
    for (const LightSource* light : engine_.lights->sources()) lights.push_back(&light->model());
    return lights;
  }

  std::string CheckLists() {
    std::string fault = CheckList("moving models", engine_.moving);
    if (fault.empty()) fault = CheckList("models with energy", engine_.energy);
    if (fault.empty()) fault = CheckList("radios", engine_.radios);
    if (fault.empty()) fault = CheckList("fields", engine_.fields);
    if (fault.empty()) fault = CheckList("ground sensors", engine_.ground_sensors);
    if (fault.empty()) fault = CheckList("radios with messages", engine_.traffic->radios());
    if (fault.empty()) fault = CheckList("lights", LightModels());
    if (!fault.empty()) return fault;
    for (const auto* list : {&engine_.sensed, &engine_.update_callbacks_due})
      for (const Model* model : *list)
        if (model && !models_.contains(model)) return "a step's work for a model that is deleted";
    engine_.names.ForEach([&](const std::string& name, uint32_t id) {
      if (id >= engine_.next_model_id) fault = "the name " + name + " of a model that never was";
    });
    return fault;
  }

  std::string CheckHidden() {
    std::unordered_set<const Model*> hidden;
    for (const Model* model : engine_.hidden_from_rangers)
      if (!models_.contains(model) || !hidden.insert(model).second)
        return "a model that is deleted or listed twice as hidden from rangers";
    for (const Model* model : engine_.models)
      if (model->hidden_from_rangers_ != hidden.contains(model))
        return About(model, "a wrong mark whether it is hidden from rangers");
    return "";
  }

  std::string CheckSchedule() {
    std::string fault;
    std::unordered_set<const Model*> expected;
    engine_.scheduler.ForEach([&](usec_t, const Scheduler::Event& event) {
      const Model* const model = event.model;
      if (!fault.empty() || !model) return;
      if (!models_.contains(model))
        fault = "an event of a model that is deleted";
      else if (event.generation >> 32 != model->id)
        fault = About(model, "an event with another model's chain");
      else if (!event.callback && model->ExpectsUpdate(event.generation) &&
               !expected.insert(model).second)
        fault = About(model, "two updates that are due");
    });
    return fault;
  }

  std::string CheckBatch() {
    const sensing::RayBatch& batch = engine_.scene.batch;
    uint64_t rays = 0;
    for (const sensing::Fan& fan : batch.fans()) {
      if (fan.finder && !models_.contains(fan.finder)) return "rays of a model that is deleted";
      if (fan.layer >= grid_.layer_count()) return "rays in a layer that does not exist";
      rays += fan.record.samples;
    }
    return rays == batch.ray_count() ? "" : "a wrong number of rays in the batch";
  }

  /// Compares the bodies of the models with those in the grid, in both directions.
  std::string CheckBodies() {
    std::string fault;
    int64_t cells = grid_.pretended_cells();
    for (const Model* model : engine_.models) {
      bool rasterized = false;
      for (const auto& block : model->blockgroup->blocks()) {
        rasterized = rasterized || block->rasterized();
        if (!block->rasterized() && !block->cells().empty())
          return About(model, "cells of a block that is not rasterized");
      }
      if (!model->blockgroup->empty() && model->blockgroup->IsUnrasterized() == rasterized)
        return About(model, "a wrong mark whether it is rasterized");
      model->blockgroup->ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& parts) {
        if (fault.empty()) fault = CheckBody(model, id, parts);
        if (fault.empty() && !grid_.body(id).exact())
          cells += static_cast<int64_t>(grid::CountCells(parts));
      });
      if (!fault.empty()) return About(model, fault);
    }
    for (grid::BodyId id = 0; id < grid_.body_count(); id++)
      if (grid_.body(id).model && !bodies_.contains(id)) return "a body in the grid of no model";
    return cells == grid_.rasterized_cells() ? "" : "cells in the grid of no model";
  }

  std::string CheckBody(const Model* model, grid::BodyId id,
                        const std::vector<grid::CellSet>& parts) {
    if (id >= grid_.body_count()) return "a body that is not in the grid";
    if (!bodies_.insert(id).second) return "a body that is another block's";
    const grid::Body& body = grid_.body(id);
    if (body.model != model || body.number != model->id) return "a body that is another model's";
    if (body.tree != model->root) return "a body that is another tree's";
    if (!grid::AreSorted(parts)) return "a body whose tiles are not in order";
    for (const grid::CellSet& part : parts) {
      if (part.slot == 0 || part.slot != grid_.FindTileSlot(part)) return "a tile in a wrong slot";
      if (!(body.exact() ? HasOutline(id, part) : HasCells(id, part)))
        return "cells that are not in the grid";
    }
    return "";
  }

  bool HasCells(grid::BodyId id, const grid::CellSet& part) const {
    bool has = true;
    grid::ForEachCell(part, [&](grid::CellRef cell) {
      has = has && grid_.AnyIn(cell, [&](grid::BodyId there) { return there == id; });
    });
    return has;
  }
  bool HasOutline(grid::BodyId id, const grid::CellSet& part) const {
    bool has = false;
    grid_.ForEachOutline(grid_.OutlinesIn(part.slot), [&](const grid::OutlineFragment& there) {
      has = has || (there.id == id && there.cells == part.cells && there.edges == part.edges);
    });
    return has;
  }

  /// Checks that each rasterized model lies in the grid where its pose says.
  std::string CheckPlaces() const {
    Placement placement;
    for (Model* model : engine_.models) {
      if (model->blockgroup->empty() || model->blockgroup->IsUnrasterized()) continue;
      if (Placement::IsNearlyFull(*model)) return "";  // bodies may be missing
      placement.Propose(*model, false);
      if (!placement.IsInPlace()) return About(model, "a body that is rasterized elsewhere");
    }
    return "";
  }

  const World& world_;
  WorldEngine& engine_;
  const grid::Grid& grid_;
  const std::unordered_set<const Model*> models_;
  std::unordered_set<grid::BodyId> bodies_;  // the bodies that models have
};

std::string World::Validate() const { return Validator(*this).Check(); }

}  // namespace Stg
