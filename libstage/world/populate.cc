// SPDX-License-Identifier: GPL-2.0-or-later
//
// Places populations at random, evenly spread on free floor, clear of other bodies and of each
// other. The same seed gives the same places on every machine; growing a population keeps the
// places of its first members.

#include "world/populate.hh"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "geometry/free_floor.hh"
#include "geometry/load_error.hh"
#include "models/body.hh"
#include "models/position.hh"
#include "random/fnv1a.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// After this many failed tries in a row, the floor counts as full: most likely one more would fit
/// on less than 0.02 % of it.
constexpr int kMaxMisses = 20'000;
constexpr double kMinGap = 0.05;  // metres
/// Bodies closer than a cell's diagonal might share a cell, which is a collision.
constexpr double kCellsApart = 1.5;

struct Plan {
  const Population* population;
  std::vector<Model*> members;
  std::vector<double> radii;
  bounds3d_t area;
  double gap = 0;
  uint64_t seed = 0;
};

std::vector<std::vector<point_t>> OutlinesOf(const Model& model) {
  std::vector<std::vector<point_t>> outlines;
  for (const auto& block : model.body().blocks()) {
    outlines.emplace_back();
    for (const point_t& corner : block->points())
      outlines.back().push_back(model.LocalToGlobal(corner));
  }
  return outlines;
}

template <typename F>
void ForEachOf(Model* model, F f) {
  f(*model);
  for (Model* child : model->GetChildren()) ForEachOf(child, f);
}

/// Radius of the circle around the model's origin that contains it and all that it carries, metres.
double RadiusOf(Model* model) {
  const Pose at = model->GetGlobalPose();
  double radius2 = 0;
  ForEachOf(model, [&](const Model& part) {
    for (const std::vector<point_t>& outline : OutlinesOf(part))
      for (const point_t& corner : outline)
        radius2 = std::max(
            radius2, (corner.x - at.x) * (corner.x - at.x) + (corner.y - at.y) * (corner.y - at.y));
  });
  return std::sqrt(radius2);
}

[[noreturn]] void Fail(const Worldfile& file, const Plan& plan, const char* property,
                       const std::string& message) {
  if (plan.population->entity >= 0) file.Fail(plan.population->entity, property, message);
  throw LoadError("--set " + plan.population->name + ": " + message);
}

void ReadArea(Worldfile* file, const geometry::FreeFloor& floor, Plan* plan) {
  const int entity = plan->population->entity;
  if (!floor.empty()) plan->area = floor.Bounds();
  bounds3d_t& area = plan->area;
  const int read = file->ReadTuple(entity, "area", 0, 4, "llll", &area.x.min, &area.y.min,
                                   &area.x.max, &area.y.max);
  if (read == 0 && floor.empty() && !plan->members.empty())
    Fail(*file, *plan, "area",
         "found no body around the ground, expected one, or area [XMIN YMIN XMAX YMAX]");
  if (read > 0 && !(area.x.min <= area.x.max && area.y.min <= area.y.max))
    file->Fail(entity, "area", "found an area without extent, expected [XMIN YMIN XMAX YMAX]");
}

Plan MakePlan(const Population& population, Worldfile* file, const std::vector<Model*>& made,
              double cell, uint64_t seed) {
  Plan plan{&population, {}, {}, {}, std::max(kMinGap, kCellsApart * cell), seed};
  for (const int entity : population.members) {
    if (Model* const model = made[static_cast<size_t>(entity)]) plan.members.push_back(model);
  }
  for (Model* const model : plan.members) plan.radii.push_back(RadiusOf(model));
  plan.gap = file->ReadLength(population.entity, "gap", plan.gap);
  if (plan.gap < 0) file->Fail(population.entity, "gap", "found less than 0, expected a length");
  if (file->PropertyExists(population.entity, "seed"))
    plan.seed = static_cast<uint64_t>(file->ReadInt(population.entity, "seed", 0));
  return plan;
}

/// Free floor given all obstacles except members of populations. `reach`: see
/// FreeFloor::BuildIndex().
geometry::FreeFloor FloorOf(const std::vector<Model*>& models, const Worldfile& file,
                            const std::vector<Model*>& made, double reach) {
  std::set<const Model*> members;
  for (const Population& population : file.populations())
    for (const int entity : population.members) members.insert(made[static_cast<size_t>(entity)]);
  geometry::FreeFloor floor;
  for (const Model* model : models) {
    const Model* top = model;
    while (top->Parent()) top = top->Parent();
    if (members.count(top) == 0 && model->vis.obstacle_return && !model->body().empty())
      floor.AddBody(OutlinesOf(*model));
  }
  floor.BuildIndex(reach);
  return floor;
}

/// Moves a model and updates what was derived from the poses at loading.
void PutAt(Model* model, const point_t& place, double heading) {
  model->SetPose(Pose(place.x, place.y, model->GetPose().z, heading));
  ForEachOf(model, [](Model& part) {
    if (auto* const position = dynamic_cast<ModelPosition*>(&part)) position->StartLocalization();
  });
}

void Place(const Worldfile& file, const Plan& plan, const geometry::FreeFloor& floor,
           geometry::Discs* discs) {
  RandomStream random(MixSeeds(plan.seed, Fnv1a(plan.population->name)));
  for (size_t i = 0; i < plan.members.size(); i++) {
    point_t place;
    int misses = 0;
    do {
      if (++misses > kMaxMisses)
        Fail(file, plan, "count",
             "found room for " + std::to_string(i) + " of " + std::to_string(plan.members.size()) +
                 " models, expected fewer models, a larger area or a smaller gap");
      place.x = random.Uniform(plan.area.x.min, plan.area.x.max);
      place.y = random.Uniform(plan.area.y.min, plan.area.y.max);
    } while (!floor.IsClear(place, plan.radii[i] + plan.gap) ||
             !discs->AddIfClear(place, plan.radii[i]));
    PutAt(plan.members[i], place, random.Uniform(-M_PI, M_PI));
  }
}

}  // namespace

void PlacePopulations(const std::vector<Model*>& models, const std::vector<Model*>& made,
                      Worldfile* file, double cell, uint64_t seed,
                      std::shared_ptr<const geometry::FreeFloor>* floor) {
  if (file->populations().empty()) return;
  std::vector<Plan> plans;
  double largest = 0, gap = 0;
  for (const Population& population : file->populations()) {
    plans.push_back(MakePlan(population, file, made, cell, seed));
    gap = std::max(gap, plans.back().gap);
    for (const double radius : plans.back().radii) largest = std::max(largest, radius);
  }
  if (!*floor)
    *floor = std::make_shared<const geometry::FreeFloor>(
        FloorOf(models, *file, made, std::max(largest + gap, cell)));
  geometry::Discs discs(largest, gap);
  for (Plan& plan : plans) {
    ReadArea(file, **floor, &plan);
    Place(*file, plan, **floor, &discs);
  }
}

}  // namespace Stg
