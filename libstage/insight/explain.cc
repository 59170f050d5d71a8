// SPDX-License-Identifier: GPL-2.0-or-later

#include "insight/explain.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>

#include "insight/sensor_kinds.hh"
#include "models/body.hh"
#include "models/camera.hh"
#include "models/field.hh"
#include "models/model_type.hh"
#include "models/position.hh"
#include "models/power_pack.hh"
#include "models/ranger.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// Arrays that double when full are two thirds full on average.
constexpr double kGrowth = 1.5;

size_t SizeOf(const Model& model) {
  const ModelType* const type = FindNearestModelType(model);
  return type ? type->size : sizeof(Model);
}

uint64_t CellsOf(const grid::CellBox& box) {
  if (box.empty()) return 0;
  return static_cast<uint64_t>(int64_t{box.max_x} - box.min_x + 1) *
         static_cast<uint64_t>(int64_t{box.max_y} - box.min_y + 1);
}

uint64_t OccupiedCells(const grid::Grid& grid) {
  uint64_t count = 0;
  for (const uint64_t word : grid.occupancy(grid::kEverything).tiles())
    count += static_cast<uint64_t>(std::popcount(word));
  return count;
}

/// Walks through a world once and collects its summary.
class SummaryBuilder {
 public:
  explicit SummaryBuilder(const World& world) : world_(world), engine_(world.engine()) {}

  SceneSummary Take() {
    TakeSettings();
    for (const Model* model : engine_.models)
      if (model != world_.ground) TakeModel(*model);
    for (const DrivenGroup& group : world_.engine().batch_controls.Groups(engine_))
      for (const DrivenRobot* driven : group.robots)
        s_.with_controller += driven->number == 0 && !driven->model->HasCallbacks(Model::CB_INIT);
    for (const auto& [type, kind] : types_) s_.types.push_back(kind);
    std::stable_sort(s_.types.begin(), s_.types.end(),
                     [](const ModelKind& a, const ModelKind& b) { return a.models > b.models; });
    TakeSensors();
    TakeFields();
    TakeHeights();
    TakeUnseenBlocks();
    TakeGrid();
    CountMemory();
    return std::move(s_);
  }

 private:
  struct PlacedBlock {
    const Model* model;
    Bounds z;  // global, metres
    bool ranger_visible;
  };

  void TakeSettings() {
    s_.load_warnings = engine_.load_warnings;
    s_.power_packs = engine_.power_packs;
    s_.energy_models = engine_.energy.size();
    s_.records_trails = world_.RecordsTrails();
    s_.has_window = world_.IsGUI();
    s_.device = engine_.tracer.statistics().device;
    s_.threads = engine_.max_threads();
    s_.chooses_threads = engine_.chooses_threads();
    s_.step = world_.sim_interval;
    s_.callbacks_per_step = static_cast<double>(engine_.update_callbacks.size());
  }

  void TakeFields() {
    for (const ModelField* field : engine_.fields) {
      if (field->diffusion() == 0 && field->evaporation() == 0) continue;
      s_.fields++;
      s_.field_cells +=
          static_cast<double>(field->values().size()) * UpdatesPerStep(*field, world_.sim_interval);
    }
  }

  void TakeModel(const Model& model) {
    s_.models++;
    ModelKind& kind = types_[model.GetModelType()];
    kind.type = model.GetModelType();
    kind.models++;
    const bool runs = model.HasSubscribers();
    kind.running += runs;
    s_.with_controller += model.HasCallbacks(Model::CB_INIT);
    const double per_step = runs ? UpdatesPerStep(model, world_.sim_interval) : 0;
    s_.updates_per_step += per_step;
    if (model.HasCallbacks(Model::CB_UPDATE)) s_.callbacks_per_step += per_step;
    if (dynamic_cast<const ModelPosition*>(&model)) {
      (runs ? s_.robots : s_.undriven)++;
      s_.position_updates += per_step;
    }
    if (const auto* ranger = dynamic_cast<const ModelRanger*>(&model)) TakeRanger(*ranger);
    if (!model.body().empty()) TakeBody(model);
    s_.memory.models += SizeOf(model) + sizeof(BlockGroup) + model.TokenStr().capacity();
  }

