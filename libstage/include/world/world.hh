// SPDX-License-Identifier: GPL-2.0-or-later
//
// World: models, a clock, and the steps that advance them. Part of <stage.hh>.

#ifndef STAGE_WORLD_WORLD_HH
#define STAGE_WORLD_WORLD_HH

#include <atomic>
#include <functional>
#include <iosfwd>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "grid/ray_model.hh"
#include "models/log_entry.hh"
#include "models/model.hh"
#include "models/power_pack.hh"
#include "models/world_base.hh"
#include "motion/contact_model.hh"
#include "random/random.hh"
#include "sensing/ray_hit.hh"
#include "world/metric.hh"
#include "world/snapshot.hh"

namespace Stg {

namespace internal {
namespace grid {
class Grid;
}
}  // namespace internal

class Worldfile;
class Host;
class WorldEngine;
class Option;
class StateExchange;
class Visualizer;
struct InitialState;
typedef InitialState WorldBeginning [[deprecated("use InitialState")]];
struct WorldImage;
struct RunStatistics;

/// A ray to be traced.
class Ray {
 public:
  const Model* mod;      ///< the model that casts the ray
  Pose origin;           ///< global
  meters_t range;        ///< may be infinite
  ray_test_func_t func;  ///< returns true if the ray stops at the candidate
  const void* arg;
  bool ztest;  ///< hit only bodies whose height interval includes origin.z

  Ray(const Model* m, const Pose& o, const meters_t r, const ray_test_func_t f, const void* a,
      const bool z)
      : mod(m), origin(o), range(r), func(f), arg(a), ztest(z) {}
  Ray() : mod(NULL), range(0), func(NULL), arg(NULL), ztest(true) {}
};

class RaytraceResult {
 public:
  Pose pose;       ///< start of the ray, not the point hit
  Model* mod;      ///< null if nothing was hit
  Color color;     ///< of the model hit; red if none
  meters_t range;  ///< the ray's range if nothing was hit

  RaytraceResult() : mod(NULL), range(0) {}
  RaytraceResult(const Pose& p, Model* m, const Color& c, const meters_t r)
      : pose(p), mod(m), color(c), range(r) {}
};

/// How to run a world. Results depend only on the seed, the models of rays and
/// contacts, the duration and the controllers.
struct RunOptions {
  int threads;     ///< threads per step; 0: as the world file says, or else one or all usable
                   ///< processors, whichever is faster
  uint64_t seed;   ///< of all random numbers
  int share_from;  ///< minimum number of models to update, move or call in parallel; for fewer,
                   ///< waking threads does not pay
  bool batch;      ///< false: each sensor's rays are traced separately, in turn
  bool opencl;     ///< use an OpenCL device where it is faster
  bool always_on_device;  ///< use it even for small batches
  std::string device;     ///< the device: the text after --opencl=
  RayModel ray_model;     ///< overrides that of world files; changes results
  ContactModel contacts;  ///< overrides that of world files; changes results
  usec_t duration;   ///< simulated time after which a world is done, even if it is loaded several
                     ///< times; overrides quit times of files; 0: none
  bool clock;        ///< print the simulated time regardless of the file
  bool branch;       ///< the world belongs to Branches; see World::IsBranch()
  bool controllers;  ///< false: ignore `ctrl` and `plugins`, so that files run no code
  std::vector<std::string> settings;  ///< override world files: see Worldfile::Set()
  /// Contents of picture files by the names that properties `bitmap` have. These files are not
  /// read; null: all pictures are files.
  std::shared_ptr<const std::map<std::string, std::string>> pictures;
  bool listed;  ///< the world belongs to the program: UpdateAll(), Run(), QuitAll(),
                ///< Model::LookupId(), LogEntry::log and the totals of PowerPack include it. Other
                ///< worlds share nothing.

  RunOptions()
      : threads(0),
        seed(1),
        share_from(16),
        batch(true),
        opencl(false),
        always_on_device(false),
        ray_model(RayModel::kDefault),
        contacts(ContactModel::kDefault),
        duration(0),
        clock(false),
        branch(false),
        controllers(true),
        listed(true) {}
};

class World : public WorldBase {
 public:
  static constexpr int DEFAULT_PPM = 50;
  static std::vector<std::string> args;  ///< the program's arguments
  static std::string ctrlargs;           ///< the text of --args, for controllers
  /// Default options of new worlds. Set them in one thread before creating worlds.
  static RunOptions run_options;

