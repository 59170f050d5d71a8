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
#include <utility>
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

using Group = PopulationPlan::Group;

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

[[noreturn]] void Fail(const Worldfile& file, const Group& group, const char* property,
                       const std::string& message) {
  if (group.entity >= 0) file.Fail(group.entity, property, message);
  throw LoadError("--set " + group.name + ": " + message);
}

void ReadArea(Worldfile* file, const geometry::FreeFloor& floor, Group* group) {
  const int entity = group->entity;
  if (!floor.empty()) group->area = floor.Bounds();
  bounds3d_t& area = group->area;
  const int read = file->ReadTuple(entity, "area", 0, 4, "llll", &area.x.min, &area.y.min,
                                   &area.x.max, &area.y.max);
  if (read == 0 && floor.empty() && !group->members.empty())
    Fail(*file, *group, "area",
         "found no body around the ground, expected one, or area [XMIN YMIN XMAX YMAX]");
  if (read > 0 && !(area.x.min <= area.x.max && area.y.min <= area.y.max))
    file->Fail(entity, "area", "found an area without extent, expected [XMIN YMIN XMAX YMAX]");
}

Group GroupOf(const Population& population, Worldfile* file, const std::vector<Model*>& made,
              double cell) {
  Group group{population.name, population.entity, {}, {}, std::max(kMinGap, kCellsApart * cell),
              std::nullopt};
  for (const int entity : population.members) {
    if (Model* const model = made[static_cast<size_t>(entity)])
      group.members.push_back({model->GetId(), RadiusOf(model)});
  }
  group.gap = file->ReadLength(population.entity, "gap", group.gap);
  if (group.gap < 0) file->Fail(population.entity, "gap", "found less than 0, expected a length");
  if (file->PropertyExists(population.entity, "seed"))
    group.seed = static_cast<uint64_t>(file->ReadInt(population.entity, "seed", 0));
  return group;
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

/// Places the members of a group. Returns how many fit.
size_t PlaceGroup(const Group& group, uint64_t seed, const geometry::FreeFloor& floor,
                  geometry::Discs* discs, const PopulationPlan::Put& put) {
  RandomStream random(MixSeeds(group.seed.value_or(seed), Fnv1a(group.name)));
  for (size_t i = 0; i < group.members.size(); i++) {
    const auto [model, radius] = group.members[i];
    point_t place;
    int misses = 0;
    do {
      if (++misses > kMaxMisses) return i;
      place.x = random.Uniform(group.area.x.min, group.area.x.max);
      place.y = random.Uniform(group.area.y.min, group.area.y.max);
    } while (!floor.IsClear(place, radius + group.gap) || !discs->AddIfClear(place, radius));
    put(model, place, random.Uniform(-M_PI, M_PI));
  }
  return group.members.size();
}

}  // namespace

std::string NoRoomFor(const Group& group, size_t placed) {
  return "found room for " + std::to_string(placed) + " of " +
         std::to_string(group.members.size()) +
         " models, expected fewer models, a larger area or a smaller gap";
}

const Group* PopulationPlan::Place(uint64_t seed, const Put& put, size_t* placed) const {
  geometry::Discs discs(largest, gap);
  for (const Group& group : groups) {
    *placed = PlaceGroup(group, seed, *floor, &discs, put);
    if (*placed < group.members.size()) return &group;
  }
  return nullptr;
}

std::shared_ptr<const PopulationPlan> PlacePopulations(
    const std::vector<Model*>& models, const std::vector<Model*>& made, Worldfile* file,
    double cell, uint64_t seed, std::shared_ptr<const geometry::FreeFloor> floor) {
  if (file->populations().empty()) return nullptr;
  auto plan = std::make_shared<PopulationPlan>();
  for (const Population& population : file->populations()) {
    plan->groups.push_back(GroupOf(population, file, made, cell));
    plan->gap = std::max(plan->gap, plan->groups.back().gap);
    for (const PopulationPlan::Member& member : plan->groups.back().members)
      plan->largest = std::max(plan->largest, member.radius);
  }
  if (!floor)
    floor = std::make_shared<const geometry::FreeFloor>(
        FloorOf(models, *file, made, std::max(plan->largest + plan->gap, cell)));
  plan->floor = std::move(floor);
  for (Group& group : plan->groups) ReadArea(file, *plan->floor, &group);
  const auto put = [&](uint32_t id, const point_t& place, double heading) {
    PutAt(*std::ranges::lower_bound(models, id, {}, &Model::GetId), place, heading);
  };
  size_t placed = 0;
  if (const Group* const full = plan->Place(seed, put, &placed))
    Fail(*file, *full, "count", NoRoomFor(*full, placed));
  return plan;
}

}  // namespace Stg
