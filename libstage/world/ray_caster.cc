// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/ray_caster.hh"

#include <algorithm>
#include <cmath>

#include "messages/report.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {

bool StopsCast(Model* candidate, const Model*, const void* seen) {
  return static_cast<const char*>(seen)[candidate->GetId()];
}

/// The cells of the tree of a model that rays pass, so that they are not stopped there one by one:
/// those that start in a robot would take three times as long. `from` may be null.
sensing::SelfMask HideTree(const Model* from, bool exact, sensing::Scene* scene) {
  if (!from) return {};
  const Model* const root = from->Root();
  internal::grid::Rasterizations own;
  root->CollectRasterizations(&own, exact);
  return scene->batch.MakeSelfMask(scene->grid, own, root, exact);
}

}  // namespace

RayCaster::RayCaster(World* world, const CastOptions& options)
    : world_(*world), options_(options), ranges_(nullptr) {}

RayCaster::~RayCaster() = default;

/// Evaluates visibility once per model instead of once per ray that reaches it.
void RayCaster::FindSeen() {
  const std::vector<Model*>& models = world_.engine().models;
  seen_.assign(models.empty() ? 0 : models.back()->GetId() + 1, false);
  for (const Model* model : models)
    seen_[model->GetId()] = !(model->vis.ranger_return < 0) &&
                            (options_.robots || !model->Root()->Drives()) &&
                            !(options_.from && model->IsRelated(options_.from));
}

bool RayCaster::Cast(const Pose* poses, size_t count, const std::vector<double>& bearings,
                     meters_t range, double* ranges) {
  WorldEngine& engine = world_.engine();
  if (!engine.IsIdle() || engine.loading) {
    messages::Report(LogLevel::kError, "stage: rays can't be cast by a callback");
    return false;
  }
  if (count == 0 || bearings.empty()) return true;
  if (world_.IsExact(options_.ray_model)) world_.RasterizeForExactRays();
  engine.TraceBatch();                 // traces what was requested before
  constexpr size_t kManyRays = 10000;  // from here on, waking threads pays
  if (count * bearings.size() >= kManyRays) engine.UseAllThreads();
  engine.scene.tables.Trim();
  FindSeen();
  ranges_ = ranges;
  PlaceFans(poses, count, range, static_cast<uint32_t>(bearings.size()),
            engine.scene.tables.Find(bearings));
  engine.TraceBatch();
  return true;
}

/// Calls f(i) for all i below `count` on all threads. Each thread uses a copy of f.
template <typename F>
void RayCaster::ForEachSlice(size_t count, F f) {
  constexpr size_t kGrain = 256;
  world_.engine().workers()->Run(count, kGrain, [&](size_t begin, size_t end, unsigned) {
    F own = f;
    for (size_t i = begin; i < end; i++) own(i);
  });
}

/// Puts the fans into the world's batch.
void RayCaster::PlaceFans(const Pose* poses, size_t count, meters_t range, uint32_t samples,
                          uint32_t first_direction) {
  WorldEngine& engine = world_.engine();
  sensing::Scene& scene = engine.scene;
  sensing::Fan fan;
  fan.predicate = StopsCast;
  fan.arg = seen_.data();
  fan.sink = this;
  fan.record.first_direction = first_direction;
  fan.exact = world_.IsExact(options_.ray_model);
  fan.z_test = !std::isnan(options_.z);
  const double z = fan.z_test ? options_.z : 0;
  fan.layer = options_.robots ? scene.grid.RangerLayer(z, fan.z_test, fan.exact)
                              : scene.grid.MapLayer(z, fan.z_test, fan.exact);
  const sensing::SelfMask hidden = HideTree(options_.from, fan.exact, &scene);
  OrderByPlace(poses, count);
  scene.batch.Allocate({.rays = count * samples, .fans = static_cast<uint32_t>(count)});
  ForEachSlice(count, [&, fan](size_t i) mutable {
    fan.tag = order_[i].pose;
    const Pose& pose = poses[fan.tag];
    sensing::PlaceFan(&fan, Pose(pose.x, pose.y, z, pose.a), range, scene.cells_per_metre);
    scene.batch.Put(static_cast<uint32_t>(i), fan, i * samples, samples, hidden);
  });
}

/// Sorts the poses so that neighbours are adjacent and their rays are walked together.
void RayCaster::OrderByPlace(const Pose* poses, size_t count) {
  const double cells_per_metre = world_.Resolution();
  order_.resize(count);
  ForEachSlice(count, [&](size_t i) {
    int32_t x = 0, y = 0;
    uint32_t fraction;
    sensing::SplitCell(poses[i].x * cells_per_metre, &x, &fraction);
    sensing::SplitCell(poses[i].y * cells_per_metre, &y, &fraction);
    order_[i] = {sensing::PlaceKeyOf(x, y), static_cast<uint32_t>(i)};
  });
  SortOrder();
}

/// Parallel merge sort: sorts chunks on all threads, then merges pairs until one is left.
void RayCaster::SortOrder() {
  constexpr size_t kStretch = 4096;
  const size_t count = order_.size();
  const auto is_before = [](const Place& a, const Place& b) {
    return a.key != b.key ? a.key < b.key : a.pose < b.pose;
  };
  const auto at = [this, count](size_t i) {
    return order_.begin() + static_cast<std::ptrdiff_t>(std::min(i, count));
  };
  const auto for_each = [this, count](size_t length, auto f) {
    world_.engine().workers()->Run((count + length - 1) / length, 1,
                                   [&](size_t begin, size_t end, unsigned) {
                                     for (size_t i = begin; i < end; i++) f(i * length);
                                   });
  };
  for_each(kStretch, [&](size_t begin) { std::sort(at(begin), at(begin + kStretch), is_before); });
  for (size_t length = kStretch; length < count; length *= 2)
    for_each(2 * length, [&](size_t begin) {
      std::inplace_merge(at(begin), at(begin + length), at(begin + 2 * length), is_before);
    });
}

void RayCaster::ReceiveHits(uint32_t tag, const sensing::RayHits& hits) {
  std::copy(hits.ranges, hits.ranges + hits.count, ranges_ + size_t{tag} * hits.count);
}

}  // namespace Stg