  /// `ppm` is the number of cells per metre; invalid values become DEFAULT_PPM with a warning.
  /// `name` is used until a world is loaded.
  World(const std::string& name = "MyWorld", double ppm = DEFAULT_PPM);
  /// Different threads may create, load, run and delete their own worlds at the same time.
  explicit World(const RunOptions& options, const std::string& name = "MyWorld",
                 double ppm = DEFAULT_PPM);
  virtual ~World();

  /// Makes this world use the threads and the OpenCL device of another one, regardless of its file
  /// and options. Call it before Load(). If there are several threads, the two worlds must not be
  /// stepped at the same time. The other world may be deleted at any time.
  void UseThreadsAndDeviceOf(const World& other);
  /// Like UseThreadsAndDeviceOf(), but shares only the device; both may be stepped at the same
  /// time.
  void UseDeviceOf(const World& other);

  // Callbacks and controllers may load, unload or delete the world that calls them; the rest of the
  // step is skipped then. Callers of Load() and Update() can check with Exists() whether the world
  // was deleted.

  /// Reads a world file, creates its models, then calls the Init functions of their controllers.
  /// Returns false with a message if the file is invalid or a callback throws; the world is then
  /// unloaded, and LoadStatus() is the exit status for the program. Also returns false if a
  /// controller unloads the world, or if worlds loaded by controllers nest too deeply.
  virtual bool Load(const std::string& worldfile_path);
  virtual bool Load(std::istream& world_content, const std::string& worldfile_path = std::string());
  /// Loads a copy of a loaded world without reading files. The result equals loading the same file
  /// with the content that the other world read. Both share unchanged scenery. The other world must
  /// not be stepped or changed during the call; several threads may copy it at once. Returns false
  /// like Load().
  bool LoadCopy(const World& other);
  /// LoadCopy() in two steps. The image stays valid if the world changes or is deleted; the world
  /// keeps it too. Returns null with a message if nothing is loaded.
  std::shared_ptr<const WorldImage> Image() const;
  bool LoadCopy(const std::shared_ptr<const WorldImage>& image);
  int LoadStatus() const { return load_status_; }
  /// Warnings and errors of the last Load() or Reset(), one line each, at most 1000. They are also
  /// sent to the log sink.
  const std::vector<std::string>& LoadMessages() const { return load_messages_; }
  /// Loads the world again with another seed, as if the program had been restarted, using the text
  /// of the file as first read. All models are new; only callbacks of controllers remain. Returns
  /// false like Load(), or with a message if nothing is loaded or if called by a callback of the
  /// world.
  bool Reset(uint64_t seed);
  /// Call it right after loading to get what RestartFrom() needs. Returns null if restoring this
  /// state with another seed might differ from loading with that seed, as with controllers,
  /// plug-ins and populations.
  std::shared_ptr<const InitialState> CaptureInitialState();
  [[deprecated("use CaptureInitialState()")]] std::shared_ptr<const InitialState> TakeBeginning() {
    return CaptureInitialState();
  }
  /// Like Reset(seed), but as fast as Restore(): models are kept and return to their loaded state.
  /// `initial_state` must be of this world or a copy. Returns false without a message, and changes
  /// nothing, if clients have registered callbacks.
  bool RestartFrom(const InitialState& initial_state, uint64_t seed);
  [[deprecated("use RestartFrom()")]] bool BeginAgain(const InitialState& state, uint64_t seed) {
    return RestartFrom(state, seed);
  }
  /// Deletes all models and sets the clock to 0.
  virtual void UnLoad();
  /// Makes every model read its properties again from the world file in memory. Bodies, sensors,
  /// controllers and the clock stay unchanged. Refused with a message, like Save(), while the world
  /// is loaded, reloaded or saved.
  virtual void Reload();
  /// Saves the models' states to the world file `filename`, or if null, to the one that was loaded.
  virtual bool Save(const char* filename);
  Worldfile* GetWorldFile();

