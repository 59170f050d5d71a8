// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/model.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/block.hh"
#include "models/flag.hh"
#include "models/host.hh"
#include "models/model_type.hh"
#include "models/noise.hh"
#include "models/own_windows.hh"
#include "models/power_pack.hh"
#include "models/thrown.hh"
#include "models/warn_about.hh"
#include "models/watch.hh"
#include "sensing/scene.hh"
#include "world/world.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

bool AllFinite(const Pose& p) {
  return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z) && std::isfinite(p.a);
}

/// Sets a number of a model, unless it is not finite.
void SetFinite(const Model& model, const char* name, double value, double* target) {
  if (std::isfinite(value))
    *target = value;
  else
    WarnAbout(model, "refused the %s %f, which is not finite", name, value);
}

Ancestor& AboveOf(Model* parent, World* world) {
  return parent ? static_cast<Ancestor&>(*parent) : *world;
}

/// Names have no part in it, as they may change.
uint64_t SeedOfPlace(uint64_t seed_above, const std::string& type, unsigned int count) {
  return MixSeeds(MixSeeds(seed_above, HashOf(type)), count);
}

/// The same, and unless it is negative.
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

[[maybe_unused]] const bool kRegistered =
    RegisterModelType(ModelTypeOf<Model>("model").Updates(ModelType::kShared));

}  // namespace

std::map<std::string, creator_t> Model::name_map;

Model::Model(World* world_, Model* parent_, const std::string& type_, const std::string& name)
    : alwayson(false),
      boundary(false),
      color(1, 0, 0),
      friction(0),
      gui{false, parent_ == nullptr, false, false},
      has_default_block(true),
      id(world_->host().next_model_id++),
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
      disabled(false),
      stack_children(true),
      stall(false),
      subs(0),
      interval(100000),
      known_type_(nullptr),
      blockgroup(std::make_unique<BlockGroup>(*this)),
      world(world_),
      parent(FitParent(*world_, parent_)),
      root(parent ? parent->root : this),
      scene_(&world_->host().scene),
      update_chain_(UpdateChain::First(id)),
      callback_run_(0),
      serial_update_callbacks_(false),
      hidden_from_rangers_(false),
      loaded_(false),
      shares_name_(false),
      random_(SeedOfPlace(parent ? parent->random_.seed() : world_->seed(), type_,
                          AboveOf(parent, world_).CountOfType(type_))) {
  if (!parent) gui.move = true;  // it may have been given one
  Ancestor& above = AboveOf(parent, world);
  const unsigned int count = above.CountOfType(type);
  Ancestor::SetToken(name.empty() ? AutomaticName(above, parent, type, count) : name);
  blockgroup->AddRectangle(-0.5, -0.5, 1.0, 1.0, Bounds(0, 1));
  blockgroup->Fit(geom.size);
  try {
    above.AddChild(this);
    world->AddModel(this);
  } catch (...) {  // no destructor follows
    Leave();
    throw;
  }
}

/// Takes it off the lists of its parent and its world.
void Model::Leave() {
  AboveOf(parent, world).RemoveChild(this);
  world->RemoveModel(this);
}

Model::~Model() {
  if (callbacks_) callbacks_->orphaned = true;
  if (!adopted_.empty()) world->host().KeepForNow(std::move(adopted_));
  world->host().TraceBatchAndPostponeThrowing();
  DeleteChildren();
  StopCharging();
  power_pack.reset();
  blockgroup->Clear();
  Leave();
}

// ---- names and the tree -------------------------------------------------------------------------

void Model::SetToken(const std::string& str) {
  Ancestor::SetToken(str);
  if (!str.empty()) world->AddModelName(this, token);
}

Model* Model::GetChild(const std::string& name) const {
  return world->GetModel(token + "." + name);
}

Model* Model::GetUnusedModelOfType(const std::string& wanted) {
  if (type == wanted && !used) {
    used = true;
    return this;
  }
  for (Model* child : children)
    if (Model* found = child->GetUnusedModelOfType(wanted)) return found;
  if (!parent)
    WarnAbout(*this, "no unused model of type %s on it", messages::Quoted(wanted).c_str());
  return nullptr;
}

Model* Model::GetUnsubscribedModelOfType(const std::string& wanted) const {
  if (type == wanted && subs == 0) return const_cast<Model*>(this);
  for (const Model* child : children)
    if (Model* found = child->GetUnsubscribedModelOfType(wanted)) return found;
  return nullptr;
}

