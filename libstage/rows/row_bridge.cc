// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/row_bridge.hh"

#include <algorithm>
#include <limits>
#include <typeinfo>
#include <utility>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/model_seed.hh"
#include "models/power_pack.hh"
#include "world/engine.hh"
#include "world/initial_state.hh"
#include "world/rasterized_body.hh"

namespace Stg {

// ---- seeds --------------------------------------------------------------------------------------

/// The place of a model of the prototype in the order of creation.
size_t RowBridge::PlaceOf(const rows::Scene& scene, const Model& model) {
  const std::vector<Model*>& models = scene.prototype->engine().models;
  const auto place = std::ranges::lower_bound(models, model.GetId(), {}, &Model::GetId);
  return static_cast<size_t>(place - models.begin());
}

uint64_t RowBridge::SeedOf(const rows::Scene& scene, const Model& model, uint64_t seed) {
  const unsigned index = scene.initial_state->indices[PlaceOf(scene, model)];
  const uint64_t above = model.Parent() ? SeedOf(scene, *model.Parent(), seed) : seed;
  return SeedOfModel(above, model.GetModelType(), index);
}

uint64_t RowBridge::SeedOfMover(const rows::Scene& scene, size_t mover, uint64_t seed) {
  return SeedOf(scene, *scene.movers[mover].model, seed);
}

uint64_t RowBridge::SeedOfNoise(const rows::Scene& scene, size_t sensor, uint64_t seed) {
  const rows::Sensor& of = scene.sensors[sensor];
  const bool shares_name = of.ranger->shares_name_;
  return Stg::SeedOfNoise(seed, of.name_hash, shares_name,
                          shares_name ? SeedOf(scene, *of.ranger, seed) : 0);
}

// ---- from a world to a row ----------------------------------------------------------------------

void RowBridge::ReadStart(rows::Rows* start) {
  World& world = *start->scene_->prototype;
  start->columns.seed[0] = world.seed();
  ReadVaried(world, start, 0);
  ReadModels(world, start, 0);
  ReadControls(world, start, 0);
  ReadGrid(world, start, 0);
}

/// True if something that is a wall of all worlds of the scene is at another place in this one.
bool RowBridge::HasMovedWalls(const World& world, const rows::Scene& scene) {
  return std::ranges::any_of(scene.movers, [&](const rows::Mover& mover) {
    return mover.is_wall && !(world.FindModel(mover.model->GetId())->pose == mover.model->pose);
  });
}

bool RowBridge::Read(World* world, rows::Rows* to, size_t row, World* spare, Readings readings) {
  if (!WhyNotClosed(*world).empty() || !HasModelsOf(*world, to->scene()) ||
      HasMovedWalls(*world, to->scene()))
    return false;
  to->columns.seed[row] = world->seed();
  ReadVaried(*world, to, row);
  ReadModels(*world, to, row);
  const uint32_t lacking = readings == kMayLack ? LackingRates(*world, *to, row) : 0;
  if (lacking) ReadUpdates(*world, lacking, to, row);
  ReadGrid(*world, to, row);
  ReadOrder(*world, to, row);
  ReadReseeding(*world, to, row);
  if (!ReadControls(*world, to, row) || !ReadSensors(*world, lacking, to, row) ||
      !Write(*to, row, spare))
    return false;
  const Snapshot::Keep keep = lacking ? Snapshot::kLean : Snapshot::kFull;
  Snapshot of_world, of_row;
  return world->Take(&of_world, keep) && spare->Take(&of_row, keep) &&
         of_world.hash() == of_row.hash();
}

/// The groups of rates, as bits, whose readings the world lacks. If there are some, it is in the
/// state of a lean snapshot.
uint32_t RowBridge::LackingRates(const World& world, const rows::Rows& to, size_t row) {
  const rows::Scene& scene = to.scene();
  uint32_t lacking = 0;
  for (uint32_t rate = 0; !scene.IsIdle() && rate < scene.rates.size(); rate++)
    if (to.columns.next_update[to.RateIndex(row, rate)] <= world.sim_time + world.sim_interval &&
        world.FindModel(scene.rates[rate].models[0]->GetId())->updated_at_ == 0)
      lacking |= 1u << rate;
  return lacking;
}

/// Reads the times of the last updates and the poses at these times from a world that lacks
/// readings.
void RowBridge::ReadUpdates(const World& world, uint32_t lacking, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  for (uint32_t rate = 0; rate < scene.rates.size(); rate++) {
    const bool has_robots = std::ranges::any_of(
        scene.movers, [&](const rows::Mover& mover) { return mover.runs && mover.rate == rate; });
    const size_t i = to->RateIndex(row, rate);
    if (((lacking >> rate) & 1) && !has_robots)
      c.last_update[i] = c.next_update[i] - scene.rates[rate].models[0]->GetUpdateInterval();
  }
  for (size_t k = 0; k < scene.movers.size(); k++) {
    const rows::Mover& mover = scene.movers[k];
    if (!mover.runs || mover.has_odometry || !((lacking >> mover.rate) & 1)) continue;
    const auto& robot = static_cast<ModelPosition&>(*world.FindModel(mover.model->GetId()));
    c.sensed[row * scene.movers.size() + k] = rows::PlanarOf(robot.est_pose);
  }
}

/// True if the world has the models of the prototype.
bool RowBridge::HasModelsOf(const World& world, const rows::Scene& scene) {
  const auto same = [](const Model* a, const Model* b) {
    return a->GetId() == b->GetId() && typeid(*a) == typeid(*b);
  };
  return std::ranges::equal(world.engine().models, scene.prototype->engine().models, same);
}

void RowBridge::ForEachUpdate(const World& world, const std::function<void(usec_t, Model*)>& f) {
  world.engine_->scheduler.ForEach([&](usec_t time, const Scheduler::Event& event) {
    if (event.model && event.model->ExpectsUpdate(event.generation)) f(time, event.model);
  });
}

std::vector<uint32_t> RowBridge::RunningModels(const World& world) {
  std::vector<const Model*> models;
  ForEachUpdate(world, [&](usec_t, const Model* model) { models.push_back(model); });
  std::ranges::stable_sort(models, {}, &Model::GetUpdateInterval);
  std::vector<uint32_t> ids;
  for (const Model* model : models) ids.push_back(model->GetId());
  return ids;
}

/// Reads the times of the next updates, and the order of those that are due at the same time.
void RowBridge::ReadSchedule(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  const auto first = c.next_update.begin() + static_cast<std::ptrdiff_t>(to->RateIndex(row, 0));
  std::fill_n(first, scene.rates.size(), std::numeric_limits<usec_t>::max());
  uint64_t number = 0;
  ForEachUpdate(world, [&](usec_t time, const Model* model) {
    const size_t i = to->RateIndex(row, scene.RateOf(*model));
    const bool is_first = c.next_update[i] != time;
    c.next_update[i] = time;
    if (!c.scheduled.empty() && is_first) c.scheduled[i] = number++;
  });
}

void RowBridge::ReadModels(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  c.time[row] = world.sim_time;
  c.steps[row] = world.updates;
  for (uint32_t rate = 0; rate < scene.rates.size(); rate++)
    c.last_update[to->RateIndex(row, rate)] =
        scene.IsIdle() ? 0 : world.FindModel(scene.rates[rate].models[0]->GetId())->updated_at_;
  for (size_t k = 0; k < scene.movers.size(); k++) {
    const Model& model = *world.FindModel(scene.movers[k].model->GetId());
    const size_t i = row * scene.movers.size() + k;
    c.pose[i] = c.sensed[i] = rows::PlanarOf(model.pose);
    c.turn[i] = SinCos(model.pose.a);
    c.stalled[i] = model.stall;
    if (!c.before.empty()) {
      const Pose* const before = model.pose_before_push_.get();
      c.before[i] = before ? rows::PlanarOf(*before) : c.pose[i];
      // Things are sensed before they are pushed.
      if (before && scene.movers[k].is_pushed) c.sensed[i] = c.before[i];
    }
    if (scene.movers[k].robot) ReadRobot(static_cast<const ModelPosition&>(model), to, row, i);
  }
  for (size_t k = 0; k < scene.packs.size(); k++) {
    const PowerPack& pack = *world.FindModel(scene.packs[k].model->GetId())->power_pack;
    c.stored[row * scene.packs.size() + k] = pack.GetStored();
    c.dissipated[row * scene.packs.size() + k] = pack.GetDissipated();
    c.energy[row] = world.engine().energy_totals;
  }
  ReadFinders(world, to, row);
  ReadSchedule(world, to, row);
}

void RowBridge::ReadRobot(const ModelPosition& model, rows::Rows* to, size_t row, size_t i) {
  rows::Columns& c = to->columns;
  c.velocity[i] = rows::PlanarOf(model.velocity);
  c.command[i] = rows::PlanarOf(model.goal);
  c.mode[i] = static_cast<uint8_t>(model.control_mode);
  c.watts[i] = model.watts;
  if (!c.hindered.empty()) c.hindered[i] = model.is_hindered_;
  if (!c.made.empty()) c.made[i] = rows::PlanarOf(model.made_);
  if (!c.steering.empty()) c.steering[i] = model.steering_;
  if (!model.HasSubscribers()) return;
  const uint32_t rate = to->scene().movers[i % to->scene().movers.size()].rate;
  c.last_update[to->RateIndex(row, rate)] = model.last_update_;
  c.sensed[i] = rows::PlanarOf(model.sensed_pose_);
  if (c.estimate.empty()) return;
  c.estimate[i] = rows::PlanarOf(model.est_pose);
  c.driven[i] = rows::PlanarOf(model.driven_);
  c.error[i] = rows::PlanarOf(model.integration_error);
  if (!model.noisy_odometry_) return;
  c.noisy_odometry[i] = *model.noisy_odometry_;
  c.random[i] = model.random_.Copy();
}

void RowBridge::ReadGrid(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  c.extent[row] = world.engine().scene.grid.extent();
  for (size_t k = 0; k < scene.bodies.size(); k++) {
    const rows::Body& body = scene.bodies[k];
    const Block& block = *world.FindModel(body.model->GetId())->body().blocks()[body.block];
    const std::vector<point_int_t>& cells = block.corners();
    rows::CornerCells corners;
    for (size_t i = 0; i < cells.size(); i++) {
      corners.x[i] = cells[i].x;
      corners.y[i] = cells[i].y;
    }
    to->SetOutline(row, k, corners, static_cast<uint32_t>(cells.size()));
  }
}

/// Numbers the bodies that were rasterized since loading in that order.
void RowBridge::ReadOrder(const World& world, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  rows::Columns& c = to->columns;
  const internal::grid::Grid& grid = world.engine().scene.grid;
  std::vector<std::pair<uint64_t, uint64_t*>> recent;
  for (size_t k = 0; k < scene.bodies.size(); k++) {
    const rows::Body& body = scene.bodies[k];
    const Model& model = *world.FindModel(body.model->GetId());
    uint64_t* const stamp = &c.stamp[row * scene.bodies.size() + k];
    *stamp = 0;
    const Block& block = *model.body().blocks()[body.block];
    if (!model.body().rasterized_since_loading() || !block.rasterized()) continue;
    const uint64_t stamp_in_grid = grid.Stamp(block.body());
    if (stamp_in_grid > world.engine().last_stamp_of_loading)
      recent.emplace_back(stamp_in_grid, stamp);
  }
  std::ranges::sort(recent);
  for (size_t i = 0; i < recent.size(); i++) *recent[i].second = i + 1;
  c.stamps[row] = recent.size();
}

bool RowBridge::ReadSensors(const World& world, uint32_t lacking, rows::Rows* to, size_t row) {
  const rows::Scene& scene = to->scene();
  for (size_t k = 0; k < scene.sensors.size(); k++) {
    const rows::Sensor& of = scene.sensors[k];
    const auto& ranger = static_cast<const ModelRanger&>(*world.FindModel(of.ranger->GetId()));
    if (of.index >= ranger.sensors_.size()) return false;
    const ModelRanger::Sensor& sensor = ranger.sensors_[of.index];
    if (to->IsNoisy(row, k))
      to->columns.noise[row * scene.sensors.size() + k] =
          sensor.seeded_ ? sensor.random_ : RandomStream(SeedOfNoise(*to, row, k));
    if (((lacking >> of.rate) & 1) == 0 && !ReadReadings(sensor, of, to, row)) return false;
    if (!to->columns.scan.empty())
      to->columns.scan[row * scene.sensors.size() + k] = rows::PlanarOf(ranger.GetScanPose());
  }
  return true;
}

/// Returns false if the sensor has other readings than it can have in rows.
bool RowBridge::ReadReadings(const ModelRanger::Sensor& sensor, const rows::Sensor& of,
                             rows::Rows* to, size_t row) {
  if (!to->HasReadings(row, of.rate)) return true;
  if (sensor.ranges.size() != of.rays || sensor.intensities.size() != of.rays) return false;
  rows::Columns& c = to->columns;
  const std::vector<double>& known = to->scene().brightness;
  const size_t first = row * to->scene().ray_count + of.first_ray;
  for (uint32_t ray = 0; ray < of.rays; ray++) {
    const auto value = std::ranges::find(known, sensor.intensities[ray]);
    if (value == known.end()) return false;
    c.ranges[first + ray] = sensor.ranges[ray];
    c.brightness[first + ray] = static_cast<uint8_t>(value - known.begin());
  }
  return true;
}

// ---- from a row to a world ----------------------------------------------------------------------

bool RowBridge::Write(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  if (!world->Restore(scene.initial_state->state)) return false;
  WriteRandomNumbers(from, row, world);
  world->sim_time = c.time[row];
  world->updates = c.steps[row];
  if (!scene.varied.empty()) WriteVaried(from, row, world);
  if (scene.populations) WritePopulations(from, row, world);
  WriteMovers(from, row, world);
  WriteEnergy(from, row, world);
  WriteSensors(from, row, world);
  WriteFinders(from, row, world);
  WriteControls(from, row, world);
  WriteSchedule(from, row, world);
  WriteGrid(from, row, world);
  return true;
}

void RowBridge::WriteMovers(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  for (size_t k = 0; k < scene.movers.size(); k++) {
    const rows::Mover& mover = scene.movers[k];
    Model& model = *world->FindModel(mover.model->GetId());
    const size_t i = row * scene.movers.size() + k;
    model.pose = rows::PoseOf(c.pose[i], mover.z);
    model.stall = c.stalled[i];
    if (mover.robot)
      WriteRobot(from, row, k, static_cast<ModelPosition*>(&model));
    else if (c.steps[row] > 0 && mover.is_pushed)
      model.pose_before_push_ = std::make_unique<Pose>(rows::PoseOf(c.before[i], mover.z));
  }
}

void RowBridge::WriteRobot(const rows::Rows& from, size_t row, size_t k, ModelPosition* to) {
  const rows::Columns& c = from.columns;
  const rows::Mover& mover = from.scene().movers[k];
  const size_t i = row * from.scene().movers.size() + k;
  ModelPosition& model = *to;
  model.velocity = rows::VelocityOf(c.velocity[i]);
  model.goal = rows::PoseOf(c.command[i], 0);
  model.control_mode = static_cast<ModelPosition::ControlMode>(c.mode[i]);
  model.watts = c.watts[i];
  if (mover.runs) {
    model.last_update_ = from.LastUpdate(row, mover.rate);
    model.sensed_pose_ = rows::PoseOf(c.sensed[i], mover.z);
    model.sensed_at_ = from.SensedAt(row, k);
    if (!mover.has_odometry) model.est_pose = model.sensed_pose_;
  }
  if (!c.hindered.empty()) {
    model.is_hindered_ = c.hindered[i];
    model.made_ = rows::VelocityOf(c.made[i]);
  }
  if (mover.steers) model.steering_ = c.steering[i];
  if (!mover.has_odometry) return;
  model.est_pose = rows::PoseOf(c.estimate[i], model.est_pose.z);
  model.driven_ = rows::PoseOf(c.driven[i], 0);
  if (!model.noisy_odometry_) return;
  *model.noisy_odometry_ = c.noisy_odometry[i];
  WriteRandom(c.random[i], &model);
}

/// Sets the totals last, because packs change them.
void RowBridge::WriteEnergy(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  if (scene.packs.empty()) return;
  for (size_t k = 0; k < scene.packs.size(); k++) {
    PowerPack& pack = *world->FindModel(scene.packs[k].model->GetId())->power_pack;
    pack.SetStored(c.stored[row * scene.packs.size() + k]);
    pack.dissipated_ = c.dissipated[row * scene.packs.size() + k];
  }
  world->engine_->energy_totals = c.energy[row];
}

void RowBridge::WriteSensors(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  for (uint32_t rate = 0; rate < scene.rates.size(); rate++)
    if (from.HasReadings(row, rate))
      for (const Model* updating : scene.rates[rate].models)
        world->FindModel(updating->GetId())->updated_at_ = from.LastUpdate(row, rate);
  for (size_t k = 0; k < scene.sensors.size(); k++) {
    const rows::Sensor& of = scene.sensors[k];
    if (!from.HasReadings(row, of.rate)) continue;
    auto& ranger = static_cast<ModelRanger&>(*world->FindModel(of.ranger->GetId()));
    ModelRanger::Sensor& sensor = ranger.sensors_[of.index];
    sensor.Resize();
    const size_t first = row * scene.ray_count + of.first_ray;
    for (uint32_t ray = 0; ray < of.rays; ray++) {
      sensor.ranges[ray] = c.ranges[first + ray];
      sensor.intensities[ray] = scene.brightness[c.brightness[first + ray]];
    }
    sensor.random_ = StreamOf(from, row, k);
    sensor.seeded_ = IsSeeded(from, row, k);
    ranger.SetScanPose(ScanPose(from, row, k));
  }
}

/// Global pose of the ranger of a sensor at its last update.
Pose RowBridge::ScanPose(const rows::Rows& from, size_t row, size_t sensor) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  const rows::Sensor& of = scene.sensors[sensor];
  const rows::Mover& mover = scene.movers[of.mover];
  const Pose now = mover.GlobalPoseOf(
      of.node, rows::PoseOf(c.sensed[row * scene.movers.size() + of.mover], mover.z));
  return c.scan.empty() ? now : rows::PoseOf(c.scan[row * scene.sensors.size() + sensor], now.z);
}

