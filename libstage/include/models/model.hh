// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model: anything that is in a world. Part of <stage.hh>.
//
// Lengths are metres, angles radians, times microseconds of simulated time. Pointers handed in are
// not owned by the library, pointers handed out stay owned by it, nothing throws.

#ifndef STAGE_MODELS_MODEL_HH
#define STAGE_MODELS_MODEL_HH

#include <forward_list>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "geometry/color.hh"
#include "geometry/geometry.hh"
#include "geometry/random.hh"
#include "grid/ray_model.hh"
#include "models/ancestor.hh"

namespace Stg {

class BlockGroup;
class CallbackPhase;
class GatherPhase;
class MovePhase;
class ModelRanger;
struct ModelType;
class Option;
class PowerPack;
class StateExchange;
class StateKeeper;
class Visualizer;
class Worldfile;
namespace internal {
namespace sensing {
class DirectionTables;
class FanList;
struct BatchShare;
struct Fan;
struct Scene;
struct SelfMask;
}  // namespace sensing
namespace grid {
struct Drawings;
}
}  // namespace internal

/// Makes a model of one type: what Model::name_map holds for each type name.
typedef Model* (*creator_t)(World* world, Model* parent, const std::string& type);

/// How sensors and bodies perceive a model.
class Visibility {
 public:
  bool blob_return;
  int fiducial_key;
  int fiducial_return;
  bool gripper_return;
  bool obstacle_return;
  double ranger_return;  ///< intensity; negative: rangers look through it

  Visibility()
      : blob_return(true),
        fiducial_key(0),
        fiducial_return(0),
        gripper_return(false),
        obstacle_return(true),
        ranger_return(1.0) {}
  Visibility& Load(Worldfile* wf, int entity);
  void Save(Worldfile* wf, int entity);
  void ExchangeState(StateExchange& exchange);
};

class Model : public Ancestor {
 public:
  class Flag;

  typedef enum {
    CB_FLAGDECR,
    CB_FLAGINCR,
    CB_GEOM,
    CB_INIT,
    CB_LOAD,
    CB_PARENT,
    CB_POSE,
    CB_SAVE,
    CB_SHUTDOWN,
    CB_STARTUP,
    CB_UPDATE,
    CB_VELOCITY,
    __CB_TYPE_COUNT
  } callback_type_t;

  /// So many models lie above another at most.
  static const unsigned int kDeepest = 1000;

  /// The known types. Clients may add their own after Init() and before loading a world;
  /// RegisterModelType() does it at any time, and tells more of them.
  static std::map<std::string, creator_t> name_map;

  /// Registers with the world and the parent (null: top level). An empty name is made up:
  /// "type:n", after "parent." for children. The body is one block that fills the default size.
  /// A parent that is kDeepest below the top level is refused with a message; then the model stands
  /// at the top level.
  Model(World* world, Model* parent = NULL, const std::string& type = "model",
        const std::string& name = "");
  virtual ~Model();

  // ---- names and the tree ----

  /// Old names stay valid for World::GetModel().
  void SetToken(const std::string& str) override;
  const std::string& GetModelType() const { return type; }
  /// A serial number, unique in the world: the ground has 0, models of a file follow in its order.
  uint32_t GetId() const { return id; }
  /// The model of that number; null if there is none. With several worlds World::FindModel() is
  /// meant: this takes the oldest of them that has one.
  static Model* LookupId(uint32_t id);
  std::string PoseString() { return GetPose().String(); }
  /// Its name and its descendants', a line each.
  virtual void Print(char* prefix) const;
  /// "name @ [x,y,z,a]", global. Valid until this thread's next call for any model.
  virtual const char* PrintWithPose() const;

  World* GetWorld() const { return world; }
  Model* Parent() const { return parent; }
  Model* Root() { return root; }
  const Model* Root() const { return root; }
  /// Whether it is a ModelPosition.
  bool Drives() const { return drives_; }
  /// The model called "<token>.<name>"; null and a warning if there is none.
  Model* GetChild(const std::string& name) const;
  /// This model or the first descendant of the type that was not handed out before; marks it.
  /// Null if there is none, with a warning at top level.
  Model* GetUnusedModelOfType(const std::string& type);
  /// The same, first without subscribers; nothing is marked.
  Model* GetUnsubscribedModelOfType(const std::string& type) const;
  bool IsAntecedent(const Model* testmod) const;
  bool IsDescendent(const Model* testmod) const;
  /// In the same top-level tree; a model is related to itself.
  bool IsRelated(const Model* testmod) const { return root == testmod->root; }
  /// How many models lie above it.
  unsigned int Depth() const;
  /// Moves to another parent (null: top level) and keeps the global pose. One that descends from
  /// this model is refused with a message, and so is one that would nest models too deeply: 1.
  int SetParent(Model* newparent);
  void BecomeParentOf(Model* child);

