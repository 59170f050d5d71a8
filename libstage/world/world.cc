// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/world.hh"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <mutex>
#include <new>
#include <unordered_set>
#include <utility>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/log_entry.hh"
#include "models/model_type_names.hh"
#include "models/position.hh"
#include "models/power_pack.hh"
#include "models/warn_about.hh"
#include "world/engine.hh"
#include "world/restorer.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

std::vector<std::string> World::args;
std::string World::ctrlargs;
RunOptions World::run_options;
std::atomic<bool> World::quit_all_{false};
std::vector<World*> World::worlds_;

namespace {
/// Guards World::worlds_ and AllWorlds(): several threads may create and delete worlds at the same
/// time. Steps of a world never lock it.
std::mutex worlds_mutex;

/// All worlds of the process, listed or not. Never destroyed: worlds may end at any time.
std::unordered_set<const World*>& AllWorlds() {
  static auto& all = *new std::unordered_set<const World*>;
  return all;
}

/// Locks the list of models of a listed world, which FindModelOfAny() reads from any thread. Other
/// worlds need no lock.
std::unique_lock<std::mutex> LockModels(std::mutex* mutex, bool listed) {
  return listed ? std::unique_lock<std::mutex>(*mutex) : std::unique_lock<std::mutex>();
}

double UsablePpm(double ppm) {
  if (ppm > 0 && std::isfinite(ppm)) return ppm;
  messages::Warn("found a number of cells per metre that is not positive; using " +
                 std::to_string(World::DEFAULT_PPM));
  return World::DEFAULT_PPM;
}
}  // namespace

World::World(const std::string& name, double ppm) : World(run_options, name, ppm) {}

World::World(const RunOptions& options, const std::string& name, double ppm)
    : WorldBase(options.seed),
      paused(false),
      record_trails(false),
      engine_(std::make_shared<WorldEngine>()),
      options_(options),
      default_ppm_(UsablePpm(ppm)),
      load_status_(0),
      simulated_before_(0),
      quit_(false) {
  host_ = engine_.get();
  host_->listed = options_.listed;
  host_->loads_controllers = options_.controllers;
  host_->pictures = options_.pictures;
  token = name;
  InitIfNotDone();
  SetDefaults();
  engine_->SetThreads(static_cast<unsigned>(std::max(1, options_.threads)));
  engine_->ShareFrom(options_.share_from);
  {
    const std::lock_guard<std::mutex> lock(worlds_mutex);
    AllWorlds().insert(this);
    if (options_.listed) worlds_.push_back(this);
  }
  MakeGround();
}

void World::UseThreadsAndDeviceOf(const World& other) {
  options_.threads = static_cast<int>(other.engine_->threads());
  engine_->ShareThreadsOf(*other.engine_);
  UseDeviceOf(other);
}

void World::UseDeviceOf(const World& other) {
  options_.opencl = other.options_.opencl;
  options_.always_on_device = other.options_.always_on_device;
  options_.device = other.options_.device;
  engine_->tracer.SharePrefilterOf(other.engine_->tracer, options_.always_on_device);
}

void World::Reseed(uint64_t seed) {
  options_.seed = seed;
  random_.Restart(seed);
  for (Model* model : engine_->models) model->Reseed(seed);
}

/// Sets the defaults of world properties.
void World::SetDefaults() {
  sim_interval = 100000;
  speedup = 0;
  sim_time = 0;
  updates = 0;
  quit_time = 0;
  show_clock = false;
  show_clock_interval = 100;
  engine_->scene.cells_per_metre = default_ppm_;
  engine_->scene.ray_model = RayModel::kCell;
  engine_->contact_model = ContactModel::kOutlines;
  engine_->scene.exact_rasterization = false;
  ApplyRunOptions();
}

World::~World() {
  {
    const std::lock_guard<std::mutex> lock(worlds_mutex);
    AllWorlds().erase(this);
    if (options_.listed) std::erase(worlds_, this);
  }
  engine_->world_deleted = true;
  ground = nullptr;
  ForgetAll();
  engine_->scene.BeginTeardown();
  DeleteChildren();
}

bool World::Exists(const World* world) {
  const std::lock_guard<std::mutex> lock(worlds_mutex);
  return AllWorlds().contains(world);
}

std::vector<World*> World::ListedWorlds() {
  const std::lock_guard<std::mutex> lock(worlds_mutex);
  return worlds_;
}

void World::MakeGround() {
  ground = new Model(this, nullptr, "model");
  ground->SetToken("_ground_model");
  ground->ClearBlocks();
  ground->has_default_block = false;
  ground->SetGuiMove(false);
}

