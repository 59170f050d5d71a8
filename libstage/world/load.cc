// SPDX-License-Identifier: GPL-2.0-or-later
//
// Loads worlds from world files.

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <utility>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/exception_origin.hh"
#include "models/model_choices.hh"
#include "models/model_type_names.hh"
#include "models/placement.hh"
#include "models/ranger.hh"
#include "threads/processors.hh"
#include "world/engine.hh"
#include "world/load_checks.hh"
#include "world/plugin.hh"
#include "world/populate.hh"
#include "world/prefilter_loader.hh"
#include "world/window_properties.hh"
#include "world/world.hh"
#include "world/world_image.hh"
#include "worldfile/old_names.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

/// Limits of the cell size, metres: beyond them, no realistic body spans a useful number of cells.
constexpr double kMinCellSize = 1e-6, kMaxCellSize = 1e6;

constexpr int kMaxThreads = 1024;

/// Maximum depth of worlds loaded by Init() functions of controllers of other worlds.
constexpr unsigned int kMaxNestedLoads = 20;

std::string UnknownType(const std::string& type) {
  std::string known;
  for (const std::string& name : ModelTypeNames()) known += name + ", ";
  const std::string advice = worldfile::AdviceOnType(type);
  return "found " + messages::Quoted(type) + ", expected a model type (" + known +
         "block, sensor, window) or the name of a definition" +
         (advice.empty() ? "" : "; " + advice);
}

std::string DeletedTooSoon(const std::string& type) {
  return "found a model of type " + messages::Quoted(type) +
         " that was deleted while it was being made, expected a type that deletes neither itself "
         "nor its parent there";
}

constexpr size_t kMaxPlugins = 100;

/// Opens the plug-ins named by the world file, for their model types. If not `wanted`, opens none
/// and returns how many there are.
size_t LoadPlugins(Worldfile* wf, bool wanted) {
  wf->ReadElement(0, "plugins", 0);  // an empty list counts as read too
  const size_t count = wf->TupleLength(0, "plugins");
  if (count > kMaxPlugins)
    wf->Fail(0, "plugins",
             "found " + std::to_string(count) + " plug-ins, expected at most " +
                 std::to_string(kMaxPlugins));
  for (size_t i = 0; wanted && i < count; i++) {
    const std::string name = wf->ReadElement(0, "plugins", i);
    std::string error = "the name is empty";
    if (name.empty() || !OpenPlugin(name, &error))
      throw LoadError(
          wf->Where(0, "plugins") + ": plug-in " + messages::Quoted(name) +
              " can't be loaded: " + messages::Shortened(error, messages::kMaxDetailBytes),
          255);
  }
  return wanted ? 0 : count;
}

/// Converts a value to microseconds, truncated; `factor` is the length of its unit in microseconds.
/// Returns 0 if the result is below one or overflows.
usec_t Microseconds(double value, double factor) {
  // Rounding guard: 1.001 * 1000 is slightly below 1001 and must still become 1001.
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  const double us = value * factor * (1 + kRounding);
  return us >= 1 && us < 1.8e19 ? static_cast<usec_t>(us) : 0;
}

std::unique_ptr<sensing::Prefilter> ChoosePrefilter(const RunOptions& options) {
  if (!options.opencl) return nullptr;
  if (options.device.size() > messages::kMaxDetailBytes)  // the plug-in would print it all
    throw LoadError("stage: no OpenCL device matches " + messages::Quoted(options.device));
  std::string message;
  std::unique_ptr<sensing::Prefilter> prefilter =
      LoadPrefilter(kOpenClPlugin, options.device, &message);
  if (prefilter) return prefilter;
  if (!options.device.empty() && options.device != "auto") throw LoadError("stage: " + message);
  messages::Warn(message + "; continuing without OpenCL; the results are the same");
  return nullptr;
}

}  // namespace

/// Describes where a world is loaded from.
struct World::Source {
  std::string path;                                   // may be empty
  std::istream* content;                              // null: read the file at `path`
  std::unique_ptr<Worldfile> read;                    // the file, if it has been parsed already
  std::shared_ptr<const WorldImage> image = nullptr;  // if the world is a copy: the image to copy
};