  // ---- pose, geometry, body ----

  Pose GetPose() const { return pose; }
  Pose GetGlobalPose() const override;
  // A step senses first, then moves. Its readings belong to the poses before its moves. These two
  // tell those poses afterwards, for the last step in which a model of this tree updated.

  /// In the frame of the world.
  virtual Pose GetSensedPose() const;
  /// In the parent's frame.
  virtual Pose GetSensedLocalPose() const { return pose; }
  /// In the parent's frame. No collision test. A pose with a coordinate that is not finite is
  /// refused with a message.
  void SetPose(const Pose& pose);
  void SetGlobalPose(const Pose& gpose);
  void AddToPose(const Pose& pose);
  void AddToPose(double dx, double dy, double dz, double da);
  Geom GetGeom() const { return geom; }
  /// One with a number that is not finite is refused with a message.
  void SetGeom(const Geom& src);
  /// A global pose in this model's frame; the body's offset plays no part.
  Pose GlobalToLocal(const Pose& pose) const;
  /// The other way, with the body's offset: not the exact inverse if there is one.
  Pose LocalToGlobal(const Pose& pose) const;
  point_t LocalToGlobal(const point_t& pt) const;
  std::vector<point_int_t> LocalToPixels(const std::vector<point_t>& local) const;

  /// One with a number that is not finite is refused with a message.
  void AddBlockRect(meters_t x, meters_t y, meters_t dx, meters_t dy, meters_t dz);
  void ClearBlocks();
  /// Marks the cells of a raster that the body's outlines pass, centred on the body; row 0 is at
  /// the smallest y.
  void Rasterize(uint8_t* data, unsigned int width, unsigned int height, meters_t cellwidth,
                 meters_t cellheight);
  /// Does the body, or a descendant's, overlap an obstacle now?
  bool HasCollision();
  /// Random poses in the rectangle until one is free; gives up after max_iter further ones (0:
  /// never), and at once, with a message, if the rectangle is not finite.
  bool RandomPoseInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                             size_t max_iter = 0);
  /// The same, unless the present pose is free.
  bool PlaceInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                        size_t max_iter = 0);
  kg_t GetTotalMass() const;
  kg_t GetMassOfChildren() const;
  /// SetMass(), SetRangerReturn() and SetWatts() refuse what is not finite with a message; the
  /// first and the last also what is negative.
  void SetMass(kg_t m);

  // ---- life cycle ----

  /// Counted. A model produces data only while it has subscribers. It updates in the first step at
  /// or after each multiple of its interval, whenever it was subscribed to: models with the same
  /// interval update together.
  void Subscribe();
  void Unsubscribe();
  unsigned int GetSubscriptionCount() const { return subs; }
  bool HasSubscribers() const { return subs > 0; }
  usec_t GetInterval() { return interval; }
  usec_t GetUpdateInterval() const { return interval; }
  /// When an update is due after one at `now`.
  usec_t NextUpdateAfter(usec_t now) const {
    return interval > 1 ? (now / interval + 1) * interval : now + interval;
  }
  /// The simulated time of the last update; 0: there was none.
  usec_t GetLastUpdate() const { return updated_at_; }
  usec_t GetEnergyInterval() const { return kEnergyInterval; }
  /// Never: nobody takes note of who has read the data.
  bool DataIsFresh() const { return false; }
  /// A disabled model is not moved by its velocity.
  void Enable() { disabled = false; }
  void Disable() { disabled = true; }
  bool IsEnabled() const { return !disabled; }

  void Load(Worldfile* wf, int wf_entity);
  virtual void Load();
  void SetWorldfile(Worldfile* wf, int wf_entity);
  virtual void Save();
  void LoadBlock(Worldfile* wf, int entity);
  void InitControllers();
  /// Loads a plug-in for this model; `lib` is the text of a `ctrl` string. Its Init() is called
  /// with InitControllers(). Throws LoadError while a world is loaded; otherwise prints why not.
  void LoadControllerModule(const char* lib);

  /// Blocked at the last attempt to move.
  bool Stalled() const { return stall; }
  void SetStall(bool blocked) { stall = blocked; }

  // ---- callbacks ----

  /// Calls cb(model, user) at each event of the type, in the order of registration. A callback may
  /// make and delete models, this one included, and load, unload or delete the world. The pair
  /// (cb, user) is kept once. A callback that returns non-zero is removed.
  void AddCallback(callback_type_t type, model_callback_t cb, void* user);
  /// The same, of a callback that keeps to itself, so that those of several robots may be called by
  /// several threads at once: it looks at and changes nothing but the models of this model's tree
  /// and data that no other callback changes; it casts no rays, makes and deletes no models, moves
  /// none by hand, adds and removes no callbacks and subscribes to nothing. Callbacks of the same
  /// tree, and others, are still called one after the other, in their order. So the outcome is that
  /// of AddCallback(). CB_UPDATE makes use of it; callbacks of other types are called as ever.
  void AddParallelCallback(callback_type_t type, model_callback_t cb, void* user);
  /// Removes all entries with that function; returns how many entries remain.
  int RemoveCallback(callback_type_t type, model_callback_t callback);
  int CallCallbacks(callback_type_t type);

  /// Keeps data of a controller for as long as the model lives; and if a callback or Init() deletes
  /// the model, until that is over.
  void Adopt(const std::shared_ptr<void>& data);

  class cb_t {
   public:
    model_callback_t callback;
    void* arg;

    cb_t() : callback(NULL), arg(NULL) {}
    cb_t(model_callback_t cb, void* a) : callback(cb), arg(a) {}
    cb_t(world_callback_t cb, void* a)
        : callback(reinterpret_cast<model_callback_t>(reinterpret_cast<void (*)()>(cb))), arg(a) {}
    bool operator<(const cb_t& o) const {
      const std::less<model_callback_t> before;
      return callback == o.callback ? std::less<void*>()(arg, o.arg) : before(callback, o.callback);
    }
    bool operator==(const cb_t& o) const { return callback == o.callback; }
  };

  // ---- chance ----

  /// The model's own random numbers, for its controller: seeded by the world's seed and by the
  /// model's place, that is the how-manieth child of its type it was made as, of which parent.
  /// Neither other models' draws or names, nor other worlds, nor threads have a say in them. A
  /// parallel callback may draw from the streams of its own tree.
  RandomStream& random() { return random_.Get(); }

  // ---- appearance and visibility ----

  Color GetColor() const { return color; }
  void SetColor(Color col);

  void SetFiducialReturn(int fid);
  int GetFiducialReturn() const { return vis.fiducial_return; }
  void SetFiducialKey(int key);
  void SetObstacleReturn(bool val);
  void SetBlobReturn(bool val);
  void SetGripperReturn(bool val);
  void SetRangerReturn(double val);
  void SetBoundary(bool val) { boundary = val; }
  void SetMapResolution(meters_t res) { map_resolution = res; }
  void SetFriction(double f) { friction = f; }
  void SetGuiNose(bool val) { gui.nose = val; }
  void SetGuiMove(bool val) { gui.move = val; }
  void SetGuiGrid(bool val) { gui.grid = val; }
  void SetGuiOutline(bool val) { gui.outline = val; }
  void Say(const std::string& str) { say_string = str; }
  std::string GetSayString() { return say_string; }

  // Without a window, what follows does nothing.

  /// Not owned: it must live as long as it is attached. The first visualizer of a menu name decides
  /// whether the option is on at first.
  void AddVisualizer(Visualizer* custom_visual, bool on_by_default);
  void RemoveVisualizer(Visualizer* custom_visual);
  void NeedRedraw();
  void Redraw();
  /// A stack of colours, for drawing in Visualizer::Visualize().
  virtual void PushColor(Color col);
  virtual void PushColor(double r, double g, double b, double a);
  virtual void PopColor();

  // ---- energy and flags ----

  /// Power drawn while it has subscribers and a power pack.
  void SetWatts(watts_t w);
  /// Its own, or the nearest ancestor's that has one, or null.
  PowerPack* FindPowerPack() const;

  // Flags are not owned; null is ignored.

  void AddFlag(Flag* flag);   ///< at the end
  void PushFlag(Flag* flag);  ///< at the front
  Flag* PopFlag();            ///< from the front; null if there is none
  /// All occurrences.
  void RemoveFlag(Flag* flag);
  unsigned int GetFlagCount() const { return static_cast<unsigned int>(flag_list.size()); }

  // ---- state ----

  /// Lists all that decides the future of this model, see state_exchange.hh: its pose, its data,
  /// what was set. A type with data of its own overrides it and calls its parent class first. Used
  /// between steps.
  virtual void ExchangeState(StateExchange& exchange);

  /// What a controller remembers of this model from one step to the next belongs to the state too.
  /// `data` is plain: it holds no pointers, and no bytes that have no meaning. It must live as long
  /// as the model, see Adopt(). `name`: which of the model's this is, for messages.
  void KeepState(const std::string& name, void* data, size_t bytes);
  /// The same of something that lists what it remembers itself.
  void KeepState(const std::string& name, StateKeeper* keeper);
  /// A controller that remembers nothing says so.
  void KeepsNoState(const std::string& name);
  /// All of its controllers have said so, or keep their state.
  bool StateIsKept() const;

  /// Draws the body for rangers again if it was hidden from them and no longer is; true if so. For
  /// the library's own rooms, like the next one.
  bool ShowAgainToRangers();
  const BlockGroup& body() const { return *blockgroup; }
  /// Appends the cells of this model and all below it.
  void CollectDrawings(internal::grid::Drawings* drawings, bool exact) const;
  /// Remembers a body that is drawn while rangers look through it.
  void NoteDrawn();
  /// NoteDrawn() has nothing to do.
  bool is_noted() const { return !(vis.ranger_return < 0) || hidden_from_rangers_; }
  /// It is among those that NoteDrawn() remembers.
  bool is_hidden_from_rangers() const { return hidden_from_rangers_; }
  /// An update that was scheduled is still to happen. For the library's own rooms.
  bool ExpectsUpdate(uint64_t chain) const { return subs > 0 && chain == update_chain_; }
  /// What the world's models share.
  internal::sensing::Scene& scene() const { return *scene_; }

  // ---- for those who draw ----

  /// A place where the model has been.
  class TrailItem {
   public:
    usec_t time;
    Pose pose;  ///< global
    Color color;

    TrailItem(usec_t t, const Pose& p, const Color& c) : time(t), pose(p), color(c) {}
  };
  /// What to draw the body in now: lights may be on or off.
  virtual Color GetShownColor() const { return color; }
  /// Whether it may be dragged by the mouse.
  bool IsMovable() const { return gui.move; }
  bool HasGuiGrid() const { return gui.grid; }
  bool HasGuiNose() const { return gui.nose; }
  /// What Rasterize() gave last; kept only in worlds with a window.
  struct Raster {
    std::vector<uint8_t> cells;
    unsigned int width, height;
    meters_t cellwidth, cellheight;
  };
  const Raster* last_raster() const { return last_raster_.get(); }
  /// Whether children stand on top of it.
  bool StacksChildren() const { return stack_children; }
  /// The front is the one pushed last.
  const std::list<Flag*>& flags() const { return flag_list; }
  const std::vector<Visualizer*>& visualizers() const { return cv_list; }
  const std::string& speech() const { return say_string; }
  /// The number of items that a full trail has.
  unsigned int trail_capacity() const { return trail_length; }
  /// The trail, the oldest item first.
  std::vector<TrailItem> Trail() const;
  template <typename F>
  void ForEachTrailItem(F f) const {
    for (size_t i = 0; i < trail.size(); i++) f(trail[(trail_index + i) % trail.size()]);
  }
  /// The child's global pose, given this model's.
  Pose ChildGlobalPose(const Pose& global, const Model& child) const;
  /// The local pose that a child of this model has at `global`, while this model is at `frame`.
  Pose LocalPoseOf(const Pose& global, const Pose& frame) const;

 protected:
  friend class World;
  friend class Placement;
  friend class CallbackPhase;
  friend class GatherPhase;
  friend class MovePhase;
  friend class ModelPosition;
  friend class ModelRanger;
  friend const ModelType* FindModelType(const Model& model);

  struct GuiState {
    bool grid, move, nose, outline;
  };
  /// Each step of a world pays for this much time, microseconds.
  static const usec_t kEnergyInterval = 100000;

  virtual void Startup();
  virtual void Shutdown();
  /// One update. Overriding it, call Model::Update(), which schedules the next.
  virtual void Update();

  // What an update of one of the library's types does for itself, in parts, so that several threads
  // may do the same for many models. All models get ready; then all say what they add to the batch
  // of rays; then each fills in its own room there. Meanwhile each changes nothing but itself, and
  // looks at nothing that others change. GatherAlone() does it for one model.

  /// The sensing itself. Rays are listed.
  virtual void Gather(internal::sensing::FanList*) {}
  /// Returns what has to be there before that: some of these.
  virtual unsigned GetReady() { return 0; }
  static const unsigned kPartsThatLack = 1;  ///< FinishGettingReady() makes them
  static const unsigned kExactRays = 2;      ///< the bodies drawn for the exact ray model
  /// While no other thread does anything.
  virtual void FinishGettingReady() {}
  class SelfMasksToMake;
  /// Gather(), and what the listed fans take in the batch. Types that know that beforehand may do
  /// all in FillRoom(), without a list.
  virtual internal::sensing::BatchShare MeasureRoom(internal::sensing::FanList* fans,
                                                    SelfMasksToMake* masks);
  /// Puts the `count` fans from `first_fan` of the list, which MeasureRoom() has added, into the
  /// room. False if the layer of a fan is still to be made; it has kNoLayer then.
  virtual bool FillRoom(internal::sensing::BatchShare room, const internal::sensing::FanList& fans,
                        size_t first_fan, size_t count);
  void GatherAlone();

  /// The rest of an update, for what has to wait until the rays of the step are traced, such as
  /// changes of bodies. Called if Update() asked World::QueueSensed() for it, before bodies move.
  virtual void Sensed() {}
  /// One step of motion, of models that asked World::StartMoving() for it.
  virtual void Move() {}
  /// Notes the present pose, for GetSensedPose(). It is called for models that asked for Move(),
  /// after the updates of a step and before its moves, if a model of their tree has updated.
  /// Several threads may call it for different models at once.
  virtual void NoteSensed() {}

  /// Forgets the readings that ExchangeState() leaves out, see
  /// StateExchange::leaves_readings_out(): the world has gone back to a state whose readings nobody
  /// knows.
  virtual void DropReadings() { updated_at_ = 0; }
  /// See World::Reseed(): the model's random numbers are to follow from these two. A type with
  /// generators of its own overrides it and calls its parent class first.
  virtual void Reseed(uint64_t seed);
  /// Draws what a new model of this type takes from World::random(): see World::BeginAgain(). A
  /// type whose constructor draws overrides it.
  virtual void DrawAtBeginning() {}
  /// Makes the model's random numbers begin as those of a new model do that is number `index` of
  /// its type below its parent.
  void RestartRandomNumbers(unsigned index);

  /// The model's share in the world's energy phase; see power_pack.hh.
  virtual void UpdateCharge();

  /// Adds the unrelated models whose outlines share a cell with one of this model's own blocks,
  /// whatever their height, in the order of creation.
  void AppendTouchingModels(std::vector<Model*>* touching) const;
  /// Load() and Save() of this class, for those of others, which go on afterwards: false if they
  /// shall not, as there is no world file, or as a callback has deleted the model.
  bool LoadCommon();
  bool SaveCommon();
  /// Calls the callbacks; false if one has deleted the model.
  bool SurvivesCallbacks(callback_type_t t);

  /// Writes down where the model is, over the oldest item if the trail is full.
  void UpdateTrail();
  void RegisterOption(Option* option);

  /// Draws the model's body, and those of its descendants, where they are now.
  void Map();
  void UnMapWithChildren();
  /// Places a fan of rays that may stop at anything, and picks its layer of the grid.
  void PlaceFan(internal::sensing::Fan* fan, const Pose& origin, meters_t range, RayModel model);
  /// For the errors of a device that is called so: another one for each device of a world.
  uint64_t NoiseSeed(const std::string& device) const;

  struct Charged {
    std::shared_ptr<bool> charging;  // whether it is, which the pack shares
    uint32_t model;                  // the number of that whose pack it is; perhaps gone
  };

  bool alwayson;
  bool boundary;
  Color color;
  std::vector<Visualizer*> cv_list;
  std::list<Flag*> flag_list;
  double friction;
  GuiState gui;
  bool has_default_block;
  uint32_t id;
  meters_t map_resolution;
  kg_t mass;
  std::vector<Charged> charging_;  // the packs that this model charged in its last update
  std::string say_string;
  std::vector<TrailItem> trail;  // once it is full, trail_index is the oldest item
  unsigned int trail_index, trail_length, trail_interval;
  const std::string type;
  bool used;
  watts_t watts, watts_give, watts_take;
  Worldfile* wf;
  int wf_entity;

  // What steps look at, from here on: next to each other, as the models of a step don't fit into
  // the processor's caches.
  std::unique_ptr<PowerPack> power_pack;
  bool disabled;
  bool stack_children;
  bool stall;
  unsigned int subs;
  usec_t interval;
  mutable const ModelType* known_type_;  // that FindModelType() has found; or null
  std::unique_ptr<BlockGroup> blockgroup;
  World* world;
  Pose pose;
  Geom geom;
  Model* parent;
  Model* root;

 public:
  Visibility vis;

 private:
  struct Callback {
    model_callback_t function;  // null: struck out
    void* user;
    callback_type_t type;
    bool parallel;  // it may be called while those of other trees are
    bool operator==(const Callback& o) const {
      return function == o.function && user == o.user && type == o.type;
    }
  };
  struct Callbacks {
    std::vector<Callback> all;  // in the order of registration
    bool orphaned = false;      // the model is gone
    int rounds = 0;             // in progress
    struct Round;
    int CountLeft(callback_type_t t) const;
    void Tidy();
  };

  struct KeptState {
    std::string name;
    void* data;
    size_t bytes;
    StateKeeper* keeper;  // null: `bytes` at `data`
  };
  void ExchangeSubscriptions(StateExchange& exchange);
  void ExchangeEnergy(StateExchange& exchange);
  void ExchangeCallbacks(StateExchange& exchange);
  void ExchangeFlags(StateExchange& exchange);
  void ExchangeMarks(StateExchange& exchange);
  void CarryFlags(uint64_t count);
  /// Above it, where its children stand.
  double StandOnZ() const { return stack_children ? geom.size.z : 0; }
  void AddKeptState(const KeptState& kept);
  void MoveTo(Model* newparent);
  void ExchangeKeptState(StateExchange& exchange);
  void Leave();
  void LoadEnergy();
  void LoadBody();
  void LoadPicture(bool keeps_frame);
  void LoadGuiState();
  void LoadName();
  void TakeName(const std::string& name);
  void LoadTrail();
  void LoadControllers();
  void AddBoundary();
  void SetRoot(Model* new_root);
  unsigned int Height() const;
  /// The global pose of what stands on this model, which is at `global`, at a local pose.
  Pose PlacedOnThis(const Pose& global, const Pose& local) const;
  static Model* FitParent(const World& world, Model* parent);
  bool RefusesParent(const Model& newparent) const;
  void InitOrThrow();
  template <typename F>
  int CallEach(callback_type_t t, F call);
  /// The same alone; valid until the thread's next call.
  const internal::grid::Drawings& OwnDrawings(bool exact) const;
  void StopCharging();
  void ScheduleUpdate();
  bool HasCallbacks(callback_type_t t) const {
    if (callbacks_.get() == NULL) return false;
    for (const Callback& entry : callbacks_->all)
      if (entry.type == t) return true;
    return false;
  }
  void AddCallback(const Callback& entry);

  struct SelfMasks;

  internal::sensing::Scene* scene_;
  std::shared_ptr<Callbacks> callbacks_;   // most models have none
  std::unique_ptr<SelfMasks> self_masks_;  // only of roots that carry ray sensors
  uint64_t update_chain_;                  // a pending update of an older chain is void
  usec_t updated_at_;                      // simulated time; 0: not yet
  uint32_t tree_updated_in_;               // of a root: Host::steps_begun at the tree's last update
  uint64_t callback_run_;                  // of a root: the last one with callbacks of its tree
  bool serial_update_callbacks_;           // has had one of CB_UPDATE that may not be parallel
  bool hidden_from_rangers_;               // its body was drawn while rangers looked through it
  bool loaded_;                            // not for the first time, if it loads again
  bool shares_name_;                       // another model had its name before
  bool drives_ = false;                    // it is a ModelPosition
  uint16_t controllers_;                   // loaded
  LazyRandomStream random_;
  std::unique_ptr<Raster> last_raster_;
  // Most models have neither.
  std::forward_list<std::shared_ptr<void> > adopted_;
  std::forward_list<KeptState> kept_state_;  // in the order of the calls
};

/// A plug-in's entry point gets one of these; both strings belong to this entry and are writable.
struct CtrlArgs {
  std::string worldfile;  ///< the whole `ctrl` string, library name included
  std::string cmdline;    ///< the text of --args

  CtrlArgs(std::string w, std::string c) : worldfile(std::move(w)), cmdline(std::move(c)) {}
};

}  // namespace Stg

#endif
