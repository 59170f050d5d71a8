// SPDX-License-Identifier: GPL-2.0-or-later
//
// World: models, a clock, and the steps that move them on. Part of <stage.hh>.

#ifndef STAGE_WORLD_WORLD_HH
#define STAGE_WORLD_WORLD_HH

#include <atomic>
#include <functional>
#include <iosfwd>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "geometry/geometry.hh"
#include "geometry/random.hh"
#include "grid/ray_model.hh"
#include "models/ancestor.hh"
#include "models/log_entry.hh"
#include "models/model.hh"
#include "models/power_pack.hh"
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
struct WorldBeginning;
struct WorldImage;
struct RunStatistics;
struct SceneSummary;
struct StepCosts;

/// A ray to be traced.
class Ray {
 public:
  const Model* mod;      ///< the finder
  Pose origin;           ///< global
  meters_t range;        ///< may be infinite
  ray_test_func_t func;  ///< true: the ray stops at the candidate
  const void* arg;
  bool ztest;  ///< only bodies whose height interval contains origin.z, ends included

  Ray(const Model* m, const Pose& o, const meters_t r, const ray_test_func_t f, const void* a,
      const bool z)
      : mod(m), origin(o), range(r), func(f), arg(a), ztest(z) {}
  Ray() : mod(NULL), range(0), func(NULL), arg(NULL), ztest(true) {}
};

class RaytraceResult {
 public:
  Pose pose;       ///< where the ray began: not the point that was hit
  Model* mod;      ///< null if nothing was hit
  Color color;     ///< of what was hit; red if nothing
  meters_t range;  ///< the ray's own if nothing was hit

  RaytraceResult() : mod(NULL), range(0) {}
  RaytraceResult(const Pose& p, Model* m, const Color& c, const meters_t r)
      : pose(p), mod(m), color(c), range(r) {}
};

/// How a world is run. Results change with the seed, the ray model, the duration and the
/// controllers alone.
struct RunOptions {
  int threads;     ///< that work on a step; 0: what the world file says, or else as many as the
                   ///< process may use processors, in steps that are faster with them
  uint64_t seed;   ///< of all random numbers
  int share_from;  ///< so many models, at least, are updated, moved or called by several
                   ///< threads; fewer are not worth waking them for
  bool batch;      ///< false: each sensor's rays are traced on their own, one by one
  bool opencl;     ///< use an OpenCL device where that is faster
  bool always_on_device;  ///< use it for every batch, however small
  std::string device;     ///< which: the text after --opencl=
  RayModel ray_model;     ///< of worlds, whatever their files say; changes results
  usec_t duration;   ///< simulated, after which a world is done, whatever quit time its files give
                     ///< and however often it is loaded; 0: their quit times count
  bool clock;        ///< print the simulated time, whatever the file says
  bool branch;       ///< the world is one that Branches try something in; see World::IsBranch()
  bool controllers;  ///< false: `ctrl` and `plugins` load nothing, so that files run no code
  std::vector<std::string> settings;  ///< in place of what world files say: see Worldfile::Set()
  bool
      listed;  ///< the world is one of those of the program: World::UpdateAll(), Run() and
               ///< QuitAll() concern it, Model::LookupId() looks into it, and LogEntry::log and the
               ///< totals of PowerPack tell of it. One that is not shares nothing with other worlds

  RunOptions()
      : threads(0),
        seed(1),
        share_from(16),
        batch(true),
        opencl(false),
        always_on_device(false),
        ray_model(RayModel::kDefault),
        duration(0),
        clock(false),
        branch(false),
        controllers(true),
        listed(true) {}
};

class World : public Ancestor {
 public:
  static constexpr int DEFAULT_PPM = 50;
  static std::vector<std::string> args;  ///< of the program
  static std::string ctrlargs;           ///< the text of --args, for controllers
  /// Of worlds that are made without any of their own. To be set before, by one thread.
  static RunOptions run_options;