bool World::Load(const std::string& worldfile_path) {
  messages::Progress("[Loading " + worldfile_path + "]");
  return LoadFrom({worldfile_path, nullptr, nullptr});
}

bool World::Load(std::istream& world_content, const std::string& worldfile_path) {
  messages::Progress("[Loading from stream]");
  return LoadFrom({worldfile_path, &world_content, nullptr});
}

bool World::LoadCopy(const World& other) {
  const std::shared_ptr<const WorldImage> image = other.Image();
  return image && LoadCopy(image);
}

bool World::LoadCopy(const std::shared_ptr<const WorldImage>& image) {
  return LoadFrom({image->path, nullptr, image->file->Copy(), image});
}

bool World::Reset(uint64_t seed) {
  if (!wf || !engine_->IsIdle()) {
    messages::Report(LogLevel::kError, wf ? "stage: a world can't be reset by a callback"
                                          : "stage: a world can't be reset before it is loaded");
    return false;
  }
  if (wf->GetEntityCount() > wf->GetWrittenCount()) {
    wf->RemoveAdded(wf->GetWrittenCount());
    engine_->image.reset();  // it has them too
  }
  std::shared_ptr<const WorldImage> image = Image();
  Source source{path_, nullptr, std::move(wf), std::move(image)};
  source.read->ForgetWritten();
  engine_->scene.BeginTeardown();
  DeleteAll();
  engine_->scene.Return();
  options_.seed = seed;
  random_.Restart(seed);
  simulated_before_ = 0;
  engine_->next_model_id = 0;
  MakeGround();
  return LoadFrom(std::move(source));
}

bool World::LoadFrom(Source source) {
  // A controller may delete the world, load another one, or load this one again.
  const std::shared_ptr<WorldEngine> engine = engine_;
  messages::Collector collector;
  const bool loaded = LoadNow(*engine, std::move(source));
  if (!engine->world_deleted) load_messages_ = std::move(collector.lines);
  return loaded;
}

bool World::LoadNow(WorldEngine& engine, Source source) {
  if (engine.IsIdle()) {
    engine.RunDeferredDeletes();
    if (wf) UnLoad();
    engine.controller_arguments.clear();  // no running controller uses them
    engine.batch_arguments.clear();
  }
  const ScopedValue loads(&engine.loads, engine.loads + 1);
  if (engine.loads > kMaxNestedLoads) return RefuseToNest();
  const double start = WallClock();
  if (wf) UnLoad();
  if (!ground) MakeGround();  // memory did not suffice for it at the last unload
  sim_time = 0;
  updates = 0;
  load_status_ = 0;
  engine.statistics = RunStatistics();
  engine.tracer.SetStatistics({});
  engine.controllers_left_out = 0;
  engine.load_warnings.clear();
  const RandomScope random_numbers(&random_);
  const uint64_t epoch = engine.epoch;
  const bool is_copy = source.image != nullptr;
  ClearExceptionOrigin();
  try {
    LoadContent(std::move(source));
    if (!engine.world_deleted && engine.epoch == epoch) wf->CheckSettings();
  } catch (const LoadError& error) {
    return FailToLoad(engine, error.what(), error.exit_status());
  } catch (const std::bad_alloc&) {
    if (!engine.world_deleted) UnLoad();
    throw;
  } catch (...) {  // thrown by a callback
    return FailToLoad(engine, "stage: " + DescribeThrown() + " while a world was being loaded",
                      255);
  }
  if (engine.world_deleted) return engine.ReportWorldLost("loaded");
  if (engine.epoch != epoch) return AfterEpochChanged();
  ApplyRunOptions();
  if (!is_copy) wf->WarnUnused();
  engine.statistics.load_seconds = WallClock() - start;
  return true;
}

bool World::FailToLoad(const WorldEngine& engine, const std::string& message, int status) {
  messages::Report(LogLevel::kError, message);
  ClearExceptionOrigin();
  if (engine.world_deleted) return false;
  UnLoad();
  load_status_ = status;
  return false;
}

