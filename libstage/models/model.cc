// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/model.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/flag.hh"
#include "models/host.hh"
#include "models/model_seed.hh"
#include "models/placement.hh"
#include "models/power_pack.hh"
#include "models/property_checks.hh"
#include "models/self_masks.hh"  // to delete them
#include "models/warn_about.hh"
#include "random/fnv1a.hh"
#include "sensing/scene.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// Sets *target unless the value is not finite.
void SetFinite(const Model& model, const char* name, double value, double* target) {
  if (std::isfinite(value))
    *target = value;
  else
    WarnAbout(model, "refused the %s %f, which is not finite", name, value);
}

/// Transforms a global pose into a frame.
Pose RelativeTo(const Pose& frame, const Pose& p) {
  const Pose turn(0, 0, 0, -frame.a);
  const Pose rotated = turn + Pose(p.x - frame.x, p.y - frame.y, 0, 0);
  return Pose(rotated.x, rotated.y, p.z - frame.z, p.a - frame.a);
}

/// Sets *target unless the value is negative or not finite.
void SetNotNegative(const Model& model, const char* name, double value, double* target) {
  if (value < 0)
    WarnAbout(model, "refused the %s %f, which is negative", name, value);
  else
    SetFinite(model, name, value, target);
}

std::string AutomaticName(const Ancestor& above, const Model* parent, const std::string& type,
                          unsigned int count) {
  const std::string own = type + ":" + std::to_string(count);
  return parent ? above.TokenStr() + "." + own : own;
}

}  // namespace

std::map<std::string, creator_t> Model::name_map;

Model::Model(World* world_, Model* parent_, const std::string& type_, const std::string& name)
    : alwayson(false),
      boundary(false),
      color(1, 0, 0),
      friction(0),
      gui{false, parent_ == nullptr, false, false},
      has_default_block(true),
      id(BaseOf(*world_).host().next_model_id++),
      map_resolution(0.1),
      mass(0),
      trail_index(0),
      trail_length(20),
      trail_interval(10),
      type(type_),
      used(false),
      watts(0),
      watts_give(0),
      watts_take(0),
      wf(nullptr),
      wf_entity(0),
      world(world_),
      disabled(false),
      stack_children(true),
      stall(false),
      subs(0),
      interval(100000),
      known_type_(nullptr),
      blockgroup(std::make_unique<BlockGroup>(*this)),
      world_base_(&BaseOf(*world_)),
      parent(LimitDepth(*world_base_, parent_)),
      root(parent ? parent->root : this),
      scene_(&host().scene),
      update_generation_(UpdateGeneration::First(id)),
      updated_at_(0),
      tree_updated_in_(0),
      callback_interval_(0),
      serial_update_callbacks_(false),
      hidden_from_rangers_(false),
      loaded_(false),
      shares_name_(false),
      controllers_(0),
      random_(SeedOfModel(parent ? parent->random_.seed() : world_base_->seed(), type_,
                          ParentOrWorld().CountOfType(type_))) {
  STAGE_ASSERT(!parent || parent->world == world);
  if (!parent) gui.move = true;  // the default may have been false before
  Ancestor& above = ParentOrWorld();
  const unsigned int count = above.CountOfType(type);
  Ancestor::SetToken(name.empty() ? AutomaticName(above, parent, type, count) : name);
  blockgroup->AddRectangle(-0.5, -0.5, 1.0, 1.0, Bounds(0, 1));
  blockgroup->Fit(geom.size);
  try {
    above.AddChild(this);
    world_base_->AddModel(this);
  } catch (...) {  // no destructor will run
    Leave();
    throw;
  }
}

Ancestor& Model::ParentOrWorld() { return parent ? static_cast<Ancestor&>(*parent) : *world_base_; }

/// Removes the model from the lists of its parent and its world.
void Model::Leave() {
  ParentOrWorld().RemoveChild(this);
  world_base_->RemoveModel(this);
}

Model::~Model() {
  if (callbacks_) callbacks_->model_deleted = true;
  if (!adopted_.empty()) host().DeferDelete(std::move(adopted_));
  host().TraceBatchAndPostponeThrowing();
  DeleteChildren();
  StopCharging();
  power_pack.reset();
  blockgroup->EraseFinally();
  Leave();
}

// ---- pose and geometry --------------------------------------------------------------------------

Pose Model::PlacedOnThis(const Pose& global, const Pose& local) const {
  Pose p = global + local;
  if (stack_children) p.z += geom.size.z;
  return p;
}

Pose Model::ChildGlobalPose(const Pose& global, const Model& child) const {
  return PlacedOnThis(global, child.pose);
}

Pose Model::GetSensedPose() const {
  const Pose local = GetSensedLocalPose();
  return parent ? parent->PlacedOnThis(parent->GetSensedPose(), local) : local;
}

