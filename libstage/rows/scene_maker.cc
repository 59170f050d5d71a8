// SPDX-License-Identifier: GPL-2.0-or-later
//
// Makes the scene of a closed world, and says what keeps a world from being closed.

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <utility>

#include "messages/report.hh"
#include "models/body.hh"
#include "models/contact_outline.hh"
#include "models/light.hh"
#include "models/model_type.hh"
#include "models/power_pack.hh"
#include "models/radio.hh"
#include "motion/drive_table.hh"
#include "random/fnv1a.hh"
#include "rows/in_mover.hh"
#include "rows/model_kinds.hh"
#include "rows/row_bridge.hh"
#include "rows/shown.hh"
#include "rows/stepper.hh"
#include "world/engine.hh"
#include "world/initial_state.hh"
#include "world/populate.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace grid = internal::grid;
using rows::IsOfMover;
using rows::IsOfType;
using rows::IsPushed;
using rows::IsRobot;
using rows::IsRunning;
using rows::IsSensor;
using rows::Named;

namespace {

constexpr size_t kMaxRobots = 256;  // more are faster as a world
constexpr size_t kMaxBrightness = 256;
constexpr const char* kLargeMap =
    "what stands covers too large an area (a coarser resolution is possible)";

/// True if the shown colour of the model changes.
bool IsLight(const Model& model) { return dynamic_cast<const LightSource*>(&model) != nullptr; }

bool IsSeenByBlobfinders(const Model& model) {
  return model.vis.blob_return && std::ranges::any_of(model.host().models, [](const Model* other) {
           return IsOfType(*other, "blobfinder") && IsRunning(*other);
         });
}

}  // namespace

// ---- whether a world is closed ------------------------------------------------------------------

/// Says why rows cannot hold a model; empty if they can.
std::string RowBridge::WhyNotModel(const Model& model) {
  const ModelType* const type = FindModelType(model);
  if (!type) return Named(model) + " is of a class that rows do not know";
  if (type->name == "field") return Named(model) + " is a field, whose values rows do not have";
  const bool known = type->name == "model" || IsSensor(model) || IsRobot(model);
  if (IsRunning(model) && !known)
    return Named(model) + " is a " + type->name +
           " with subscribers (without them it may stand there)";
  if (type->name == "radio" && static_cast<const ModelRadio&>(model).GetSendingCount() > 0)
    return Named(model) + " is a radio with messages on the way";
  if (!IsRobot(model) && type->moves != ModelType::kStays)
    return Named(model) + " is a " + type->name + ", which moves by itself";
  if (IsRobot(model) && model.Parent()) return Named(model) + " is a robot on another model";
  if (IsLight(model) && IsSeenByBlobfinders(model))
    return Named(model) + " is a " + type->name + " that blobfinders see on and off";
  if (model.watts_give > 0 && model.FindPowerPack()) return Named(model) + " charges others";
  if (model.power_pack && !IsOfMover(model)) return Named(model) + " has a power pack and stands";
  if (model.blockgroup->IsUnrasterized()) return Named(model) + " is not in the grid";
  if (IsRobot(model)) return WhyNotRobot(static_cast<const ModelPosition&>(model));
  if (type->name == "ranger" && IsRunning(model))
    return WhyNotRanger(static_cast<const ModelRanger&>(model));
  if (IsSensor(model) && IsRunning(model)) return WhyNotFinder(model);
  return "";
}

std::string RowBridge::WhyNotRobot(const ModelPosition& robot) {
  if (robot.disabled) return Named(robot) + " is disabled";
  if (robot.velocity.z != 0 || robot.goal.z != 0) return Named(robot) + " moves upwards";
  if (!IsRunning(robot)) return "";
  if (robot.drive_mode == ModelPosition::DRIVE_CUSTOM)
    return Named(robot) + " has a drive of a plug-in (\"diff\", \"omni\" and \"car\" are possible)";
  if (robot.drive_mode == ModelPosition::DRIVE_CAR &&
      robot.control_mode != ModelPosition::CONTROL_VELOCITY)
    return Named(robot) + " is a car without a command of velocity (SetSpeed() gives one)";
  return "";
}