Model* Model::LookupId(uint32_t wanted) { return World::FindModelOfAny(wanted); }

void Model::Print(char* prefix) const {
  std::printf("%s%s %s:%s\n", prefix ? prefix : "", prefix ? " model" : "Model",
              Printable(world->TokenStr()).c_str(), Printable(token).c_str());
  for (const Model* child : children) child->Print(prefix);
}

const char* Model::PrintWithPose() const {
  static thread_local std::string text;
  const Pose g = GetGlobalPose();
  char numbers[256];
  std::snprintf(numbers, sizeof numbers, " @ [%.2f,%.2f,%.2f,%.2f]", g.x, g.y, g.z, g.a);
  text = token + numbers;
  return text.c_str();
}

bool Model::IsAntecedent(const Model* testmod) const {
  for (const Model* above = parent; above; above = above->parent)
    if (above == testmod) return true;
  return false;
}

bool Model::IsDescendent(const Model* testmod) const {
  return testmod == this || testmod->IsAntecedent(this);
}

void Model::SetRoot(Model* new_root) {
  root = new_root;
  for (Model* child : children) child->SetRoot(new_root);
}

int Model::SetParent(Model* newparent) {
  if (newparent && RefusesParent(*newparent)) return 1;
  const Pose global = GetGlobalPose();
  world->host().family_changes++;
  UnMapWithChildren();
  if (parent)
    parent->RemoveChild(this);
  else
    world->RemoveChild(this);
  parent = newparent;
  if (parent)
    parent->AddChild(this);
  else
    world->AddChild(this);
  SetRoot(parent ? parent->root : this);
  pose = parent ? parent->LocalPoseOf(global) : global;
  pose.a = normalize(pose.a);
  Map();
  if (SurvivesCallbacks(CB_PARENT)) CallCallbacks(CB_POSE);
  return 0;
}

void Model::BecomeParentOf(Model* child) {
  if (child->RefusesParent(*this)) return;
  child->UnMapWithChildren();
  if (child->parent)
    child->parent->RemoveChild(child);
  else
    world->RemoveChild(child);
  child->parent = this;
  AddChild(child);
  child->SetRoot(root);
  child->Map();
}

// ---- pose and geometry --------------------------------------------------------------------------

Pose Model::ChildGlobalPose(const Pose& global, const Model& child) const {
  Pose p = global + child.pose;
  if (stack_children) p.z += geom.size.z;
  return p;
}

Pose Model::GetGlobalPose() const {
  return parent ? parent->ChildGlobalPose(parent->GetGlobalPose(), *this) : pose;
}

void Model::SetPose(const Pose& new_pose) {
  if (!AllFinite(new_pose)) {
    WarnAbout(*this, "refused the pose [%f %f %f %f], which is not finite", new_pose.x, new_pose.y,
              new_pose.z, new_pose.a);
    return;
  }
  if (pose != new_pose) {
    pose = new_pose;
    pose.a = normalize(pose.a);
    Map();
  }
  CallCallbacks(CB_POSE);
}

void Model::SetGlobalPose(const Pose& gpose) {
  SetPose(parent ? parent->LocalPoseOf(gpose) : gpose);
}

/// What the pose of a child is that has a global pose.
Pose Model::LocalPoseOf(const Pose& global) const {
  Pose local = GlobalToLocal(global);
  if (stack_children) local.z -= geom.size.z;
  return local;
}

void Model::AddToPose(const Pose& p) { AddToPose(p.x, p.y, p.z, p.a); }

void Model::AddToPose(double dx, double dy, double dz, double da) {
  SetPose(Pose(pose.x + dx, pose.y + dy, pose.z + dz, pose.a + da));
}

void Model::SetGeom(const Geom& src) {
  if (!AllFinite(src.pose) || !std::isfinite(src.size.x) || !std::isfinite(src.size.y) ||
      !std::isfinite(src.size.z)) {
    WarnAbout(*this, "refused a geometry that is not finite");
    return;
  }
  geom = src;
  blockgroup->Fit(geom.size);
  Map();
  CallCallbacks(CB_GEOM);
}

Pose Model::GlobalToLocal(const Pose& p) const {
  const Pose g = GetGlobalPose();
  const Pose turn(0, 0, 0, -g.a);
  const Pose turned = turn + Pose(p.x - g.x, p.y - g.y, 0, 0);
  return Pose(turned.x, turned.y, p.z - g.z, p.a - g.a);
}