/// Drops references to models first, so that deleting the models finds nothing to search.
void World::ForgetAll() {
  engine_->epoch++;
  engine_->loading = false;
  engine_->memory.End();
  engine_->made.clear();
  engine_->outlines_of_pictures.clear();
  engine_->samples_of_pictures.clear();
  engine_->populations.reset();
  engine_->image.reset();
  engine_->names.Clear();
  engine_->scheduler.Clear();
  engine_->spare_flags.clear();
  engine_->TraceBatchAndPostponeThrowing();
  engine_->fiducials->Clear();
  engine_->traffic->Clear();
  engine_->sensed.clear();
  engine_->update_callbacks_due.clear();
  engine_->hidden_from_rangers.clear();
  engine_->due.clear();
  engine_->calls_after_step.clear();
  engine_->energy.clear();
  engine_->metrics.Clear();
  // The entries are not erased, because one of these callbacks may have called this function.
  for (WorldEngine::UpdateCallback& entry : engine_->update_callbacks) entry.function = nullptr;
}

void World::UnLoad() {
  simulated_before_ += sim_time;
  DeleteAll();
  token = "[unloaded]";
  MakeGround();
}

void World::DeleteAll() {
  ground = nullptr;
  ForgetAll();
  DeleteChildren();
  STAGE_ASSERT(engine_->models.empty() && engine_->moving.empty());
  if (!engine_->scene.tearing_down) {  // otherwise the grid is dropped as a whole
    grid::Grid& grid = engine_->scene.grid;
    STAGE_ASSERT(grid.rasterized_cells() == grid.pretended_cells());
    grid.ForgetExtent();
  }
  engine_->scheduler.Clear();  // drops events of deleted models
  engine_->max_dissipation = 0;
  log_.clear();
  engine_->energy_totals = EnergyTotals();
  child_type_counts.clear();
  ray_list.clear();
  wf.reset();
  quit_ = false;
  SetDefaults();
  random_.Restart();
}

bool World::Save(const char* filename) {
  if (!wf || RefusesToWrite("saved")) return false;
  const std::shared_ptr<WorldEngine> engine = engine_;
  const uint64_t epoch = engine->epoch;
  const std::string target = filename ? filename : "";
  const ScopedValue writing(&engine->writing, true);
  engine->ForEachModel([](Model* model) { model->Save(); });
  if (engine->epoch != epoch) return engine->ReportWorldLost("saved");
  return wf->Save(target);
}

Worldfile* World::GetWorldFile() { return wf.get(); }

// ---- models -------------------------------------------------------------------------------------

void World::AddModel(Model* mod) {
  STAGE_ASSERT(mod->world == this && !engine_->FindModel(mod->id));
  engine_->topology_version++;
  {
    const std::unique_lock<std::mutex> lock = LockModels(&engine_->models_mutex, options_.listed);
    Host::Insert(&engine_->models, mod);  // last, unless a snapshot restores it
  }
  AddModelName(mod, mod->TokenStr());
}

void World::AddModelName(Model* mod, const std::string& name) { mod->RegisterName(name); }

void World::RemoveModel(Model* mod) {
  DeletionWatch::Notify(&engine_->watches, mod);
  std::vector<Model*>& made = engine_->made;
  const size_t entity = static_cast<size_t>(mod->wf_entity);
  if (entity < made.size() && made[entity] == mod) made[entity] = nullptr;
  {
    const std::unique_lock<std::mutex> lock = LockModels(&engine_->models_mutex, options_.listed);
    engine_->Forget(mod);
  }
  if (mod == ground) ReplaceGround(mod->GetId());
}

/// Recreates the ground with the same id, place and seed after a client or plug-in has deleted it.
void World::ReplaceGround(uint32_t id) {
  messages::Report(LogLevel::kError,
                   "stage: found the ground deleted, expected it to stay as long as its world; it "
                   "has been recreated");
  ground = nullptr;
  const uint32_t next = std::exchange(engine_->next_model_id, id);
  auto counts = std::exchange(child_type_counts, {});
  try {
    MakeGround();
    ground->blockgroup->Fit(ground->geom.size);  // as loading does with all models
    std::rotate(children.begin(), children.end() - 1, children.end());
  } catch (const std::bad_alloc&) {
    // The world has no ground then, as while unloaded: a destructor must not throw.
  }
  engine_->next_model_id = next;
  child_type_counts = std::move(counts);
}

Model* World::GetModel(const std::string& name) const { return engine_->GetModel(name); }

const std::set<Model*> World::GetAllModels() const {
  return std::set<Model*>(engine_->models.begin(), engine_->models.end());
}

Model* World::CreateModel(Model* parent, const std::string& typestr) {
  const creator_t create = FindCreator(typestr);
  if (!create && !parent && wf && wf->HasMacro(typestr)) return Restorer(this).MakeMacro(typestr);
  if (!create) {
    messages::Warn("model type " + messages::Quoted(typestr) + " is not known");
    return nullptr;
  }
  if (parent && parent->Depth() >= Model::kMaxDepth) {
    WarnAbout(*this, "found a model to be nested more than %u deep; it is not made",
              Model::kMaxDepth);
    return nullptr;
  }
  Model* const model = engine_->Make(this, parent, typestr, create);
  if (!model)
    messages::Warn("a model of type " + messages::Quoted(typestr) +
                   " was deleted while it was being made: its type may delete neither itself nor "
                   "its parent there");
  if (model && !engine_->loading) model->Map();
  return model;
}

std::vector<NamedMetric> World::Metrics() const { return engine_->metrics.Values(); }