/// Reads a world file and creates its models.
void World::LoadContent(Source source) {
  path_ = source.path;
  const bool is_read = source.read != nullptr;
  wf = is_read ? std::move(source.read) : std::make_unique<Worldfile>();
  if (!is_read) wf->Set(options_.settings);
  if (source.content)
    wf->Load(*source.content, path_);
  else if (!is_read)
    wf->Load(path_);
  SetToken(wf->ReadString(0, "name", path_.empty() ? "[stream]" : path_));
  LoadWorldProperties();
  UsePrefilter();
  engine_->plugins_left_out = LoadPlugins(wf.get(), options_.controllers);
  if (source.image) {
    engine_->outlines_of_pictures = source.image->outlines;
    engine_->samples_of_pictures = source.image->samples;
    engine_->populations = source.image->populations;
  }
  if (!LoadEntities()) return;
  CheckFieldNames(*engine_, engine_->made, *wf);
  engine_->metrics.Load(this, wf.get(), engine_->made);
  // The models of an image have been checked already.
  if (!source.image) CheckOutlines(engine_->made);
  engine_->made.clear();
  LoadWindowSection();
  engine_->memory.End();
  if (source.image)
    RasterizeFromImage(*source.image);
  else
    RasterizeAll();
  engine_->extent_of_loading = engine_->scene.grid.extent();
  engine_->image = source.image;
  for (Model* model : engine_->models)
    if (model->wf_entity > 0) model->blockgroup->NoteLoaded();
  // The original has already reported the doubts about a copy.
  if (!source.image) LoadChecks(this).Run();
  InitControllers();  // may delete the world
}

void World::RasterizeAll() {
  for (Model* child : children) child->Map();
  MarkAllRasterized();
}

/// Init functions may delete and add models. Added models are not initialized here.
void World::InitControllers() {
  if (engine_->controllers_left_out > 0 && !engine_->image)  // copies do not warn again
    messages::Warn("controllers ignored as requested: " +
                   std::to_string(engine_->controllers_left_out));
  engine_->ForEachModel([](Model* model) { model->InitOrThrow(); });
}

bool World::RefuseToNest() {
  messages::Report(LogLevel::kError, "stage: found " + std::to_string(kMaxNestedLoads) +
                                         " nested loads of worlds, expected fewer");
  load_status_ = 1;
  return false;
}

/// Result of Load() if a callback has replaced or deleted the world.
bool World::AfterEpochChanged() {
  if (wf) return true;
  if (load_status_ == 0) load_status_ = 1;
  return engine_->ReportWorldLost("loaded");
}

bool World::RefusesToWrite(const char* what) const {
  if (!engine_->loading && !engine_->writing) return false;
  messages::Report(LogLevel::kError,
                   std::string("stage: a world can't be ") + what + " while it is " +
                       (engine_->loading ? "being loaded" : "being reloaded or saved"));
  return true;
}

/// Applies the options that override the file and its controllers.
void World::ApplyRunOptions() {
  if (options_.clock) show_clock = true;
  if (options_.duration > simulated_before_)
    quit_time = options_.duration - simulated_before_;
  else if (options_.duration > 0)
    Quit();
}

void World::Reload() {
  if (!wf || RefusesToWrite("reloaded")) return;
  const std::shared_ptr<WorldEngine> engine = engine_;
  const ScopedValue writing(&engine->writing, true);
  try {
    engine->ForEachModel([](Model* model) {
      const RandomScope random_numbers(&model->random_);
      model->Load();
    });
  } catch (const LoadError& error) {
    messages::Report(LogLevel::kError, error.what());
  }
}