Pose Model::LocalToGlobal(const Pose& p) const { return (GetGlobalPose() + geom.pose) + p; }

point_t Model::LocalToGlobal(const point_t& pt) const {
  const Pose global = LocalToGlobal(Pose(pt.x, pt.y, 0, 0));
  return point_t(global.x, global.y);
}

std::vector<point_int_t> Model::LocalToPixels(const std::vector<point_t>& local) const {
  std::vector<point_int_t> pixels;
  pixels.reserve(local.size());
  for (const point_t& p : local) pixels.push_back(world->MetersToPixels(LocalToGlobal(p)));
  return pixels;
}

void Model::AddBlockRect(meters_t x, meters_t y, meters_t dx, meters_t dy, meters_t dz) {
  if (!AllFinite(Pose(x, y, dz, 0)) || !AllFinite(Pose(dx, dy, 0, 0))) {
    WarnAbout(*this, "refused a block that is not finite");
    return;
  }
  world->host().TraceBatch();
  blockgroup->AddRectangle(x, y, dx, dy, Bounds(0, dz));
}

void Model::ClearBlocks() {
  world->host().TraceBatch();
  blockgroup->Clear();
}

void Model::Map() {
  if (world->host().loading) return;  // all bodies are drawn when everything is loaded
  world->host().TraceBatch();
  Placement& placement = world->host().placement;
  placement.Plan(*this, true);
  placement.Commit();
}

void Model::NoteDrawn() {
  if (is_noted()) return;
  hidden_from_rangers_ = true;
  world->host().hidden_from_rangers.push_back(this);
}

bool Model::ShowAgainToRangers() {
  if (vis.ranger_return < 0) return false;
  hidden_from_rangers_ = false;
  blockgroup->RefreshVisibility(true);
  return true;
}

void Model::UnMapWithChildren() {
  world->host().TraceBatch();
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
      if (!(steps <= 1e6)) continue;  // not a raster that anybody could have made
      for (double s = 0; s <= steps; s += 1.0) {
        const double along = steps > 0 ? s / steps : 0;
        mark(std::floor(from.x + dx * along), std::floor(from.y + dy * along));
      }
    }
  }
  if (!world->IsGUI()) return;
  last_raster_.reset(new Raster{std::vector<uint8_t>(data, data + size_t{width} * height), width,
                                height, cellwidth, cellheight});
}

bool Model::HasCollision() {
  Placement& placement = world->host().placement;
  placement.Plan(*this, true);
  return placement.Collision(world->GetGround()) != nullptr;
}