  /// ppm: cells of the grid per metre; in place of one that is not positive and finite, with a
  /// message, DEFAULT_PPM. The name is only a stand-in until a world is loaded.
  World(const std::string& name = "MyWorld", double ppm = DEFAULT_PPM);
  /// Different threads may make, load, run and delete worlds of their own at the same time.
  explicit World(const RunOptions& options, const std::string& name = "MyWorld",
                 double ppm = DEFAULT_PPM);
  virtual ~World();

  /// From now on this world works with the threads and the OpenCL device of another one, whatever
  /// its file and its options say of these: it starts no thread and opens no device of its own. To
  /// be called before Load(). If there are several threads, the two must not be stepped at the same
  /// time. The other world may be deleted at any time.
  void UseThreadsAndDeviceOf(const World& other);
  /// The same of the device alone; the two may be stepped at the same time.
  void UseDeviceOf(const World& other);

  // Callbacks and controllers may load, unload and delete the world they are called in. The rest of
  // a step is left out then. Whoever has called Load() or Update() of a world that they may delete
  // asks Exists().

  /// Reads a world file and makes its models; then calls their controllers' Init functions. False,
  /// with a message on standard error, if anything is wrong with it, or a callback throws; the
  /// world is then as after UnLoad(), and LoadStatus() is the status that a program should exit
  /// with. False, with a message, also if a controller has unloaded the world, and if controllers
  /// load worlds that load worlds, many times over.
  virtual bool Load(const std::string& worldfile_path);
  virtual bool Load(std::istream& world_content, const std::string& worldfile_path = std::string());
  /// Loads what another world has loaded, without reading a file: this one is then as if it had
  /// loaded that file itself, as it was when the other one read it. Both share what they don't
  /// change of the scenery. The other must not be stepped or changed meanwhile; several worlds may
  /// become copies of it at once. False like Load().
  bool LoadCopy(const World& other);
  /// The same in two parts. The image stays good whatever becomes of the world that it is of, which
  /// keeps it, too. Null, with a message, if nothing is loaded.
  std::shared_ptr<const WorldImage> Image() const;
  bool LoadCopy(const std::shared_ptr<const WorldImage>& image);
  int LoadStatus() const { return load_status_; }
  /// The warnings and errors of the last Load() or Reset(), a line each; a thousand at most. The
  /// log sink gets them too.
  const std::vector<std::string>& LoadMessages() const { return load_messages_; }
  /// As if the program had begun anew with that seed: loads the world again, from the text of the
  /// file as it was when it was read, with the numbers that models got then. So all models are
  /// new, and callbacks are gone but those of controllers. False like Load(); and if nothing is
  /// loaded, or a callback of the world's asks for it, with a message.
  bool Reset(uint64_t seed);
  /// To be called right after loading: what BeginAgain() needs. Null if going back to this state
  /// with another seed would not be what loading with that seed is: controllers, plug-ins and
  /// populations may make anything of a seed.
  std::shared_ptr<const WorldBeginning> TakeBeginning();
  /// Does what Reset(seed) does, at the price of Restore(): models stay, and go back to how they
  /// were loaded. The beginning is that of this world or of a copy of it. False, without a message
  /// and with the world as it was, if models or the world have callbacks of clients.
  bool BeginAgain(const WorldBeginning& beginning, uint64_t seed);
  /// Deletes all models; the clock goes back to 0.
  virtual void UnLoad();
  /// Lets every model read its properties again, from the world file as it is in memory. Bodies,
  /// sensors and controllers stay as they are; the clock goes on. Refused, with a message, like
  /// Save(), while the world is loaded, reloaded or saved.
  virtual void Reload();
  /// Writes what models save into the world file; null: the one that was loaded.
  virtual bool Save(const char* filename);
  Worldfile* GetWorldFile();

  /// Steps all worlds until all are done, as fast as possible. With a world that has a window: its
  /// event loop, until the window is closed or all worlds are to quit; then it must be the only
  /// one.
  static void Run();
  /// One step of each world; true when every world says that it is done.
  static bool UpdateAll();
  /// One step. True, without a step, if the quit time has come or quitting was asked for; true also
  /// if a callback has deleted the world. Nothing, and false, within a step of the same world.
  virtual bool Update(void);
  /// Whether that is a world now.
  static bool Exists(const World* world);
  virtual void Start() { paused = false; }
  virtual void Stop() { paused = true; }
  virtual void TogglePause() { paused = !paused; }
  bool Paused() const { return paused; }
  bool paused;          ///< concerns those who call Update(), not Update() itself
  usec_t sim_interval;  ///< length of a step
  double speedup;       ///< wanted multiple of real time, for who paces the steps; <= 0: none