std::string RowBridge::WhyNotRanger(const ModelRanger& ranger) {
  for (const ModelRanger::Sensor& sensor : ranger.GetSensors()) {
    if (sensor.response.exists()) return Named(ranger) + " has a response curve";
    if (sensor.Duration() > 0)
      return Named(ranger) + " has a scan that takes time (without time_increment it is possible)";
    if (sensor.Reach() * ranger.scene().cells_per_metre > RAY_LEG_CELLS)
      return Named(ranger) + " has rays of more than " + std::to_string(RAY_LEG_CELLS) +
             " cells (shorter ones, or a coarser resolution, are possible)";
  }
  return "";
}

std::string RowBridge::WhyNotClosed(const World& world) {
  const WorldEngine& engine = *world.engine_;
  if (!world.wf) return "no world is loaded";
  if (!engine.IsIdle()) return "a callback is running";
  if (world.options_.controllers && world.wf->TupleLength(0, "plugins") > 0)
    return "the world uses plug-ins (worlds loaded without controllers lack them)";
  if (world.HasClients())
    return "there are controllers or callbacks (commands from arrays and batch controllers are "
           "possible, and worlds loaded without controllers)";
  if (!const_cast<World&>(world).PendingCallback().empty()) return "a callback is pending";
  if (!engine.metrics.Values().empty())
    return "the world has metrics (they can be computed from arrays)";
  size_t robots = 0;
  for (const Model* model : engine.models) {
    if (std::string reason = WhyNotModel(*model); !reason.empty()) return reason;
    robots += IsRobot(*model);
  }
  if (std::string reason = WhyNotPopulations(world); !reason.empty()) return reason;
  if (std::string reason = WhyNotControls(world); !reason.empty()) return reason;
  if (robots > kMaxRobots)
    return "there are more than " + std::to_string(kMaxRobots) +
           " robots (one large world is stepped best as it is)";
  return WhyNotSchedule(world);
}

/// All running models with the same interval must update at the same times.
std::string RowBridge::WhyNotSchedule(const World& world) {
  std::map<usec_t, std::pair<usec_t, const Model*>> first;  // by interval
  std::string reason;
  ForEachUpdate(world, [&](usec_t time, const Model* model) {
    const auto [known, is_new] = first.try_emplace(model->GetUpdateInterval(), time, model);
    if (known->second.first != time)
      reason = Named(*known->second.second) + " and " + Named(*model) +
               " have the same update interval, but update at different times";
  });
  if (first.size() > rows::RateGroup::kMost)
    reason = "there are more than " + std::to_string(rows::RateGroup::kMost) + " update intervals";
  return reason;
}

// ---- the scene ----------------------------------------------------------------------------------

/// Fills in a scene. Its functions are called in the order of declaration.
class RowBridge::SceneMaker {
 public:
  SceneMaker(World* world, rows::Scene* scene) : world_(*world), scene_(*scene) {}

  void AddMovers();
  void PlaceBits();
  void AddSensors();
  void AddPacks();
  void FindRates();
  void CopyGrid();
  void MakeMaps();
  void FindNeighbours();
  void CopyContacts();
  void CopyWalls();
  /// Why a row cannot hold the world; empty if it can.
  const std::string& reason() const { return reason_; }

 private:
  void AddMover(const Model& model);
  static void SetRobot(const ModelPosition& model, rows::Mover* to);
  void AddNode(const Model& model, uint32_t parent, rows::Mover* mover);
  void AddBodies(const Model& model, uint32_t node, rows::Mover* mover);
  uint32_t RatesOfTree(const Model& model) const;
  void AddSensor(ModelRanger* ranger, rows::InMover at, uint32_t index);
  uint8_t BrightnessOf(const Model& model);
  template <typename F>
  void ForEachStandingBody(F f) const;

  World& world_;
  rows::Scene& scene_;
  std::string reason_;
};

void RowBridge::SceneMaker::AddMovers() {
  scene_.cells_per_metre = world_.engine_->scene.cells_per_metre;
  scene_.step = world_.sim_interval;
  scene_.outlines = world_.engine_->contact_model == ContactModel::kOutlines;
  scene_.brightness = {0.0};
  for (const Model* model : world_.engine_->models) BrightnessOf(*model);
  for (const Model* model : world_.engine_->models) {
    if (model->Parent() || !IsOfMover(*model)) continue;
    AddMover(*model);
  }
  if (scene_.brightness.size() > kMaxBrightness)
    reason_ = "there are too many values of ranger_return";
}