  /// Steps all worlds until all are done, as fast as possible. A world with a window must be the
  /// only one; Run() then runs its event loop until the window is closed or the world quits.
  static void Run();
  /// Steps each world once. Returns true if all worlds are done.
  static bool UpdateAll();
  /// Does one step. Returns true without a step if the quit time is reached or quitting was
  /// requested; also true if a callback has deleted the world. Does nothing and returns false if
  /// called within a step of this world.
  virtual bool Update(void);
  /// True if `world` points to an existing world.
  static bool Exists(const World* world);
  virtual void Start() { paused = false; }
  virtual void Stop() { paused = true; }
  virtual void TogglePause() { paused = !paused; }
  bool Paused() const { return paused; }
  bool paused;     ///< for callers of Update(), which ignores it
  double speedup;  ///< desired multiple of real time, for callers that pace steps; <= 0: none

  uint64_t UpdateCount() { return updates; }
  uint64_t GetUpdateCount() const { return updates; }
  /// "[Hh] Mm SSs mmmmsec"
  virtual std::string ClockString(void) const;
  void ShowClock(bool enable) { show_clock = enable; }
  bool ShowsClock() const { return show_clock; }
  bool TestQuit() const { return quit_ || (options_.listed && quit_all_); }
  /// Safe to call from other threads and signal handlers.
  void Quit() { quit_ = true; }
  void QuitAll() { quit_all_ = true; }
  void CancelQuit() { quit_ = false; }
  void CancelQuitAll() { quit_all_ = false; }
  bool PastQuitTime() { return quit_time > 0 && sim_time >= quit_time; }
  /// Simulated time at which to stop, in microseconds; 0: never.
  void SetQuitTime(usec_t time) { quit_time = time; }
  usec_t GetQuitTime() const { return quit_time; }

  /// Calls cb(world, user) at the end of each step, in registration order, until it returns
  /// non-zero.
  void AddUpdateCallback(world_callback_t cb, void* user);
  int RemoveUpdateCallback(world_callback_t cb, void* user);
  /// Calls `call` once after the current or next step, when snapshots can be taken. It must not
  /// delete or unload the world. Calls added meanwhile run after the following step.
  void CallAfterStep(const std::function<void(World&)>& call);
  /// Calls cb(mod, arg) once, in the first step whose time is at least now + delay. There is a
  /// single queue, so `queue_num` is ignored.
  unsigned int GetEventQueue(Model*) const { return 0; }
  void Enqueue(unsigned int queue_num, usec_t delay, Model* mod, model_callback_t cb, void* arg);

  /// Finds a model by full name, including former names. Returns null with a warning if none.
  Model* GetModel(const std::string& name) const;
  const std::set<Model*> GetAllModels() const;
  /// The type must be in Model::name_map; otherwise returns null with a message.
  Model* CreateModel(Model* parent, const std::string& typestr);

  /// Cells per metre.
  double Resolution() const;
  /// Ray model of Raytrace() and of sensors that do not specify one: kCell or kExact.
  RayModel GetRayModel() const;
  void SetRayModel(RayModel model);
  /// The model of contacts: kCells or kOutlines. A change takes effect in the next step.
  ContactModel GetContactModel() const;
  void SetContactModel(ContactModel model);
  /// Calls f for each place where bodies touch at their present poses, in an order that does not
  /// depend on threads. With contacts of cells there are none.
  void ForEachContact(const std::function<void(const ContactPoint&)>& f) const;
  /// Bounds of the area in which anything was ever rasterized, in whole superregions, metres.
  const bounds3d_t& GetExtent() const;
  /// Number of the cell at coordinate `x`, clamped to the valid range.
  int32_t MetersToPixels(meters_t x) const;
  point_int_t MetersToPixels(const point_t& pt) const;

  /// Returns the nearest model along the ray that satisfies the predicate. In a callback at the end
  /// of a step, models are where that step has moved them. If the range is negative or NaN, or the
  /// pose is not finite, nothing is hit.
  RaytraceResult Raytrace(const Ray& ray);
  RaytraceResult Raytrace(const Pose& pose, const meters_t range, const ray_test_func_t func,
                          const Model* finder, const void* arg, const bool ztest);
  /// Traces results.size() rays, spread evenly over heading +- fov / 2 from right to left. A single
  /// ray goes straight ahead.
  void Raytrace(const Pose& gpose, const meters_t range, const radians_t fov,
                const ray_test_func_t func, const Model* model, const void* arg, const bool ztest,
                std::vector<RaytraceResult>& results);