  usec_t SimTimeNow(void) const { return sim_time; }
  uint64_t UpdateCount() { return updates; }
  uint64_t GetUpdateCount() const { return updates; }
  /// "[Hh] Mm SSs mmmmsec"
  virtual std::string ClockString(void) const;
  void ShowClock(bool enable) { show_clock = enable; }
  bool ShowsClock() const { return show_clock; }
  bool TestQuit() const { return quit_ || (options_.listed && quit_all_); }
  /// Safe from other threads and signal handlers.
  void Quit() { quit_ = true; }
  void QuitAll() { quit_all_ = true; }
  void CancelQuit() { quit_ = false; }
  void CancelQuitAll() { quit_all_ = false; }
  bool PastQuitTime() { return quit_time > 0 && sim_time >= quit_time; }
  /// Simulated time at which to stop; 0: never.
  void SetQuitTime(usec_t time) { quit_time = time; }
  usec_t GetQuitTime() const { return quit_time; }

  /// cb(world, user) at the end of each step, in the order of registration; non-zero removes it.
  void AddUpdateCallback(world_callback_t cb, void* user);
  int RemoveUpdateCallback(world_callback_t cb, void* user);
  /// Calls it once, when the step in progress has ended, or the next one: between steps, where
  /// snapshots can be taken. It may not delete or unload the world. What is asked for meanwhile is
  /// called after the following step.
  void CallAfterStep(const std::function<void(World&)>& call);
  /// cb(mod, arg) once, in the first step whose time is now + delay or later.
  /// There is one queue.
  unsigned int GetEventQueue(Model*) const { return 0; }
  void Enqueue(unsigned int queue_num, usec_t delay, Model* mod, model_callback_t cb, void* arg);

  /// By full name, former names included. Null and a warning if there is none.
  Model* GetModel(const std::string& name) const;
  const std::set<Model*> GetAllModels() const;
  Model* GetGround() { return ground; }
  Model* ground;
  /// The type has to be one of Model::name_map; otherwise a message, and null.
  Model* CreateModel(Model* parent, const std::string& typestr);

  /// Cells per metre.
  double Resolution() const;
  /// Of Raytrace() and of sensors that don't say: kCell or kExact.
  RayModel GetRayModel() const;
  void SetRayModel(RayModel model);
  /// The plane area that anything was ever drawn in, in superregions.
  const bounds3d_t& GetExtent() const;
  /// The number of the cell; the first or last number there is where it would be beyond these.
  int32_t MetersToPixels(meters_t x) const;
  point_int_t MetersToPixels(const point_t& pt) const;

  /// The nearest model along the ray for which the predicate holds. In a callback at the end of a
  /// step, models are where that step has moved them. A range that is negative or not a number, and
  /// a pose that is not finite, cast no ray: nothing is hit.
  RaytraceResult Raytrace(const Ray& ray);
  RaytraceResult Raytrace(const Pose& pose, const meters_t range, const ray_test_func_t func,
                          const Model* finder, const void* arg, const bool ztest);
  /// results.size() rays, spread evenly over heading +- fov / 2, the right-hand one first; a single
  /// one goes straight ahead.
  void Raytrace(const Pose& gpose, const meters_t range, const radians_t fov,
                const ray_test_func_t func, const Model* model, const void* arg, const bool ztest,
                std::vector<RaytraceResult>& results);

  /// Writes down where the model is.
  void Log(Model* mod);
  /// What Log() has written down since the world was loaded.
  const std::vector<LogEntry>& log() const { return log_; }

  /// What the metrics of the world file come to so far, and what SetMetric() was told. They begin
  /// anew when the world is loaded, reset, or taken back to a snapshot.
  std::vector<NamedMetric> Metrics() const;
  /// For controllers and others that measure something of their own.
  void SetMetric(const std::string& name, double value);