/// Reserves memory for the bits of all outlines.
void RowBridge::SceneMaker::PlaceBits() {
  for (rows::Body& body : scene_.bodies) {
    body.first_byte = scene_.byte_count;
    scene_.byte_count +=
        static_cast<uint32_t>(scene_.narrow ? rows::kNarrowSide * sizeof(rows::NarrowWord)
                                            : body.rows * sizeof(rows::WideWord));
  }
}

void RowBridge::SceneMaker::AddMover(const Model& model) {
  rows::Mover mover{};
  mover.model = &model;
  mover.z = model.pose.z;
  mover.first_body = static_cast<uint32_t>(scene_.bodies.size());
  mover.pack = rows::Consumer::kNone;
  mover.row = rows::Mover::kNoRow;
  mover.is_pushed = IsPushed(model) && !IsRobot(model);
  mover.properties.mass = model.mass;
  mover.properties.friction = model.GetFriction();
  mover.properties.floor_friction = model.GetFloorFriction();
  mover.load = model.GetMassOfChildren();
  if (IsRobot(model)) SetRobot(static_cast<const ModelPosition&>(model), &mover);
  if (mover.runs) {
    mover.rate = scene_.RateOf(model);
    mover.sensed_at = RatesOfTree(model);
  }
  AddNode(model, 0, &mover);
  mover.body_count = static_cast<uint32_t>(scene_.bodies.size()) - mover.first_body;
  if (mover.body_count > rows::kMaxBodies)
    reason_ = Named(model) + " has more than " + std::to_string(rows::kMaxBodies) + " blocks";
  scene_.movers.push_back(std::move(mover));
}

void RowBridge::SceneMaker::SetRobot(const ModelPosition& model, rows::Mover* to) {
  rows::Mover& mover = *to;
  mover.robot = &model;
  mover.runs = IsRunning(model);
  mover.drive = model.InputOfDrive(0);
  mover.function = model.drive_->function;
  mover.has_odometry = mover.runs && model.localization_mode == ModelPosition::LOCALIZATION_ODOM;
  mover.has_noisy_odometry = mover.runs && model.noisy_odometry_ != nullptr;
  mover.errors_given = model.errors_given_;
  mover.steers = model.drive_mode == ModelPosition::DRIVE_CAR;
  mover.is_omni = model.drive_mode == ModelPosition::DRIVE_OMNI;
  mover.obeys_velocity = !mover.steers && !model.limits_acceleration_;
  mover.properties.wheel_slip = model.wheel_slip_;
  mover.properties.wheelbase = model.wheelbase;
  mover.properties.steering_limit = model.steering_limit_;
  mover.properties.steering_rate = model.steering_rate_;
  std::ranges::copy(model.velocity_bounds, mover.properties.velocity_bounds);
  std::ranges::copy(model.acceleration_bounds, mover.properties.acceleration_bounds);
  mover.has_origin = model.wf->PropertyExists(model.wf_entity, "localization_origin");
  mover.origin = model.est_origin;
}

/// The groups of rates of the running models of a tree, as bits.
uint32_t RowBridge::SceneMaker::RatesOfTree(const Model& model) const {
  uint32_t rates = IsRunning(model) ? 1u << scene_.RateOf(model) : 0;
  for (const Model* child : model.GetChildren()) rates |= RatesOfTree(*child);
  return rates;
}

/// Adds a model of a mover's tree, with its bodies, and its children.
void RowBridge::SceneMaker::AddNode(const Model& model, uint32_t parent, rows::Mover* mover) {
  const auto node = static_cast<uint32_t>(mover->nodes.size());
  Pose local = model.pose;
  if (model.parent && model.parent->stack_children) local.z += model.parent->geom.size.z;
  mover->nodes.push_back({parent, local, model.geom.pose});
  AddBodies(model, node, mover);
  for (const Model* child : model.GetChildren()) AddNode(*child, node, mover);
}