void World::SetMetric(const std::string& name, double value) { engine_->metrics.Set(name, value); }

Model* World::FindModel(uint32_t id) const { return engine_->FindModel(id); }

WorldBase& BaseOf(World& world) { return world; }

Model* FindModelOfAnyWorld(uint32_t id) { return World::FindModelOfAny(id); }

Model* World::FindModelOfAny(uint32_t id) {
  const std::lock_guard<std::mutex> lock(worlds_mutex);
  for (const World* world : worlds_) {
    const std::lock_guard<std::mutex> models_lock(world->engine_->models_mutex);
    if (Model* found = world->FindModel(id)) return found;
  }
  return nullptr;
}

void World::Log(Model* mod) {
  if (mod) log_.push_back(LogEntry(sim_time, mod));
}

void World::RegisterOption(Option* option) {
  if (std::find(option_table.begin(), option_table.end(), option) == option_table.end())
    option_table.push_back(option);
}

void World::RecordRay(double x1, double y1, double x2, double y2) {
  RecordLine(x1, y1, x2, y2, Color(0, 0, 0));
}

void World::RecordLine(double x1, double y1, double x2, double y2, const Color& color) {
  if (IsGUI()) ray_list.push_back({x1, y1, x2, y2, color});
}

void World::EnableEnergy(Model* mod) { engine_->EnableEnergy(mod); }
void World::DisableEnergy(Model* mod) { engine_->DisableEnergy(mod); }
const EnergyTotals& World::energy_totals() const { return engine_->energy_totals; }
void World::AddPowerPack(PowerPack*) { engine_->power_packs++; }
void World::RemovePowerPack(PowerPack*) { engine_->power_packs--; }

// ---- geometry and rays --------------------------------------------------------------------------

double World::Resolution() const { return engine_->scene.cells_per_metre; }

const bounds3d_t& World::GetExtent() const { return extent = engine_->scene.Extent(); }

RayModel World::GetRayModel() const { return engine_->scene.ray_model; }

void World::SetRayModel(RayModel model) {
  if (model != RayModel::kDefault) engine_->scene.ray_model = model;
}

ContactModel World::GetContactModel() const { return engine_->contact_model; }

void World::SetContactModel(ContactModel model) {
  if (model == ContactModel::kDefault) return;
  engine_->contact_model = model;
  engine_->contacts_changed = true;
}

void World::ForEachContact(const std::function<void(const ContactPoint&)>& f) const {
  engine_->ForEachContact(nullptr, f);
}

bool World::IsExact(RayModel model) const { return engine_->IsExact(model); }

void World::RasterizeForExactRays() { engine_->RasterizeForExactRays(); }

int32_t World::MetersToPixels(meters_t x) const { return engine_->MetersToPixels(x); }

point_int_t World::MetersToPixels(const point_t& pt) const {
  return point_int_t(MetersToPixels(pt.x), MetersToPixels(pt.y));
}

RaytraceResult World::ResultOf(const Pose& origin, double range, Model* hit) const {
  return RaytraceResult(origin, hit, hit ? hit->GetColor() : Color(), range);
}

RaytraceResult World::Raytrace(const Ray& ray) {
  return Raytrace(ray.origin, ray.range, ray.func, ray.mod, ray.arg, ray.ztest);
}

RaytraceResult World::Raytrace(const Pose& pose, const meters_t range, const ray_test_func_t func,
                               const Model* finder, const void* arg, const bool ztest) {
  std::vector<RaytraceResult> results(1);
  Raytrace(pose, range, 0.0, func, finder, arg, ztest, results);
  return results[0];
}

void World::Raytrace(const Pose& gpose, const meters_t range, const radians_t fov,
                     const ray_test_func_t func, const Model* finder, const void* arg,
                     const bool ztest, std::vector<RaytraceResult>& results) {
  sensing::Fan fan;
  fan.predicate = func;
  fan.finder = finder;
  fan.arg = arg;
  fan.z_test = ztest;
  fan.exact = IsExact(RayModel::kDefault);
  if (fan.exact) RasterizeForExactRays();
  sensing::PlaceFan(&fan, gpose, range, Resolution());

  // A client's predicate may accept any body: uses the layer of everything and no self-mask.
  grid::Grid& grid = engine_->scene.grid;
  const sensing::Tracer tracer(grid);
  const ray_grid_t view = grid.View(grid.EverythingLayer(fan.exact));
  const ray_mask_t no_mask{nullptr, 0, 0, 0, 0};
  sensing::TraceCounters counters;
  const uint32_t count = static_cast<uint32_t>(results.size());
  for (uint32_t i = 0; i < count; i++) {
    const SineCosine unit_vector = sensing::UnitVectorOf(sensing::SampleBearing(fov, count, i));
    const sensing::RayHit hit = tracer.Trace(
        fan, view, {sensing::MakeDirection(unit_vector), unit_vector}, no_mask, &counters);
    results[i] = ResultOf(gpose, hit.range, hit.model);
  }
}

RunStatistics World::statistics() const { return engine_->Statistics(); }

}  // namespace Stg