  /// Of the packs of this world: see PowerPack.
  const EnergyTotals& energy_totals() const { return energy_totals_; }

  virtual bool IsGUI() const { return false; }
  /// What Run() does for a world with a window.
  virtual void RunEventLoop() {}
  virtual void Redraw(void) {}
  /// The next picture is to be made from scratch.
  void NeedRedraw() { dirty = true; }
  virtual Model* RecentlySelectedModel() const { return NULL; }
  virtual void PushColor(Color) {}
  virtual void PushColor(double, double, double, double) {}
  virtual void PopColor() {}
  /// Not owned.
  void RegisterOption(Option* option);
  /// A model has got a visualizer: for windows, which make an option for it.
  virtual void OfferVisualizer(Visualizer*, bool) {}
  /// A line of the next picture (metres); ignored without a window.
  void RecordRay(double x1, double y1, double x2, double y2);
  /// The same in a colour, which may be transparent.
  void RecordLine(double x1, double y1, double x2, double y2, const Color& color);
  void ClearRays() { ray_list.clear(); }
  struct RecordedRay {
    double x1, y1, x2, y2;
    Color color;
  };
  const std::vector<RecordedRay>& recorded_rays() const { return ray_list; }
  /// Whether positions write down where they have been, which only windows show. Off at first.
  void RecordTrails(bool enable) { record_trails = enable; }

  /// Where the time went, counts of rays and hits, memory of the grid.
  RunStatistics statistics() const;
  /// What there is in the world, and what is left out because nobody asks for it; see explain.hh.
  SceneSummary Summary() const;
  /// What the parts of a step cost on this machine, measured in about so many seconds with samples
  /// of what is there; between steps. No callback is called. Sensors update, robots drive a bit,
  /// and all is put back: poses, readings, random numbers, the clock, the statistics. Only pictures
  /// of cameras stay until their next update.
  StepCosts MeasureStepCosts(double seconds = kMeasuringSeconds);
  static constexpr double kMeasuringSeconds = 0.3;
  /// Takes a snapshot, between steps. False, with a message that names it, and *to as it was, if
  /// something can't be kept: a controller that neither keeps state nor says that it has none (see
  /// Model::KeepState()), or a callback that Enqueue() has put off.
  bool Take(Snapshot* to, Snapshot::Keep keep = Snapshot::kFull) const;
  /// Goes back to a snapshot of this world, or of another one that was loaded from the same file:
  /// from then on the one goes on like the other. Between steps. Pointers to models stay valid;
  /// those that have come since are deleted, and those that are gone are made again. Flags that
  /// models carry get their values, not their addresses. Callbacks, clients' data and options stay
  /// as they are. False, with a message, and the world as it was, if the models or their callbacks
  /// don't fit.
  bool Restore(const Snapshot& from);
  /// Sets the clock, for those who show what another run has recorded: nothing that was planned
  /// happens any more, so models no longer update by themselves. Between steps.
  void ShowTime(usec_t time);
  /// From now on random numbers are others: what they are follows from this seed and from the
  /// state. The world's seed is this one then. Between steps.
  void Reseed(uint64_t seed);
  /// Something is being tried in it, see Branches: what a controller does here isn't done to the
  /// world that it is a copy of.
  bool IsBranch() const { return options_.branch; }
  /// Of all that decides the future of the world and its models, see state_exchange.hh: two worlds
  /// that will go on alike have the same. Between steps.
  uint64_t StateHash() const;
  /// Lists that; Model::ExchangeState() does for each model. What restores it needs the same models
  /// in the same tree.
  void ExchangeState(StateExchange& exchange);
  const RunOptions& options() const { return options_; }
  uint64_t seed() const { return options_.seed; }
  /// The world's own random numbers; see Model::random() too.
  RandomStream& random() { return random_.Get(); }

  // ---- for the models ----