  void TakeBody(const Model& model) {
    s_.bodies++;
    const double lift = model.GetGlobalPose().z + model.GetGeom().pose.z;
    const bool ranger_visible = !(model.vis.ranger_return < 0);
    for (const auto& block : model.body().blocks()) {
      const size_t corners = block->points().size();
      s_.blocks++;
      s_.corners += corners;
      const Bounds& z = block->z_range();
      blocks_.push_back({&model, Bounds(z.min + lift, z.max + lift), ranger_visible});
      s_.memory.bodies += sizeof(Block) + corners * (2 * sizeof(point_t) + sizeof(point_int_t));
    }
    grid::Rasterizations rasterizations;
    for (const bool exact : {false, true})
      model.body().AppendRasterizations(&rasterizations, exact);
    for (const auto* sets : rasterizations.of_bodies)
      s_.memory.bodies += sets->capacity() * sizeof(grid::CellSet);
  }

  void TakeRanger(const ModelRanger& ranger) {
    const bool runs = ranger.HasSubscribers();
    const double per_step = UpdatesPerStep(ranger, world_.sim_interval);
    const Pose frame = ranger.SensorFrame(ranger.GetGlobalPose());
    const SineCosine turn = SinCos(frame.a);
    for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
      s_.memory.models += sizeof sensor;
      const double z = ModelRanger::OriginOf(sensor, frame, turn).z;
      if (sensor.sample_count == 0 || !(sensor.range.max > 0) || std::isnan(z)) continue;
      SensedHeight& height = heights_[z];
      (runs ? height.sensors : height.idle_sensors)++;
      if (!runs) continue;
      s_.exact_sensors += world_.IsExact(sensor.ray_model);
      height.rays_per_step += per_step * sensor.sample_count;
      const uint64_t there =
          sensor.ranges.capacity() + sensor.intensities.capacity() + sensor.bearings.capacity();
      const uint64_t needed = uint64_t{3} * sensor.sample_count;
      s_.memory.models += there * sizeof(double);
      s_.memory.readings += (needed - std::min(needed, there)) * sizeof(double);
    }
  }

  void TakeSensors() {
    for (const SensorGroup& group : SortSensors(engine_.models, world_.sim_interval)) {
      const SensorKind& kind = group.kind;
      s_.sensors.push_back(kind);
      if (!kind.subscribed) continue;
      if (kind.type != "ranger") s_.looking_everywhere += kind.models;
      s_.memory.pictures += kind.models * kind.pixels * (sizeof(GLfloat) + 4 * sizeof(GLubyte));
      if (kind.pixels == 0) fans_ += kind.models * kind.parts;
      if (kind.rays + kind.rays_vary > 0) rooted_ += kind.models;
    }
  }

  void TakeHeights() {
    const std::vector<double> bottoms = Sorted(&Bounds::min), tops = Sorted(&Bounds::max);
    size_t used = 0;
    for (auto& [z, height] : heights_) {
      height.z = z;
      used += height.sensors > 0;
      // Blocks whose bottom is at or below this height, minus those whose top is below it.
      height.blocks = static_cast<size_t>(
          (std::upper_bound(bottoms.begin(), bottoms.end(), z) - bottoms.begin()) -
          (std::lower_bound(tops.begin(), tops.end(), z) - tops.begin()));
      height.robots = CountRobotsAt(z);
      s_.heights.push_back(height);
    }
    std::stable_sort(s_.heights.begin(), s_.heights.end(),
                     [](const SensedHeight& a, const SensedHeight& b) {
                       return a.rays_per_step > b.rays_per_step;
                     });
    // One layer is for everything; one more serves all heights beyond kPlaces.
    constexpr size_t kPlaces = grid::kMaxHeights;
    s_.layer_heights = std::min(used, kPlaces);
    s_.layers = 1 + s_.layer_heights + (used > kPlaces ? 1 : 0);
  }

  /// Number of robots that rangers see at height `z`.
  size_t CountRobotsAt(double z) const {
    std::set<const Model*> robots;
    for (const PlacedBlock& block : blocks_) {
      if (!block.ranger_visible || z < block.z.min || z > block.z.max) continue;
      const Model* const root = block.model->Root();
      if (dynamic_cast<const ModelPosition*>(root)) robots.insert(root);
    }
    return robots.size();
  }

  /// Sorted bottoms or tops of all blocks that rangers see.
  std::vector<double> Sorted(double Bounds::*end) const {
    std::vector<double> values;
    for (const PlacedBlock& block : blocks_)
      if (block.ranger_visible) values.push_back(block.z.*end);
    std::sort(values.begin(), values.end());
    return values;
  }

  void TakeUnseenBlocks() {
    if (!blocks_.empty()) s_.body_heights = blocks_[0].z;
    bool seen = false;  // whether any block of this model so far is sensed
    for (size_t i = 0; i < blocks_.size(); i++) {
      const PlacedBlock& block = blocks_[i];
      s_.body_heights.min = std::min(s_.body_heights.min, block.z.min);
      s_.body_heights.max = std::max(s_.body_heights.max, block.z.max);
      const bool sensed = block.ranger_visible && IsSensed(block.z);
      s_.hidden_blocks += !block.ranger_visible;
      s_.overlooked_blocks += block.ranger_visible && !sensed;
      seen |= sensed;
      const bool last = i + 1 == blocks_.size() || blocks_[i + 1].model != block.model;
      if (!last) continue;
      if (!seen) TakeUnseenBody(*block.model);
      seen = false;
    }
  }

  void TakeUnseenBody(const Model& model) {
    constexpr size_t kExamples = 8;
    if (s_.unseen_bodies++ < kExamples) s_.unseen_examples.push_back(model.TokenStr());
  }

  bool IsSensed(const Bounds& z) const {
    auto height = heights_.lower_bound(z.min);
    for (; height != heights_.end() && height->first <= z.max; ++height)
      if (height->second.sensors > 0) return true;
    return false;
  }

  void TakeGrid() {
    const grid::Grid& grid = engine_.scene.grid;
    const double cell = 1.0 / engine_.scene.cells_per_metre;
    const grid::CellBox box = grid.occupied();
    s_.resolution = cell;
    s_.plane_cells = CellsOf(box);
    if (!box.empty()) {
      s_.extent.x = Bounds(box.min_x * cell, (box.max_x + 1.0) * cell);
      s_.extent.y = Bounds(box.min_y * cell, (box.max_y + 1.0) * cell);
    }
    s_.occupied_cells = OccupiedCells(grid);
    const grid::Grid::Statistics statistics = grid.statistics();
    s_.superregions = statistics.superregions;
    s_.regions = statistics.regions;
    s_.tiles = statistics.tiles;
    s_.dense_bytes = s_.plane_cells * sizeof(uint32_t) + s_.plane_cells / 8 * s_.layers;
    s_.memory.grid = statistics.bytes;
  }

  void CountMemory() {
    const grid::Grid& grid = engine_.scene.grid;
    const size_t layers_there = grid.layer_count();
    // One word each for the cells of 64 tiles, the occupied tiles and the changed tiles.
    const uint64_t region_bytes = (grid::kTilesPerRegion + 2) * sizeof(uint64_t);
    if (s_.layers > layers_there)
      s_.memory.layers = (s_.layers - layers_there) * region_bytes *
                         grid.occupancy(grid::kEverything).tile_maps().size();
    // Each robot has one self-mask for all its sensors; it covers the tiles around the robot.
    constexpr uint64_t kMaskTiles = 16;
    const double bytes = static_cast<double>(fans_ * sizeof(sensing::Fan) +
                                             rooted_ * kMaskTiles * sizeof(uint64_t)) +
                         s_.updates_per_step * sizeof(Scheduler::Event);
    s_.memory.batch = static_cast<uint64_t>(bytes * kGrowth);
  }

  const World& world_;
  const WorldEngine& engine_;
  SceneSummary s_;
  std::map<std::string, ModelKind> types_;
  std::map<double, SensedHeight> heights_;
  std::vector<PlacedBlock> blocks_;
  uint64_t fans_ = 0, rooted_ = 0;
};

}  // namespace

SceneSummary Summarize(const World& world) { return SummaryBuilder(world).Take(); }

}  // namespace Stg