void RowBridge::SceneMaker::AddBodies(const Model& model, uint32_t node, rows::Mover* mover) {
  const Pose global = mover->GlobalPoseOf(node, Pose(0, 0, mover->z, 0));
  const Pose frame = mover->FrameOf(node, Pose(0, 0, mover->z, 0));
  const double lift = global.z + model.geom.pose.z;
  uint32_t index = 0;
  for (const auto& block : model.body().blocks()) {
    rows::Body body{};
    body.mover = static_cast<uint32_t>(scene_.movers.size());
    body.node = node;
    body.corners = block->points();
    for (size_t i = 0; i < (body.corners.size() + 7) / 8 * 8; i++) {
      const point_t& p = body.corners[std::min(i, body.corners.size() - 1)];
      body.corners_x.push_back(p.x);
      body.corners_y.push_back(p.y);
    }
    body.height = Bounds(block->z_range().min + lift, block->z_range().max + lift);
    body.obstacle = model.vis.obstacle_return;
    body.brightness = BrightnessOf(model);
    body.model = &model;
    body.block = index++;
    body.loading_stamp = block->loading_stamp();
    double longest = 0;
    for (const point_t& p : body.corners) {
      const Pose corner = frame + Pose(p.x, p.y, 0, 0);
      body.radius = std::max(body.radius, Hypotenuse(corner.x, corner.y) * (1 + 1e-9));
      for (const point_t& q : body.corners)
        longest = std::max(longest, Hypotenuse(p.x - q.x, p.y - q.y));
    }
    const double side = std::ceil(longest * scene_.cells_per_metre) + 2;
    if (side > rows::kMaxSide || body.corners.size() > rows::CornerCells::kMax ||
        body.corners.empty()) {
      reason_ = Named(model) + " has an outline of more than " + std::to_string(rows::kMaxSide) +
                " cells or corners (a coarser resolution, or several models, are possible)";
      return;
    }
    body.first_point = scene_.point_count;
    scene_.point_count += static_cast<uint32_t>(body.corners.size()) + 1;
    scene_.narrow = scene_.narrow && side <= rows::kNarrowSide;
    body.rows = static_cast<uint32_t>(side);
    scene_.bodies.push_back(std::move(body));
  }
}

/// The index of the model's ranger_return, which rangers report.
uint8_t RowBridge::SceneMaker::BrightnessOf(const Model& model) {
  std::vector<double>& values = scene_.brightness;
  const auto found = std::ranges::find(values, model.vis.ranger_return);
  if (found != values.end()) return static_cast<uint8_t>(found - values.begin());
  values.push_back(model.vis.ranger_return);
  return static_cast<uint8_t>(values.size() - 1);
}

void RowBridge::SceneMaker::AddSensors() {
  rows::ForEachInMovers(world_, scene_, [&](Model* model, rows::InMover at) {
    if (!IsOfType(*model, "ranger") || !IsRunning(*model)) return;
    auto* const ranger = static_cast<ModelRanger*>(model);
    for (uint32_t i = 0; i < ranger->GetSensors().size(); i++)
      if (ranger->GetSensors()[i].sample_count > 0) AddSensor(ranger, at, i);
  });
}

void RowBridge::SceneMaker::AddSensor(ModelRanger* ranger, rows::InMover at, uint32_t index) {
  ModelRanger::Sensor& settings = ranger->GetSensorsMutable()[index];
  settings.Resize();  // finds the bearings
  const uint32_t samples = settings.sample_count;
  rows::Sensor sensor{};
  sensor.mover = at.mover;
  sensor.node = at.node;
  sensor.rate = scene_.RateOf(*ranger);
  sensor.ranger = ranger;
  sensor.settings = &settings;
  sensor.index = index;
  sensor.reach = settings.Reach();
  sensor.exact = world_.engine_->IsExact(settings.ray_model);
  sensor.first_ray = scene_.ray_count;
  sensor.rays = samples;
  sensor.noise = {settings.range_noise_const, settings.range_noise, settings.angle_noise};
  sensor.turns_noisily = settings.HasAngleNoise();
  sensor.needed = settings.IsNoisy();
  sensor.defects = settings.Defects();
  sensor.noisy = sensor.needed || sensor.defects.Any();
  sensor.increment = settings.Increment();
  sensor.name_hash = Fnv1a(ranger->token + "/" + std::to_string(index));
  sensor.first_direction = scene_.directions.Find(settings.table_fov_, samples);
  const Pose frame = ranger->SensorFrame(ranger->GetGlobalPose());
  sensor.z = ModelRanger::OriginOf(settings, frame, SinCos(frame.a)).z;
  scene_.exact = scene_.exact || sensor.exact;
  scene_.needs_rays = scene_.needs_rays || sensor.needed;
  scene_.ray_count += samples;
  scene_.sensors.push_back(std::move(sensor));
}