  virtual void AddModel(Model* mod);
  virtual void RemoveModel(Model* mod);
  void AddModelName(Model* mod, const std::string& name);
  WorldEngine& engine() { return *engine_; }
  Host& host() { return *host_; }
  /// For those who call callbacks, which may delete the world.
  std::shared_ptr<Host> ShareHost() const;
  void EnableEnergy(Model* mod);
  void DisableEnergy(Model* mod);
  EnergyTotals& energy_totals() { return energy_totals_; }
  void AddPowerPack(PowerPack*) { power_pack_count++; }
  void RemovePowerPack(PowerPack*) { power_pack_count--; }
  /// Null if there is none of that number in this world.
  Model* FindModel(uint32_t id) const;
  /// The same in all listed worlds, the oldest first.
  static Model* FindModelOfAny(uint32_t id);
  /// What it comes to in this world.
  bool IsExact(RayModel model) const;
  /// Draws the bodies for the exact ray model, from now on, if it is not done yet.
  void DrawForExactRays();

 protected:
  struct Source;
  bool LoadFrom(Source source);
  bool LoadNow(WorldEngine& engine, Source source);
  virtual void LoadWorldProperties();
  /// Called when all models are there: for those who have a window.
  virtual void LoadWindowSection() {}
  void UsePrefilter();
  void LoadContent(Source source);
  void DrawAll();
  bool FailToLoad(const WorldEngine& engine, const std::string& message, int status);
  bool RefuseToNest();
  bool AfterAnotherLife();
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
  void Step(WorldEngine& engine, uint64_t life);
  void FinishSensing();
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
  usec_t sim_time;
  uint64_t updates;
  bool dirty;
  std::vector<Option*> option_table;
  int power_pack_count;
  bool record_trails;
  bool show_clock;
  unsigned int show_clock_interval;
  std::unique_ptr<Worldfile> wf;
  mutable bounds3d_t extent;

  std::vector<RecordedRay> ray_list;

 private:
  class Survey;
  class LoadChecks;
  class Gauge;
  class Restorer;

  void ExchangeHead(StateExchange& exchange);
  void ExchangeOwn(StateExchange& exchange);
  void ExchangePlans(StateExchange& exchange);
  void ExchangePlaces(StateExchange& exchange);
  std::string WhoWaits();
  bool IsIn(const StateRow& row);
  void ExchangeTotals(StateExchange& exchange);
  void ExchangeUndrawn(StateExchange& exchange);
  void ExchangeSchedule(StateExchange& exchange);
  void RestoreSchedule(uint64_t events, StateExchange& exchange);
  void ExchangeLists(StateExchange& exchange);
  void ExchangeNames(StateExchange& exchange);
  void ExchangeGrid(StateExchange& exchange);
  struct DrawnBody;
  static std::vector<DrawnBody> BodiesOf(const std::vector<Model*>& models,
                                         const internal::grid::Grid& grid, bool all);
  void HashOrder(StateExchange& exchange);
  void ExchangeOrder(StateExchange& exchange);
  static bool MarkLate(std::vector<DrawnBody>* bodies, std::vector<DrawnBody>* late);
  void ReturnEarly(const std::vector<Model*>& models, const std::vector<DrawnBody>& bodies);
  void DrawInOrder(const std::vector<Model*>& models);
  void NoteAllDrawn();
  void NoteAllDrawnSince(uint64_t stamp);
  std::shared_ptr<const WorldImage> MakeImage() const;
  void DrawLike(const WorldImage& image);
  bool HasClients() const;
  bool MayBeginAgain();
  void RestartRandomNumbers(const WorldBeginning& beginning, uint64_t seed);

  static void InitIfNotDone();
  static std::vector<World*> ListedWorlds();

  std::shared_ptr<WorldEngine> engine_;
  Host* const host_;  // the same
  RunOptions options_;
  const double default_ppm_;
  std::vector<LogEntry> log_;
  EnergyTotals energy_totals_;
  LazyRandomStream random_;
  int load_status_;
  std::vector<std::string> load_messages_;
  std::string path_;         // as given to Load()
  usec_t simulated_before_;  // by what was loaded before
  std::atomic<bool> quit_;
  static std::atomic<bool> quit_all_;
  static std::vector<World*> worlds_;
};

}  // namespace Stg

#endif