Pose Model::GetGlobalPose() const {
  return parent ? parent->ChildGlobalPose(parent->GetGlobalPose(), *this) : pose;
}

void Model::SetPose(const Pose& new_pose) {
  if (!IsFinite(new_pose)) {
    WarnAbout(*this, "refused the pose [%f %f %f %f], which is not finite", new_pose.x, new_pose.y,
              new_pose.z, new_pose.a);
    return;
  }
  if (pose != new_pose) {
    pose = new_pose;
    pose.a = normalize(pose.a);
    host().contacts_known = false;
    Map();
  }
  CallCallbacks(CB_POSE);
}

void Model::SetGlobalPose(const Pose& gpose) {
  SetPose(parent ? parent->LocalPoseOf(gpose, parent->GetGlobalPose()) : gpose);
}

Pose Model::LocalPoseOf(const Pose& global, const Pose& frame) const {
  Pose local = RelativeTo(frame, global);
  if (stack_children) local.z -= geom.size.z;
  return local;
}

void Model::AddToPose(const Pose& p) { AddToPose(p.x, p.y, p.z, p.a); }

void Model::AddToPose(double dx, double dy, double dz, double da) {
  SetPose(Pose(pose.x + dx, pose.y + dy, pose.z + dz, pose.a + da));
}

void Model::SetGeom(const Geom& src) {
  if (!IsFinite(src.pose) || !std::isfinite(src.size.x) || !std::isfinite(src.size.y) ||
      !std::isfinite(src.size.z)) {
    WarnAbout(*this, "refused a geometry that is not finite");
    return;
  }
  geom = src;
  blockgroup->Fit(geom.size);
  Map();
  CallCallbacks(CB_GEOM);
}

Pose Model::GlobalToLocal(const Pose& p) const { return RelativeTo(GetGlobalPose(), p); }

Pose Model::LocalToGlobal(const Pose& p) const { return (GetGlobalPose() + geom.pose) + p; }

point_t Model::LocalToGlobal(const point_t& pt) const {
  const Pose global = LocalToGlobal(Pose(pt.x, pt.y, 0, 0));
  return point_t(global.x, global.y);
}

std::vector<point_int_t> Model::LocalToPixels(const std::vector<point_t>& local) const {
  std::vector<point_int_t> pixels;
  pixels.reserve(local.size());
  for (const point_t& p : local) {
    const point_t global = LocalToGlobal(p);
    pixels.emplace_back(host().MetersToPixels(global.x), host().MetersToPixels(global.y));
  }
  return pixels;
}

void Model::AddBlockRect(meters_t x, meters_t y, meters_t dx, meters_t dy, meters_t dz) {
  if (!IsFinite(Pose(x, y, dz, 0)) || !IsFinite(Pose(dx, dy, 0, 0))) {
    WarnAbout(*this, "refused a block that is not finite");
    return;
  }
  host().TraceBatch();
  blockgroup->AddRectangle(x, y, dx, dy, Bounds(0, dz));
}

void Model::ClearBlocks() {
  host().TraceBatch();
  blockgroup->Clear();
}

void Model::Map() {
  STAGE_ASSERT(!scene_->tearing_down);
  if (host().loading) return;  // all bodies are rasterized after loading
  host().TraceBatch();
  // The pose of a root with a row is read in each step.
  if (parent || contact_row_ == kNoRow) NoteOutlineChange();
  Placement& placement = host().placement;
  placement.Propose(*this, true);
  placement.Commit();
}

void Model::RegisterIfHidden() {
  if (is_registered_or_visible()) return;
  hidden_from_rangers_ = true;
  host().hidden_from_rangers.push_back(this);
}

bool Model::RestoreRangerVisibility() {
  if (vis.ranger_return < 0) return false;
  STAGE_ASSERT(hidden_from_rangers_);
  hidden_from_rangers_ = false;
  blockgroup->RefreshVisibility(true);
  return true;
}

void Model::UnMapWithChildren() {
  host().TraceBatch();
  blockgroup->Erase();
  for (Model* child : children) child->UnMapWithChildren();
}

void Model::Rasterize(uint8_t* data, unsigned int width, unsigned int height, meters_t cellwidth,
                      meters_t cellheight) {
  const auto mark = [&](double x, double y) {
    if (x >= 0 && y >= 0 && x < width && y < height)
      data[static_cast<size_t>(x) + static_cast<size_t>(y) * width] = 1;
  };
  for (const auto& block : blockgroup->blocks()) {
    const std::vector<point_t>& points = block->points();
    for (size_t i = 0; i < points.size(); i++) {
      const auto cell_of = [&](const point_t& p) {
        return point_t(std::floor((p.x + geom.size.x / 2.0) / cellwidth),
                       std::floor((p.y + geom.size.y / 2.0) / cellheight));
      };
      const point_t from = cell_of(points[i]), to = cell_of(points[(i + 1) % points.size()]);
      const double dx = to.x - from.x, dy = to.y - from.y;
      const double steps = std::max(std::fabs(dx), std::fabs(dy));
      if (!(steps <= 1e6)) continue;  // unreasonably large
      for (double s = 0; s <= steps; s += 1.0) {
        const double along = steps > 0 ? s / steps : 0;
        mark(std::floor(from.x + dx * along), std::floor(from.y + dy * along));
      }
    }
  }
  if (!world_base_->IsGUI()) return;
  last_raster_.reset(new Raster{std::vector<uint8_t>(data, data + size_t{width} * height), width,
                                height, cellwidth, cellheight});
}