  /// Records the model's pose in the log.
  void Log(Model* mod);
  /// Entries recorded by Log() since the world was loaded.
  const std::vector<LogEntry>& log() const { return log_; }

  /// Current values of the metrics of the world file and of SetMetric(). They restart when the
  /// world is loaded, reset or restored from a snapshot.
  std::vector<NamedMetric> Metrics() const;
  /// Sets a metric that a controller or other client computes.
  void SetMetric(const std::string& name, double value);

  /// Totals of the power packs of this world: see PowerPack.
  const EnergyTotals& energy_totals() const;

  /// Implements Run() for a world with a window.
  virtual void RunEventLoop() {}
  virtual Model* RecentlySelectedModel() const { return NULL; }
  void RegisterOption(Option* option) override;
  /// Draws a line in the next picture (coordinates in metres). Ignored without a window.
  void RecordRay(double x1, double y1, double x2, double y2);
  /// Like RecordRay(), with a colour that may be transparent.
  void RecordLine(double x1, double y1, double x2, double y2, const Color& color);
  void ClearRays() { ray_list.clear(); }
  struct RecordedRay {
    double x1, y1, x2, y2;
    Color color;
  };
  const std::vector<RecordedRay>& recorded_rays() const { return ray_list; }
  /// Whether positions record their trails, which only windows show. Off by default.
  void RecordTrails(bool enable) { record_trails = enable; }
  bool RecordsTrails() const { return record_trails; }

  /// Times of the phases, counts of rays and hits, and memory of the grid.
  RunStatistics statistics() const;
  /// Takes a snapshot, between steps. Returns false with a message, and leaves *to unchanged, if
  /// something cannot be saved: a controller that does not declare its state (see
  /// Model::KeepState()), or a pending callback of Enqueue().
  bool Take(Snapshot* to, Snapshot::Keep keep = Snapshot::kFull) const;
  /// Restores a snapshot of this world or of another one loaded from the same file; the world then
  /// continues exactly like that one. Call it between steps. Pointers to models stay valid, but
  /// models created since are deleted, and deleted ones are created again. Flags get their values
  /// back, not their addresses. Callbacks, clients' data and options stay. Returns false with a
  /// message, and changes nothing, if models or their callbacks do not match. If memory runs out,
  /// it throws std::bad_alloc, and the world must be restored or loaded again.
  bool Restore(const Snapshot& from);
  /// Sets the clock, for replaying recorded runs. Drops all scheduled events, so models no longer
  /// update by themselves. Call it between steps.
  void ShowTime(usec_t time);
  /// Makes all following random numbers depend on this seed and the current state. Also sets the
  /// world's seed. Call it between steps.
  void Reseed(uint64_t seed);
  /// True if the world belongs to Branches, which try something out: effects of a controller do not
  /// reach the original world.
  bool IsBranch() const { return options_.branch; }
  /// Hash of everything that decides the future of the world, see state_exchange.hh. Worlds with
  /// equal futures have equal hashes. Call it between steps.
  uint64_t StateHash() const;
  /// Checks that the parts of the world agree: the tree of models, lists, the schedule, and the
  /// bodies and cells of the grid. Returns the first fault found, or an empty string. A fault is a
  /// mistake in the code. Takes about as long as rasterizing all models. With the environment
  /// variable STAGE_VALIDATE=1, builds with assertions do it after each phase of a step: see
  /// STAGE_ASSERT.
  std::string Validate() const;
  /// Enumerates the state that StateHash() covers; Model::ExchangeState() does it for each model.
  /// Restoring requires the same models in the same tree.
  void ExchangeState(StateExchange& exchange);
  const RunOptions& options() const { return options_; }
  uint64_t seed() const override { return options_.seed; }

  // ---- for the models ----

  void AddModel(Model* mod) override;
  void RemoveModel(Model* mod) override;
  void AddModelName(Model* mod, const std::string& name);
  WorldEngine& engine() { return *engine_; }
  const WorldEngine& engine() const { return *engine_; }
  void EnableEnergy(Model* mod);
  void DisableEnergy(Model* mod);
  void AddPowerPack(PowerPack*);
  void RemovePowerPack(PowerPack*);
  /// Returns null if this world has no model with this id.
  Model* FindModel(uint32_t id) const;
  /// Searches all listed worlds, oldest first.
  static Model* FindModelOfAny(uint32_t id);
  /// Resolves kDefault to the world's ray model.
  bool IsExact(RayModel model) const;
  /// Rasterizes bodies for the exact ray model from now on. Does nothing if already done.
  void RasterizeForExactRays();