/// Finds the power packs and what draws energy from them. See Model::UpdateCharge().
void RowBridge::SceneMaker::AddPacks() {
  std::map<const PowerPack*, uint32_t> numbers;
  for (const Model* model : world_.engine_->models) {
    if (!model->power_pack) continue;
    numbers[model->power_pack.get()] = static_cast<uint32_t>(scene_.packs.size());
    scene_.packs.push_back({model, model->power_pack.get()});
  }
  for (const Model* model : world_.engine_->energy) {
    rows::Consumer consumer{numbers.at(model->FindPowerPack()), rows::Consumer::kNone,
                            model->watts};
    for (uint32_t k = 0; k < scene_.movers.size(); k++)
      if (scene_.movers[k].robot == model) consumer.mover = k;
    scene_.consumers.push_back(consumer);
  }
  for (rows::Mover& mover : scene_.movers)
    if (mover.robot && mover.robot->stops_when_empty_ && mover.robot->FindPowerPack())
      mover.pack = numbers.at(mover.robot->FindPowerPack());
}

void RowBridge::SceneMaker::FindRates() {
  std::map<usec_t, rows::RateGroup> groups;  // by interval
  ForEachUpdate(world_, [&](usec_t, const Model* model) {
    groups[model->GetUpdateInterval()].models.push_back(model);
  });
  for (auto& [interval, group] : groups) scene_.rates.push_back(std::move(group));
  if (scene_.rates.empty()) scene_.rates.emplace_back();
}

/// Copies the grid without the robots.
void RowBridge::SceneMaker::CopyGrid() {
  if (scene_.exact) world_.engine_->RasterizeForExactRays();
  scene_.grid.AssignCopy(world_.engine_->scene.grid);
  for (const Model* model : world_.engine_->models) {
    if (!IsOfMover(*model)) continue;
    model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& cells) {
      scene_.grid.Rasterize(id, cells, {});
      scene_.grid.RemoveBody(id);
    });
  }
  for (rows::Sensor& sensor : scene_.sensors)
    sensor.layer = scene_.grid.RangerLayer(sensor.z, true, sensor.exact);
}

template <typename F>
void RowBridge::SceneMaker::ForEachStandingBody(F f) const {
  for (const Model* model : world_.engine_->models) {
    if (IsOfMover(*model)) continue;
    model->body().ForEachBody([&](grid::BodyId id, const std::vector<grid::CellSet>& cells) {
      f(*model, world_.engine_->scene.grid.body(id), cells);
    });
  }
}

void RowBridge::SceneMaker::MakeMaps() {
  std::map<std::pair<double, double>, uint32_t> known;
  std::vector<grid::CellSet> all;
  const auto append = [&](const std::vector<grid::CellSet>& cells) {
    all.insert(all.end(), cells.begin(), cells.end());
  };
  const auto make = [&](std::vector<rows::CellMap>* maps, bool with_cells) {
    maps->emplace_back();
    if (!maps->back().Make(all, with_cells)) reason_ = kLargeMap;
    all.clear();
  };
  for (rows::Body& body : scene_.bodies) {
    const auto [place, is_new] =
        known.try_emplace({body.height.min, body.height.max}, scene_.blocked.size());
    body.blocked = place->second;
    if (!is_new) continue;
    ForEachStandingBody([&](const Model& model, const grid::Body& other, const auto& cells) {
      if (rows::Blocks(model, other, body.height)) append(cells);
    });
    make(&scene_.blocked, true);
  }
  known.clear();
  for (rows::Sensor& sensor : scene_.sensors) {
    const auto [place, is_new] = known.try_emplace({sensor.z, 0}, scene_.seen.size());
    sensor.seen = place->second;
    if (!is_new) continue;
    ForEachStandingBody([&](const Model&, const grid::Body& other, const auto& cells) {
      if (rows::IsSeenAt(other, sensor.z)) append(cells);
    });
    make(&scene_.seen, false);
  }
}