void RowBridge::WriteSchedule(const rows::Rows& from, size_t row, World* world) {
  const rows::Columns& c = from.columns;
  Scheduler& scheduler = world->engine_->scheduler;
  scheduler.Clear();
  std::vector<std::pair<uint64_t, uint32_t>> order;
  for (uint32_t rate = 0; rate < from.scene().rates.size(); rate++)
    order.emplace_back(c.scheduled.empty() ? 0 : c.scheduled[from.RateIndex(row, rate)], rate);
  std::ranges::sort(order);
  for (const auto& [number, rate] : order)
    for (const Model* updating : from.scene().rates[rate].models) {
      Model* const model = world->FindModel(updating->GetId());
      scheduler.Add(c.next_update[from.RateIndex(row, rate)],
                    {model, nullptr, nullptr, model->update_generation_});
    }
}

/// Rasterizes the robots in the order in which they were last rasterized in the row.
void RowBridge::WriteGrid(const rows::Rows& from, size_t row, World* world) {
  const rows::Scene& scene = from.scene();
  const rows::Columns& c = from.columns;
  const std::vector<Model*>& models = world->engine_->models;
  for (const rows::Mover& mover : scene.movers) world->FindModel(mover.model->GetId())->Map();
  std::vector<std::pair<uint64_t, World::RasterizedBody>> recent;
  for (size_t k = 0; k < scene.bodies.size(); k++) {
    const uint64_t stamp = c.stamp[row * scene.bodies.size() + k];
    if (stamp == 0) continue;
    const auto place =
        std::ranges::lower_bound(models, scene.bodies[k].model->GetId(), {}, &Model::GetId);
    World::RasterizedBody body;
    body.model = static_cast<uint32_t>(place - models.begin());
    body.number = scene.bodies[k].block;
    recent.emplace_back(stamp, body);
  }
  std::ranges::sort(recent, {}, [](const auto& entry) { return entry.first; });
  std::vector<World::RasterizedBody> order;
  for (const auto& [stamp, body] : recent) order.push_back(body);
  [[maybe_unused]] const bool restored = world->RestoreOrder(models, &order);
  STAGE_ASSERT(restored);
  world->engine_->scene.grid.SetExtent(c.extent[row]);
}

}  // namespace Stg