 protected:
  struct Source;
  bool LoadFrom(Source source);
  bool LoadNow(WorldEngine& engine, Source source);
  virtual void LoadWorldProperties();
  /// Called when all models exist; implemented by worlds with a window.
  virtual void LoadWindowSection() {}
  void UsePrefilter();
  void LoadContent(Source source);
  void RasterizeAll();
  bool FailToLoad(const WorldEngine& engine, const std::string& message, int status);
  bool RefuseToNest();
  bool AfterEpochChanged();
  bool RefusesToWrite(const char* what) const;
  bool LoadEntities();
  void LoadEntity(int entity);
  void InitControllers();
  void ApplyRunOptions();
  void CheckNotNested(int entity, Model* parent_model);
  void CheckOutlines(const std::vector<Model*>& models);
  void CallUpdateCallbacks();
  bool MakeStep(const std::shared_ptr<WorldEngine>& engine);
  void CallAfterThisStep();
  void Step(WorldEngine& engine, uint64_t epoch);
  void FinishSensing();
  void ValidateAfter(const char* phase) const;
  void UpdateEnergy();
  void UpdateTrails();
  void PrintClock();
  void MakeGround();
  void ReplaceGround(uint32_t id);
  void ForgetAll();
  void DeleteAll();
  void SetDefaults();
  RaytraceResult ResultOf(const Pose& origin, double range, Model* hit) const;

  usec_t quit_time;
  uint64_t updates;
  std::vector<Option*> option_table;
  bool record_trails;
  bool show_clock;
  unsigned int show_clock_interval;
  std::unique_ptr<Worldfile> wf;
  mutable bounds3d_t extent;

  std::vector<RecordedRay> ray_list;

 private:
  friend class RowBridge;
  class LoadChecks;
  class Restorer;
  class Validator;

  void ExchangeHead(StateExchange& exchange);
  void ExchangeOwn(StateExchange& exchange);
  void ExchangeSchedules(StateExchange& exchange);
  void ExchangeGridState(StateExchange& exchange);
  std::string PendingCallback();
  void ExchangeTotals(StateExchange& exchange);
  void ExchangeUnrasterized(StateExchange& exchange);
  void ExchangeSchedule(StateExchange& exchange);
  void RestoreSchedule(uint64_t events, StateExchange& exchange);
  void ExchangeNames(StateExchange& exchange);
  void ExchangeGrid(StateExchange& exchange);
  struct RasterizedBody;
  static std::vector<RasterizedBody> BodiesOf(const std::vector<Model*>& models,
                                              const internal::grid::Grid& grid, bool all);
  void HashOrder(StateExchange& exchange);
  void ExchangeOrder(StateExchange& exchange);
  static bool MarkRecent(std::vector<RasterizedBody>* bodies, std::vector<RasterizedBody>* recent);
  bool RestoreOrder(const std::vector<Model*>& models, std::vector<RasterizedBody>* recent);
  void RestoreCreationOrder(const std::vector<Model*>& models,
                            const std::vector<RasterizedBody>& bodies);
  void ReorderAll(const std::vector<Model*>& models);
  void MarkAllRasterized();
  void MarkAllRasterizedSince(uint64_t stamp);
  std::shared_ptr<const WorldImage> MakeImage() const;
  void RasterizeFromImage(const WorldImage& image);
  bool HasClients() const;
  bool CanRestart();
  void RestartRandomNumbers(const InitialState& initial_state, uint64_t seed);

  static void InitIfNotDone();
  static std::vector<World*> ListedWorlds();

  std::shared_ptr<WorldEngine> engine_;  // same object as host_
  RunOptions options_;
  const double default_ppm_;
  std::vector<LogEntry> log_;
  int load_status_;
  std::vector<std::string> load_messages_;
  std::string path_;         // as passed to Load()
  usec_t simulated_before_;  // simulated time of worlds loaded before
  std::atomic<bool> quit_;
  static std::atomic<bool> quit_all_;
  static std::vector<World*> worlds_;
};

}  // namespace Stg

#endif