/// Finds the bodies of other robots that a body may run into, and that a sensor may see.
void RowBridge::SceneMaker::FindNeighbours() {
  for (uint32_t other = 0; other < scene_.bodies.size(); other++) {
    const rows::Body& there = scene_.bodies[other];
    for (rows::Body& body : scene_.bodies)
      if (body.mover != there.mover && body.obstacle && there.obstacle &&
          there.height.min <= body.height.max && there.height.max >= body.height.min)
        body.rivals.push_back(other);
    for (rows::Sensor& sensor : scene_.sensors)
      if (sensor.mover != there.mover && !(there.model->vis.ranger_return < 0) &&
          there.height.min <= sensor.z && sensor.z <= there.height.max)
        sensor.others.push_back(other);
  }
}

void RowBridge::SceneMaker::CopyContacts() {
  if (!scene_.outlines) return;
  ContactPhase& contacts = world_.engine_->contacts;
  contacts.Refresh(world_.engine_.get());
  scene_.shapes = contacts.shapes();
  scene_.walls = contacts.walls();
  scene_.columns = contacts.columns();
  for (uint32_t row = 0; row < contacts.roots().size(); row++) {
    const auto mover = std::ranges::find(scene_.movers, contacts.roots()[row], &rows::Mover::model);
    STAGE_ASSERT(mover != scene_.movers.end());
    mover->row = row;
    mover->bottom = contacts.BottomOf(row);
  }
  CopyWalls();
}

/// Separates walls that worlds or their seeds place from the others. See ContactPhase::FindWalls().
void RowBridge::SceneMaker::CopyWalls() {
  const PopulationPlan* const populations = world_.engine_->populations.get();
  const auto is_placed = [&](const Model& root) {
    return rows::IsPlaced(root) || (populations && populations->Has(root.GetId()));
  };
  bool any = false;
  for (rows::Mover& mover : scene_.movers) {
    if (mover.row != rows::Mover::kNoRow) continue;
    mover.is_wall = !is_placed(*mover.model);
    any = any || !mover.is_wall;
  }
  if (!any) return;
  ContactOutline outline;
  scene_.wall_parts.push_back({{}, rows::Mover::kNoRow});
  for (const Model* model : world_.engine_->models) {
    if (model->Parent() || model->contact_row_ != Model::kNoRow) continue;
    if (is_placed(*model)) {
      const auto mover = std::ranges::find(scene_.movers, model, &rows::Mover::model);
      scene_.wall_parts.back().mover = static_cast<uint32_t>(mover - scene_.movers.begin());
      scene_.wall_parts.push_back({{}, rows::Mover::kNoRow});
    } else {
      outline.Find(*model, model->GetGlobalPose());
      outline.AddTo(&scene_.wall_parts.back().walls, model->GetId());
    }
  }
}

std::shared_ptr<rows::Scene> RowBridge::MakeOwnScene(std::unique_ptr<World> prototype,
                                                     std::string* reason,
                                                     std::span<const rows::VariedNumber> varied) {
  *reason = WhyNotClosed(*prototype);
  if (!reason->empty()) return nullptr;
  auto scene = std::make_shared<rows::Scene>();
  scene->initial_state = CaptureStart(prototype.get());
  if (!scene->initial_state) {
    *reason = "the world cannot be restarted";
    return nullptr;
  }
  SceneMaker maker(prototype.get(), scene.get());
  maker.FindRates();
  maker.AddMovers();
  maker.PlaceBits();
  maker.AddSensors();
  AddVaried(varied, *prototype, scene.get());
  AddFinders(prototype.get(), scene.get());
  AddControls(*prototype, scene.get());
  maker.AddPacks();
  AddPopulations(prototype.get(), scene.get());
  maker.CopyGrid();
  maker.MakeMaps();
  maker.FindNeighbours();
  maker.CopyContacts();
  *reason = maker.reason();
  if (!FinishFinders(prototype.get(), scene.get())) *reason = kLargeMap;
  scene->prototype = std::move(prototype);
  return reason->empty() ? scene : nullptr;
}

}  // namespace Stg