void World::UsePrefilter() {
  // A world that is loaded again keeps its device.
  bool found = engine_->tracer.KeepPrefilter(options_.always_on_device);
  if (!found) {
    std::unique_ptr<sensing::Prefilter> prefilter = ChoosePrefilter(options_);
    found = prefilter != nullptr;
    engine_->tracer.SetPrefilter(std::move(prefilter), options_.always_on_device);
  }
  if (options_.threads > 0 || wf->PropertyExists(0, "threads")) return;
  if (!found && engine_->chooses_threads()) return;  // chosen by an earlier load
  const unsigned processors = threads::CountUsableProcessors();
  // The host's remaining work is short and limited by memory bandwidth, so more threads than this
  // do not help.
  constexpr unsigned kMaxUsefulThreads = 16;
  if (found)
    engine_->SetThreads(std::min(processors, kMaxUsefulThreads));
  else
    engine_->ChooseThreads(std::min(processors, static_cast<unsigned>(kMaxThreads)));
}

void World::LoadWorldProperties() {
  const auto positive = [this](const char* name, double value) {
    const double read = wf->ReadFloat(0, name, value);
    if (!(read > 0))
      wf->Fail(0, name, "found a value that is not positive, expected one greater than 0");
    return read;
  };
  sim_interval =
      Microseconds(positive("interval_sim", static_cast<double>(sim_interval) / 1000.0), 1e3);
  if (sim_interval == 0)
    wf->Fail(0, "interval_sim",
             "found a step outside the valid range, expected 0.001 to 1.8e16 (ms)");
  quit_time = Microseconds(wf->ReadFloat(0, "quit_time", 0), 1e6);
  if (wf->PropertyExists(0, "resolution")) {
    const double cell = positive("resolution", 0.02);
    if (cell < kMinCellSize || cell > kMaxCellSize)
      wf->Fail(0, "resolution",
               "found cells that are too small or too large, expected 1e-6 to 1e6 (m)");
    engine_->scene.cells_per_metre = 1.0 / cell;
  }
  const double megabytes = wf->ReadFloat(0, "memory_limit", MemoryBudget::kUsualMegabytes);
  if (megabytes != 0 && megabytes < 1)
    wf->Fail(0, "memory_limit", "found less than 1 MB, expected 1 or more, or 0: no limit");
  engine_->memory.Begin(megabytes);
  SetRayModel(ReadRayModel(wf.get(), 0, RayModel::kDefault));
  SetRayModel(options_.ray_model);
  SetContactModel(ReadContactModel(wf.get()));
  SetContactModel(options_.contacts);
  show_clock = wf->ReadInt(0, "show_clock", show_clock);
  const int every = wf->ReadInt(0, "show_clock_interval", static_cast<int>(show_clock_interval));
  if (every < 1) wf->Warn(0, "show_clock_interval", "found fewer than 1 step; using 1");
  show_clock_interval = every < 1 ? 1 : static_cast<unsigned>(every);
  speedup = wf->PropertyExists(0, "speedup") ? wf->ReadFloat(0, "speedup", 0) : 0;
  wf->ReadInt(0, "paused", 0);           // read by the window; read here
  wf->ReadInt(0, "confirm_on_quit", 1);  // so that they count as known
  wf->ReadInt(0, "test", 0);

  int threads = wf->ReadInt(0, "threads", 1);
  if (threads < 1) {
    wf->Warn(0, "threads", "found fewer than 1 thread; using 1");
    threads = 1;
  }
  if (threads > kMaxThreads) {
    wf->Warn(0, "threads", "found more than 1024 threads; using 1024");
    threads = kMaxThreads;
  }
  if (threads > 1) messages::Progress("[threads " + std::to_string(threads) + "]");
  const bool threads_given = options_.threads > 0 || wf->PropertyExists(0, "threads");
  if (options_.threads > 0) threads = options_.threads;
  if (threads_given)  // otherwise UsePrefilter() chooses
    engine_->SetThreads(static_cast<unsigned>(std::min(threads, kMaxThreads)));
  engine_->ShareFrom(options_.share_from);
}