bool Model::RandomPoseInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                                  size_t max_iter) {
  if (!std::isfinite(xmax - xmin) || !std::isfinite(ymax - ymin)) {
    WarnAbout(*this, "refused to look for a place in a rectangle that is not finite");
    return false;
  }
  const Watch watch(*this);
  SetPose(Pose::Random(random_.Get(), xmin, xmax, ymin, ymax));
  for (size_t i = 0; !watch.gone() && HasCollision(); i++) {
    if (max_iter > 0 && i >= max_iter) return false;
    SetPose(Pose::Random(random_.Get(), xmin, xmax, ymin, ymax));
  }
  return !watch.gone();
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

// What is seen of a model, and how, is that of the time when a sensor updated.
void Model::SetColor(Color col) {
  world->host().TraceBatch();
  color = col;
}

void Model::SetFiducialReturn(int fid) {
  world->host().TraceBatch();
  vis.fiducial_return = fid;
}

void Model::SetFiducialKey(int key) {
  world->host().TraceBatch();
  vis.fiducial_key = key;
}

void Model::SetObstacleReturn(bool val) {
  world->host().TraceBatch();
  vis.obstacle_return = val;
}

void Model::SetBlobReturn(bool val) {
  world->host().TraceBatch();
  vis.blob_return = val;
}

void Model::SetGripperReturn(bool val) {
  world->host().TraceBatch();
  vis.gripper_return = val;
}

void Model::SetRangerReturn(double val) {
  world->host().TraceBatch();
  SetFinite(*this, "ranger_return", val, &vis.ranger_return);
}

void Model::SetMass(kg_t m) { SetNotNegative(*this, "mass", m, &mass); }

void Model::SetWatts(watts_t w) { SetNotNegative(*this, "watts", w, &watts); }

// ---- life cycle ---------------------------------------------------------------------------------

void Model::Subscribe() {
  if (++subs == 1) Startup();
}

void Model::Unsubscribe() {
  if (subs == 0) {
    WarnAbout(*this, "has no subscriber to lose");
    return;
  }
  if (--subs == 0) Shutdown();
}

/// What is pending is void.
void Model::ScheduleUpdate() {
  update_chain_ = UpdateChain::Next(update_chain_);
  world->host().ScheduleUpdate(this, world->SimTimeNow() + interval, update_chain_);
}

void Model::Startup() {
  ScheduleUpdate();
  if (FindPowerPack()) world->host().EnableEnergy(this);
  CallCallbacks(CB_STARTUP);
}

void Model::Shutdown() {
  update_chain_ = UpdateChain::Next(update_chain_);  // what is pending is void
  world->host().DisableEnergy(this);
  StopCharging();
  CallCallbacks(CB_SHUTDOWN);
}

void Model::Update() {
  if (subs == 0) return;
  // What is pending is void: an update that somebody else calls takes its place.
  ScheduleUpdate();
  if (HasCallbacks(CB_UPDATE)) world->host().update_callbacks_due.push_back(this);
}

// ---- callbacks ----------------------------------------------------------------------------------

void Model::AddCallback(callback_type_t t, model_callback_t cb, void* user) {
  AddCallback(Callback{cb, user, t, false});
  serial_update_callbacks_ |= t == CB_UPDATE;
}

void Model::AddParallelCallback(callback_type_t t, model_callback_t cb, void* user) {
  AddCallback(Callback{cb, user, t, true});
}

void Model::Adopt(const std::shared_ptr<void>& data) { adopted_.push_front(data); }

void Model::AddCallback(const Callback& entry) {
  if (!callbacks_) callbacks_ = std::make_shared<Callbacks>();
  std::vector<Callback>& all = callbacks_->all;
  if (std::find(all.begin(), all.end(), entry) == all.end()) all.push_back(entry);
}

int Model::RemoveCallback(callback_type_t t, model_callback_t callback) {
  if (!callbacks_) return 0;
  // During a round entries are only struck out, as somebody is walking along them.
  for (Callback& entry : callbacks_->all)
    if (entry.type == t && entry.function == callback) entry.function = nullptr;
  if (callbacks_->rounds == 0) callbacks_->Tidy();
  return callbacks_->CountLeft(t);
}

int Model::Callbacks::CountLeft(callback_type_t t) const {
  return static_cast<int>(std::count_if(
      all.begin(), all.end(), [t](const Callback& c) { return c.type == t && c.function; }));
}

void Model::Callbacks::Tidy() {
  std::erase_if(all, [](const Callback& c) { return !c.function; });
}

/// While somebody walks along the callbacks, which may throw.
struct Model::Callbacks::Round {
  explicit Round(Callbacks* callbacks) : all(callbacks) { all->rounds++; }
  ~Round() {
    if (--all->rounds == 0) all->Tidy();
  }
  Round(const Round&) = delete;
  Round& operator=(const Round&) = delete;
  Callbacks* all;
};

/// Counts callbacks that run outside of a step: those of a step may run in several threads.
class CallOutsideOfStep {
 public:
  explicit CallOutsideOfStep(World* world) {
    if (world->host().stepping) return;
    host_ = world->ShareHost();
    host_->calls++;
  }
  ~CallOutsideOfStep() {
    if (host_) host_->calls--;
  }
  CallOutsideOfStep(const CallOutsideOfStep&) = delete;
  CallOutsideOfStep& operator=(const CallOutsideOfStep&) = delete;

 private:
  std::shared_ptr<Host> host_;  // a callback may delete the world
};

/// Calls call(entry) for each callback of the type, which returns what that does.
template <typename F>
int Model::CallEach(callback_type_t t, F call) {
  if (!HasCallbacks(t)) return 0;
  // A callback may read what others sensed, and change what they see.
  world->host().TraceBatch();
  // By index, for a callback may add callbacks (called from the next round on), remove any, or
  // delete the model: then the rest is not called and nothing of it is touched any more.
  const std::shared_ptr<Callbacks> callbacks = callbacks_;
  const RandomScope random_numbers(&random_);
  const size_t count = callbacks->all.size();
  const Callbacks::Round round(callbacks.get());
  const CallOutsideOfStep call_outside_of_step(world);
  for (size_t i = 0; i < count && !callbacks->orphaned; i++) {
    const Callback entry = callbacks->all[i];
    if (entry.type != t || !entry.function) continue;
    try {
      if (call(entry) != 0) callbacks->all[i].function = nullptr;
    } catch (...) {
      NoteThrower("a callback", callbacks->orphaned ? nullptr : this,
                  reinterpret_cast<void (*)()>(entry.function));
      throw;
    }
  }
  return callbacks->CountLeft(t);
}

int Model::CallCallbacks(callback_type_t t) {
  return CallEach(t, [this](const Callback& entry) { return entry.function(this, entry.user); });
}

bool Model::SurvivesCallbacks(callback_type_t t) {
  if (!HasCallbacks(t)) return true;
  const std::shared_ptr<Callbacks> callbacks = callbacks_;
  CallCallbacks(t);
  return !callbacks->orphaned;
}

/// What a controller throws becomes a LoadError.
void Model::InitOrThrow() {
  if (!HasCallbacks(CB_INIT)) return;
  const std::string where = wf ? wf->Where(wf_entity, "ctrl") + ": " : "";  // it may be deleted
  const std::string name = token;
  const std::shared_ptr<Host> host = world->ShareHost();
  CallEach(CB_INIT, [&](const Callback& entry) {
    try {
      return entry.function(this, entry.user);
    } catch (...) {
      throw LoadError(where + host->DescribeInitFailure(name, entry.user), 255);
    }
  });
}

// ---- sensing ------------------------------------------------------------------------------------

/// By the name, unless another model has had it.
uint64_t Model::NoiseSeed(const std::string& device) const {
  const uint64_t seed = world->seed() ^ HashOf(device);
  return shares_name_ ? MixSeeds(seed, random_.seed()) : seed;
}

void Model::PlaceFan(sensing::Fan* fan, const Pose& origin, meters_t range, RayModel model) {
  fan->exact = world->IsExact(model);
  if (fan->exact) world->DrawForExactRays();
  sensing::PlaceFan(fan, origin, range, scene_->cells_per_metre);
  fan->layer = scene_->grid.EverythingLayer(fan->exact);
}

void Model::CollectDrawings(grid::Drawings* drawings, bool exact) const {
  blockgroup->AppendDrawings(drawings, exact);
  for (const Model* child : children) child->CollectDrawings(drawings, exact);
}

sensing::BatchShare Model::MeasureRoom(sensing::FanList* fans, WindowsToMake* windows) {
  const size_t first = fans->size();
  Gather(fans);
  sensing::BatchShare share;
  for (const sensing::FanList::Entry& listed : fans->From(first)) {
    share += listed;
    if (listed.past_own_tree) share.words += windows->Plan(*this, listed.fan.exact);
  }
  return share;
}

bool Model::FillRoom(sensing::BatchShare room, const sensing::FanList& fans, size_t first_fan,
                     size_t count) {
  bool layers_found = true;
  for (const sensing::FanList::Entry& listed : fans.From(first_fan).first(count)) {
    const sensing::Fan& fan = listed.fan;
    scene_->batch.Put(
        room, fans, listed,
        listed.past_own_tree ? root->windows_->of[fan.exact].window : sensing::Window());
    layers_found &= fan.layer != grid::kNoLayer;
    room += listed;
  }
  return layers_found;
}

void Model::GatherAlone() {
  sensing::Scene& shared = *scene_;
  const unsigned wants = GetReady();
  if (wants & kExactRays) world->DrawForExactRays();
  if (wants & kPartsThatLack) FinishGettingReady();
  shared.fans.Clear();
  WindowsToMake windows;
  const sensing::BatchShare share = MeasureRoom(&shared.fans, &windows);
  if (share.fans == 0) return;
  const sensing::BatchShare room = shared.batch.AddRoom(share);
  windows.Place(*this, room.words);
  windows.Fill(*this);
  if (!FillRoom(room, shared.fans, 0, shared.fans.size())) shared.MakeLayers(room.fans, this);
}

const grid::Drawings& Model::OwnDrawings(bool exact) const {
  static thread_local grid::Drawings drawings;  // for its memory
  drawings.of_bodies.clear();
  CollectDrawings(&drawings, exact);
  return drawings;
}

}  // namespace Stg