bool Model::HasCollision() {
  Placement& placement = host().placement;
  placement.Propose(*this, true);
  return placement.Collision(world_base_->GetGround()) != nullptr;
}

bool Model::RandomPoseInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                                  size_t max_iter) {
  if (!std::isfinite(xmax - xmin) || !std::isfinite(ymax - ymin)) {
    WarnAbout(*this, "refused to search a rectangle that is not finite");
    return false;
  }
  const DeletionWatch watch(*this);
  SetPose(Pose::Random(random_.Get(), xmin, xmax, ymin, ymax));
  for (size_t i = 0; !watch.gone() && HasCollision(); i++) {
    if (max_iter > 0 && i >= max_iter) return false;
    SetPose(Pose::Random(random_.Get(), xmin, xmax, ymin, ymax));
  }
  return !watch.gone();
}

void Model::RestartRandomNumbers(unsigned index) {
  random_.Restart(SeedOfModel(parent ? parent->random_.seed() : world_base_->seed(), type, index));
  DrawInitialRandomNumbers();
}

bool Model::PlaceInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                             size_t max_iter) {
  return !HasCollision() || RandomPoseInFreeSpace(xmin, xmax, ymin, ymax, max_iter);
}

kg_t Model::GetMassOfChildren() const {
  kg_t sum = 0;
  for (const Model* child : children) sum += child->GetTotalMass();
  return sum;
}

kg_t Model::GetTotalMass() const { return mass + GetMassOfChildren(); }

// Pending rays must see the old values: readings are those of the time of the sensor's update.
void Model::SetColor(Color col) {
  host().TraceBatch();
  color = col;
}

void Model::SetFiducialReturn(int fid) {
  host().TraceBatch();
  vis.fiducial_return = fid;
}

void Model::SetFiducialKey(int key) {
  host().TraceBatch();
  vis.fiducial_key = key;
}

void Model::SetObstacleReturn(bool val) {
  host().TraceBatch();
  vis.obstacle_return = val;
  NoteOutlineChange();
}

void Model::SetBlobReturn(bool val) {
  host().TraceBatch();
  vis.blob_return = val;
}

void Model::SetGripperReturn(bool val) {
  host().TraceBatch();
  vis.gripper_return = val;
}

void Model::SetRangerReturn(double val) {
  host().TraceBatch();
  SetFinite(*this, "ranger_return", val, &vis.ranger_return);
}

void Model::SetMass(kg_t m) {
  SetNotNegative(*this, "mass", m, &mass);
  host().contacts_changed = true;
}

void Model::SetWatts(watts_t w) { SetNotNegative(*this, "watts", w, &watts); }

// ---- life cycle ---------------------------------------------------------------------------------

void Model::Subscribe() {
  if (++subs == 1) Startup();
}

void Model::Unsubscribe() {
  if (subs == 0) {
    WarnAbout(
        *this,
        "found a call of Unsubscribe() without subscribers, expected a Subscribe() before each");
    return;
  }
  if (--subs == 0) Shutdown();
}

/// Schedules the next update and voids a pending one.
void Model::ScheduleUpdate() {
  update_generation_ = UpdateGeneration::Next(update_generation_);
  STAGE_ASSERT(update_generation_ >> 32 == id && subs > 0);
  host().ScheduleUpdate(this, NextUpdateAfter(world_base_->SimTimeNow()), update_generation_);
}

void Model::Startup() {
  ScheduleUpdate();
  if (FindPowerPack()) host().EnableEnergy(this);
  CallCallbacks(CB_STARTUP);
}

void Model::Shutdown() {
  update_generation_ = UpdateGeneration::Next(update_generation_);  // voids a pending update
  host().DisableEnergy(this);
  StopCharging();
  CallCallbacks(CB_SHUTDOWN);
}

void Model::Update() {
  if (subs == 0) return;
  updated_at_ = world_base_->SimTimeNow();
  root->tree_updated_in_ = host().steps_begun;
  // Voids a pending update, in case the update was called by a client.
  ScheduleUpdate();
  if (HasCallbacks(CB_UPDATE)) host().update_callbacks_due.push_back(this);
}

}  // namespace Stg