/// Creates all models. Returns false if a callback has unloaded or deleted the world.
bool World::LoadEntities() {
  const std::shared_ptr<WorldEngine> engine = engine_;
  const uint64_t epoch = engine->epoch;
  const ScopedValue loading(&engine->loading, true);
  const int count = wf->GetWrittenCount();  // a snapshot makes those that have been added
  engine->made.assign(static_cast<size_t>(count), nullptr);
  for (int entity = 1; entity < count && engine->epoch == epoch; entity++) LoadEntity(entity);
  if (engine->epoch != epoch) return false;
  // The models' local frames are final only now.
  for (Model* model : engine->models) {
    model->blockgroup->FillHeights();
    model->blockgroup->Fit(model->geom.size);
  }
  const auto of_image = std::move(engine->populations);
  engine->populations =
      PlacePopulations(engine->models, engine->made, wf.get(), 1 / engine->scene.cells_per_metre,
                       options_.seed, of_image ? of_image->floor : nullptr);
  return true;
}

/// Limits the number of outline cells, each of which takes memory and time. The area of a body is
/// not limited.
void World::CheckOutlines(const std::vector<Model*>& models) {
  double cells = 0, max_cells = kMaxCells;
  for (size_t entity = 1; entity < models.size(); entity++) {
    if (!models[entity]) continue;
    engine_->placement.Propose(*models[entity], false);
    cells += engine_->placement.CountCells();
    max_cells += kMaxCellsPerModel;
    if (cells > max_cells)
      wf->Fail(static_cast<int>(entity), "size",
               "found bodies whose outlines cross more than " +
                   std::to_string(std::llround(max_cells)) +
                   " cells of the grid, expected smaller bodies or a coarser resolution");
  }
}

void World::CheckNotNested(int entity, Model* parent_model) {
  const int above = wf->GetEntityParent(entity);
  const std::string parent_type = above > 0 ? wf->GetEntityType(above) : "";
  const std::string type = wf->GetEntityType(entity);
  if (parent_type == "block" || parent_type == "sensor")
    wf->Fail(
        entity, "",
        "found " + messages::Quoted(type) + " inside a " + parent_type + ", expected properties");
  if (parent_type == "window" && type != "block" && type != "sensor")
    wf->Warn(entity, "",
             "found " + messages::Quoted(type) +
                 " inside a window, expected it outside; read as if it were outside");
  if (type == "block" && !parent_model)
    wf->Fail(entity, "", "found a block outside of any model, expected it inside the body of one");
  if (type == "sensor" && !dynamic_cast<ModelRanger*>(parent_model))
    wf->Fail(entity, "",
             "found a sensor outside of any ranger, expected it inside the body of one");
}

void World::LoadEntity(int entity) {
  const std::string type = wf->GetEntityType(entity);
  const int above = wf->GetEntityParent(entity);
  std::vector<Model*>& made = engine_->made;
  Model* parent_model = above > 0 ? made[static_cast<size_t>(above)] : nullptr;
  if (!parent_model && above > 0 && FindCreator(wf->GetEntityType(above)))
    return;  // a callback has deleted the parent
  CheckNotNested(entity, parent_model);

  if (type == "population" || type == "metric") {
    // Members of a population are separate entities; metrics are loaded after all models.
  } else if (type == "window") {
    for (const std::string_view property : kWindowProperties) {
      wf->ReadString(entity, property.data(), "");
      wf->TupleLength(entity, property.data());  // the window checks the number of values
    }
  } else if (type == "block" && parent_model) {
    parent_model->LoadBlock(wf.get(), entity);
  } else if (type == "sensor" && parent_model) {
    const RandomScope random_numbers(&parent_model->random_);
    static_cast<ModelRanger*>(parent_model)->LoadSensor(wf.get(), entity);
  } else {
    const creator_t create = FindCreator(type);
    if (!create)
      wf->Fail(entity, "",
               UnknownType(type) + (engine_->plugins_left_out > 0
                                        ? "; the world's plug-ins are ignored as requested"
                                        : ""));
    Model* const model = engine_->Make(this, parent_model, type, create);
    if (!model) wf->Fail(entity, "", DeletedTooSoon(type));
    made[static_cast<size_t>(entity)] = model;
    model->Load(wf.get(), entity);
  }
}

}  // namespace Stg
