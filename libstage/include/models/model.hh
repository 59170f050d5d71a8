// SPDX-License-Identifier: GPL-2.0-or-later
//
// Model: an object in a world. Part of <stage.hh>.
//
// Lengths are in metres, angles in radians, times in microseconds of simulated time. Passing or
// returning a pointer never transfers ownership. Functions do not throw unless stated.

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

#include "geometry/geometry.hh"
#include "grid/ray_model.hh"
#include "models/ancestor.hh"
#include "models/world_base.hh"
#include "pictures/color.hh"
#include "random/random.hh"
#include "sensing/ray_hit.hh"

namespace Stg {

class BatchControls;
class BlockGroup;
class CallbackPhase;
class ContactPhase;
struct ContactOutline;
class GatherPhase;
class MovePhase;
class ModelRanger;
struct ModelType;
class Option;
class PowerPack;
class RowBridge;
class StateExchange;
class StateKeeper;
class Visualizer;
class Worldfile;
namespace internal {
namespace sensing {
class DirectionTables;
class FanList;
struct BatchSpace;
struct Fan;
struct Scene;
struct SelfMask;
}  // namespace sensing
namespace grid {
struct Rasterizations;
}
}  // namespace internal

/// Creates a model of one type. Model::name_map holds one for each type name.
typedef Model* (*creator_t)(World* world, Model* parent, const std::string& type);

/// How sensors and other bodies perceive a model.
class Visibility {
 public:
  bool blob_return;
  int fiducial_key;
  int fiducial_return;
  bool gripper_return;
  bool obstacle_return;
  double ranger_return;  ///< intensity; negative: invisible to rangers

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

class Model;

/// A place where two bodies touch: their outlines are nearer to each other
/// than 0.8 mm.
struct ContactPoint {
  Model *a, *b;    ///< a: one that can move; b: another one, or a model that stays where it is
  point_t point;   ///< global, halfway between the outlines
  point_t normal;  ///< unit vector from a to b
  meters_t gap;    ///< distance of the outlines, usually 0.4 mm
};

class Model : public Ancestor {
 public:
  class Flag;
  // For sensors that cast rays: see AddRays().
  typedef internal::sensing::FanList FanList;
  typedef internal::sensing::RayHits RayHits;
  typedef internal::sensing::RaySink RaySink;

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
    __CB_TYPE_COUNT,  ///< of Stage's own types
    CB_CONTACT,  ///< the tree touches something after a step; in roots, with contacts of outlines
  } callback_type_t;

  /// Maximum number of ancestors of a model.
  static const unsigned int kMaxDepth = 1000;
  [[deprecated("use kMaxDepth")]] static const unsigned int kDeepest = kMaxDepth;

  /// The known types. Clients may add their own after Init() and before loading a world.
  /// RegisterModelType() is possible at any time and describes types more fully.
  static std::map<std::string, creator_t> name_map;

  /// Registers the model with its world and parent (null: top level). An empty name is replaced by
  /// "type:n", prefixed with "parent." for children. The body is one block of the default size. If
  /// the parent has kMaxDepth ancestors, the model is placed at the top level, with a message.
  Model(World* world, Model* parent = NULL, const std::string& type = "model",
        const std::string& name = "");
  virtual ~Model();

  // ---- names and the tree ----

  /// Former names remain valid for World::GetModel().
  void SetToken(const std::string& str) override;
  const std::string& GetModelType() const { return type; }
  /// Unique in the world: the ground has 0, models of a file follow in its order.
  uint32_t GetId() const { return id; }
  /// Finds a model by id in the listed worlds, oldest first; null if there is none. With several
  /// worlds use World::FindModel().
  static Model* LookupId(uint32_t id);
  std::string PoseString() { return GetPose().String(); }
  /// Prints the names of the model and its descendants, one per line.
  virtual void Print(char* prefix) const;
  /// "name @ [x,y,z,a]", global. Valid until this thread's next call.
  virtual const char* PrintWithPose() const;

  World* GetWorld() const { return world; }
  Model* Parent() const { return parent; }
  Model* Root() { return root; }
  const Model* Root() const { return root; }
  /// True if the model is a ModelPosition.
  bool Drives() const { return drives_; }
  /// Returns the model called "<token>.<name>"; null with a warning if there is none.
  Model* GetChild(const std::string& name) const;
  /// Returns the first model of the type among this one and its descendants that was not returned
  /// before, and marks it. Null if there is none, with a warning at top level.
  Model* GetUnusedModelOfType(const std::string& type);
  /// Like GetUnusedModelOfType(), for models without subscribers, and without marking.
  Model* GetUnsubscribedModelOfType(const std::string& type) const;
  bool IsAntecedent(const Model* testmod) const;
  bool IsDescendent(const Model* testmod) const;
  /// True if both are in the same top-level tree. A model is related to itself.
  bool IsRelated(const Model* testmod) const { return root == testmod->root; }
  /// Number of ancestors.
  unsigned int Depth() const;
  /// Changes the parent (null: top level) and keeps the global pose. Refused with a message,
  /// returning 1, if the new parent is a descendant or models would be nested too deeply.
  int SetParent(Model* newparent);
  void BecomeParentOf(Model* child);

  // ---- pose, geometry, body ----

  Pose GetPose() const { return pose; }
  Pose GetGlobalPose() const override;
  // A step senses first and then moves, so its readings belong to the poses before its moves.
  // GetSensedPose() and GetSensedLocalPose() return those poses, for the last step in which a model
  // of this tree updated.

  /// In world coordinates.
  virtual Pose GetSensedPose() const;
  /// In the parent's frame.
  virtual Pose GetSensedLocalPose() const { return pose_before_push_ ? *pose_before_push_ : pose; }
  /// Relative to the parent. Does not test collisions. Refused with a message if not finite.
  void SetPose(const Pose& pose);
  void SetGlobalPose(const Pose& gpose);
  void AddToPose(const Pose& pose);
  void AddToPose(double dx, double dy, double dz, double da);
  Geom GetGeom() const { return geom; }
  /// Refused with a message if a number is not finite.
  void SetGeom(const Geom& src);
  /// Transforms a global pose into this model's frame, ignoring the body's offset (geom.pose).
  Pose GlobalToLocal(const Pose& pose) const;
  /// Transforms from the body's frame, including its offset, so it is not the inverse of
  /// GlobalToLocal() if there is an offset.
  Pose LocalToGlobal(const Pose& pose) const;
  point_t LocalToGlobal(const point_t& pt) const;
  std::vector<point_int_t> LocalToPixels(const std::vector<point_t>& local) const;

  /// Refused with a message if a number is not finite.
  void AddBlockRect(meters_t x, meters_t y, meters_t dx, meters_t dy, meters_t dz);
  void ClearBlocks();
  /// Marks the cells of a raster, centred on the body, that the body's outlines cross. Row 0 has
  /// the smallest y.
  void Rasterize(uint8_t* data, unsigned int width, unsigned int height, meters_t cellwidth,
                 meters_t cellheight);
  /// True if the body, or a descendant's, overlaps an obstacle now.
  bool HasCollision();
  /// Tries random poses in the rectangle until one is free. Gives up after max_iter further ones
  /// (0: never), or immediately with a message if the rectangle is not finite.
  bool RandomPoseInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                             size_t max_iter = 0);
  /// Like RandomPoseInFreeSpace(), but keeps the present pose if that is free.
  bool PlaceInFreeSpace(meters_t xmin, meters_t xmax, meters_t ymin, meters_t ymax,
                        size_t max_iter = 0);
  kg_t GetTotalMass() const;
  kg_t GetMassOfChildren() const;
  /// SetMass(), SetRangerReturn() and SetWatts() refuse non-finite values with a message; SetMass()
  /// and SetWatts() also negative ones.
  void SetMass(kg_t m);

  // ---- life cycle ----

  /// Subscriptions are counted; only models with subscribers produce data. A model updates in the
  /// first step at or after each multiple of its interval, whenever it was subscribed to, so models
  /// with equal intervals update together.
  void Subscribe();
  void Unsubscribe();
  unsigned int GetSubscriptionCount() const { return subs; }
  bool HasSubscribers() const { return subs > 0; }
  usec_t GetInterval() { return interval; }
  usec_t GetUpdateInterval() const { return interval; }
  /// Time of the first due update after one at `now`.
  usec_t NextUpdateAfter(usec_t now) const {
    return interval > 1 ? (now / interval + 1) * interval : now + interval;
  }
  /// Simulated time of the last update; 0 if none.
  usec_t GetLastUpdate() const { return updated_at_; }
  usec_t GetEnergyInterval() const { return kEnergyInterval; }
  /// Always false: reads of the data are not tracked.
  bool DataIsFresh() const { return false; }
  /// A disabled model does not move.
  void Enable() { disabled = false; }
  void Disable() { disabled = true; }
  bool IsEnabled() const { return !disabled; }

  void Load(Worldfile* wf, int wf_entity);
  virtual void Load();
  void SetWorldfile(Worldfile* wf, int wf_entity);
  virtual void Save();
  void LoadBlock(Worldfile* wf, int entity);
  void InitControllers();
  /// Loads a plug-in for this model; `lib` is the text of a `ctrl` string. InitControllers() calls
  /// its Init(). On failure throws LoadError while a world is loaded, otherwise prints the reason.
  void LoadControllerModule(const char* lib);

  /// True if the last attempt to move was blocked.
  bool Stalled() const { return stall; }
  void SetStall(bool blocked) { stall = blocked; }

  // ---- callbacks ----

  /// Calls cb(model, user) at each event of the type, in registration order. A callback may create
  /// and delete models, including this one, and load, unload or delete the world. Adding a pair
  /// (cb, user) again has no effect. A callback that returns non-zero is removed.
  void AddCallback(callback_type_t type, model_callback_t cb, void* user);
  /// Like AddCallback(), for callbacks that may run in parallel with those of other robots. Such a
  /// callback may only access models of this model's tree and data that no other callback changes.
  /// It must not cast rays, create, delete or place models, change callbacks, or subscribe.
  /// Callbacks of one tree, and all others, still run one after the other, so results equal those
  /// of AddCallback(). Only CB_UPDATE callbacks run in parallel.
  void AddParallelCallback(callback_type_t type, model_callback_t cb, void* user);
  /// Removes all entries with that function. Returns how many entries of the type remain.
  int RemoveCallback(callback_type_t type, model_callback_t callback);
  int CallCallbacks(callback_type_t type);
  bool HasCallbacks(callback_type_t t) const {
    return callbacks_.get() != NULL && callbacks_->Have(t);
  }

  /// Keeps data of a controller alive as long as the model; and if a callback or Init() deletes the
  /// model, until that function has returned.
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

  // ---- random numbers ----

  /// The model's random numbers, for its controller. Seeded from the world's seed, the model's
  /// parent, and its index among siblings of the same type at creation. Independent of names, other
  /// models, other worlds and threads. A parallel callback may use the generators of its own tree.
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
  /// Coulomb coefficient of the surface. That of a contact is the mean of both bodies'. Used with
  /// contacts of outlines. Refused with a message if it is negative or not finite.
  void SetFriction(double f);
  double GetFriction() const { return friction; }
  /// Whether other bodies can push the model, with contacts of outlines. Only models at the top
  /// level are pushed, together with their children.
  void SetPushable(bool pushable);
  bool IsPushable() const { return pushable_; }
  /// Coefficient of friction between the model and the floor. Its weight times that is the force
  /// that it takes to push the model, or with which a robot can push others. Negative: the default,
  /// see docs/motion.md.
  void SetFloorFriction(double f);
  /// The coefficient in force: the default if none was set.
  double GetFloorFriction() const;
  /// Calls f for each place where the tree of this model touches something at its present pose; `a`
  /// is the root of this tree. With contacts of cells there are none. Not for parallel callbacks.
  void ForEachContact(const std::function<void(const ContactPoint&)>& f) const;
  void SetGuiNose(bool val) { gui.nose = val; }
  void SetGuiMove(bool val) { gui.move = val; }
  void SetGuiGrid(bool val) { gui.grid = val; }
  void SetGuiOutline(bool val) { gui.outline = val; }
  void Say(const std::string& str) { say_string = str; }
  std::string GetSayString() { return say_string; }

  // The following functions have no effect without a window.

  /// Does not take ownership: the visualizer must live as long as it is attached. The first
  /// visualizer with a menu name decides whether the option is initially on.
  void AddVisualizer(Visualizer* custom_visual, bool on_by_default);
  void RemoveVisualizer(Visualizer* custom_visual);
  void NeedRedraw();
  void Redraw();
  /// A stack of colours for drawing in Visualizer::Visualize().
  virtual void PushColor(Color col);
  virtual void PushColor(double r, double g, double b, double a);
  virtual void PopColor();

  // ---- energy and flags ----

  /// Power drawn while the model has subscribers and a power pack.
  void SetWatts(watts_t w);
  /// The model's power pack, or that of the nearest ancestor with one, or null.
  PowerPack* FindPowerPack() const;

  // Does not take ownership of flags; ignores null.

  void AddFlag(Flag* flag);   ///< at the end
  void PushFlag(Flag* flag);  ///< at the front
  Flag* PopFlag();            ///< from the front; null if there is none
  /// Removes all occurrences.
  void RemoveFlag(Flag* flag);
  unsigned int GetFlagCount() const { return static_cast<unsigned int>(flag_list.size()); }

  // ---- state ----

  /// Enumerates everything that decides the future of this model, see state_exchange.hh: pose,
  /// data, settings. Types with own data override it and call the base class first. Called between
  /// steps.
  virtual void ExchangeState(StateExchange& exchange);

  /// Declares data that a controller keeps from one step to the next as part of the state. `data`
  /// must be plain bytes without pointers or padding, and live as long as the model, see Adopt().
  /// `name` identifies the data in messages.
  void KeepState(const std::string& name, void* data, size_t bytes);
  /// Like KeepState() above, for a keeper that enumerates its state itself.
  void KeepState(const std::string& name, StateKeeper* keeper);
  /// Declares that a controller keeps no state.
  void DeclareNoState(const std::string& name);
  [[deprecated("use DeclareNoState()")]] void KeepsNoState(const std::string& name) {
    DeclareNoState(name);
  }
  /// True if every controller has called KeepState() or DeclareNoState().
  bool DeclaresState() const;
  [[deprecated("use DeclaresState()")]] bool StateIsKept() const { return DeclaresState(); }

  /// Makes the body visible to rangers again after ranger_return was negative. Returns true if it
  /// did. Internal, like CollectRasterizations().
  bool RestoreRangerVisibility();
  const BlockGroup& body() const { return *blockgroup; }
  /// Appends the cells of this model and its descendants.
  void CollectRasterizations(internal::grid::Rasterizations* rasterizations, bool exact) const;
  /// Notes that the tree has got another outline for contacts. Internal.
  void NoteOutlineChange();
  /// Registers a body that is rasterized while invisible to rangers.
  void RegisterIfHidden();
  /// True if RegisterIfHidden() has nothing to do.
  bool is_registered_or_visible() const { return !(vis.ranger_return < 0) || hidden_from_rangers_; }
  /// True if registered by RegisterIfHidden().
  bool is_hidden_from_rangers() const { return hidden_from_rangers_; }
  /// True if the scheduled update with this number is still valid. Internal.
  bool ExpectsUpdate(uint64_t generation) const {
    return subs > 0 && generation == update_generation_;
  }
  /// The part of the world that models use.
  WorldBase& world_base() const { return *world_base_; }
  /// The running world. Internal.
  Host& host() const { return world_base_->host(); }
  /// The ancestor whose child this model is.
  Ancestor& ParentOrWorld();
  /// The scene that the world's models share.
  internal::sensing::Scene& scene() const { return *scene_; }

  // ---- for renderers ----

  /// A former pose of the model.
  class TrailItem {
   public:
    usec_t time;
    Pose pose;  ///< global
    Color color;

    TrailItem(usec_t t, const Pose& p, const Color& c) : time(t), pose(p), color(c) {}
  };
  /// Colour of the body now: lights may be on or off.
  virtual Color GetShownColor() const { return color; }
  /// True if the model may be dragged with the mouse.
  bool IsMovable() const { return gui.move; }
  bool HasGuiGrid() const { return gui.grid; }
  bool HasGuiNose() const { return gui.nose; }
  /// The last result of Rasterize(); kept only in worlds with a window.
  struct Raster {
    std::vector<uint8_t> cells;
    unsigned int width, height;
    meters_t cellwidth, cellheight;
  };
  const Raster* last_raster() const { return last_raster_.get(); }
  /// True if children stand on top of the model.
  bool StacksChildren() const { return stack_children; }
  /// Front: the flag pushed last.
  const std::list<Flag*>& flags() const { return flag_list; }
  const std::vector<Visualizer*>& visualizers() const { return cv_list; }
  const std::string& speech() const { return say_string; }
  /// Length of a full trail.
  unsigned int trail_capacity() const { return trail_length; }
  /// The trail, oldest item first.
  std::vector<TrailItem> Trail() const;
  template <typename F>
  void ForEachTrailItem(F f) const {
    for (size_t i = 0; i < trail.size(); i++) f(trail[(trail_index + i) % trail.size()]);
  }
  /// Global pose of the child if this model were at `global`.
  Pose ChildGlobalPose(const Pose& global, const Model& child) const;
  /// Pose relative to this model of a child at `global` while this model is at `frame`.
  Pose LocalPoseOf(const Pose& global, const Pose& frame) const;

 protected:
  friend class World;
  friend class Placement;
  friend class CallbackPhase;
  friend class GatherPhase;
  friend class MovePhase;
  friend class ContactPhase;
  friend class BatchControls;
  friend class CommandCheck;
  friend class RowBridge;
  friend struct ContactOutline;
  friend class StepCostMeter;
  friend class ModelPosition;
  friend class ModelRanger;
  friend const ModelType* FindModelType(const Model& model);

  struct GuiState {
    bool grid, move, nose, outline;
  };
  /// Energy is drawn for this much time per step, in microseconds, whatever the step's length.
  static const usec_t kEnergyInterval = 100000;

  virtual void Startup();
  virtual void Shutdown();
  /// Does one update. Overrides must call Model::Update(), which schedules the next one.
  virtual void Update();

  // Updates of the library's types are split into stages so that several threads can process many
  // models. First all models run Preparations(), then all measure the space that they need in the
  // batch of rays, then each fills in its space. In each stage a model changes only itself and
  // reads nothing that others change. GatherSerially() runs the stages for one model.

  /// Senses, and adds rays to the list.
  virtual void Gather(internal::sensing::FanList*) {}
  /// Returns which of the following preparations are needed first.
  virtual unsigned Preparations() { return 0; }
  static const unsigned kNeedsPreparation = 1;  ///< FinishPreparation() must run
  static const unsigned kExactRays = 2;         ///< bodies must be rasterized for the exact ray
                                                ///< model
  /// Runs while no other thread is active.
  virtual void FinishPreparation() {}
  class PendingSelfMasks;
  /// Calls Gather() and returns the space that the listed fans need in the batch. Types that know
  /// it in advance may do all work in FillSpace(), without a list.
  virtual internal::sensing::BatchSpace MeasureSpace(internal::sensing::FanList* fans,
                                                     PendingSelfMasks* masks);
  /// Writes the `count` fans of the list from `first_fan` on, which MeasureSpace() added, to the
  /// batch. Returns false if the layer of a fan must still be made; the fan has kNoLayer then.
  virtual bool FillSpace(internal::sensing::BatchSpace place,
                         const internal::sensing::FanList& fans, size_t first_fan, size_t count);
  void GatherSerially();

  /// Rays from a point, for AddRays().
  struct RayFan {
    Pose origin;           ///< global; its heading is the middle of the field of view
    meters_t range;        ///< if nothing is hit
    radians_t fov;         ///< from the first ray to the last one, counter-clockwise
    uint32_t rays;         ///< a single one points along the heading
    bool any_height;       ///< they also hit bodies above and below
    RaySink* sink;         ///< receives the hits when the batch is traced
    uint32_t tag;          ///< passed to the sink
    ray_test_func_t test;  ///< tells which models stop them

    RayFan() : range(0), fov(0), rays(1), any_height(false), sink(NULL), tag(0), test(NULL) {}
  };
  /// Adds rays to the list that Gather() got. They ignore the model's own tree if its type is
  /// registered with ModelType::kIgnoresOwnTree. A type with ModelType::kParallel also needs
  /// kUsesEverythingLayer.
  void AddRays(FanList* fans, const RayFan& fan);
  /// Traces the batch if it has rays of this model. The destructor of a sink must call it.
  void FinishRays();

  /// The part of an update that must wait until the step's rays are traced, such as changing
  /// bodies. Called before moves, if Update() added the model to Host::sensed.
  virtual void Sensed() {}
  /// Moves by one step. Called for models that called Host::StartMoving(), unless their type is
  /// registered with ModelType::kMovesTree and they are at the top level.
  virtual void Move() {}

  // Models of a type with ModelType::kMovesTree move in two stages, so that several threads can
  // move many of them, and so that bodies can touch. Each stage only accesses this model's tree.

  /// Where a model wants to be after a step.
  struct WantedMove {
    Pose pose;          ///< in the parent's frame
    radians_t turn;     ///< the angle of the turn, which may exceed half a turn
    Velocity velocity;  ///< in the body frame
  };
  /// Returns false if the model stays, such as one without a velocity.
  virtual bool GetWantedMove(WantedMove*) { return false; }
  /// Called after each wanted move. `made` is the velocity of the motion that was made, in the body
  /// frame; zero if the move was refused.
  virtual void EndMove(const Velocity& /*made*/) {}
  /// Moves this model's tree, or not if that would end in an obstacle.
  void MoveTree();
  /// True if the next move does nothing.
  virtual bool StaysStill() const { return false; }
  /// Stores the present pose for GetSensedPose(). Called for moving models after the updates and
  /// before the moves of a step in which a model of their tree updated. Several threads may call it
  /// for different models at once.
  virtual void StoreSensedPose() {}

  /// Deletes the readings that ExchangeState() omits, see StateExchange::omits_readings(): the
  /// restored state does not contain them.
  virtual void DropReadings() { updated_at_ = 0; }
  /// See World::Reseed(). Makes random numbers depend on their current seed and this one. Types
  /// with their own generators override it and call the base class first.
  virtual void Reseed(uint64_t seed);
  /// Draws the random numbers that the constructor of this type takes from World::random(): see
  /// World::BeginAgain(). Overridden by types whose constructor does so.
  virtual void DrawInitialRandomNumbers() {}
  /// Restarts the model's random numbers as those of a new model with index `index` among siblings
  /// of its type.
  void RestartRandomNumbers(unsigned index);

  /// The model's part in the energy phase; see power_pack.hh.
  virtual void UpdateCharge();

  /// Appends the unrelated models whose outlines share a cell with one of this model's own blocks,
  /// at any height, in the order of creation.
  void AppendTouchingModels(std::vector<Model*>* touching) const;
  /// Load() and Save() for derived classes. Return false if the caller must stop, because there is
  /// no world file or a callback has deleted the model.
  bool LoadCommon();
  bool SaveCommon();
  /// Calls the callbacks. Returns false if one has deleted the model.
  bool SurvivesCallbacks(callback_type_t t);

  /// Records the current pose, overwriting the oldest item if the trail is full.
  void UpdateTrail();
  void RegisterOption(Option* option);

  /// Rasterizes the bodies of the model and its descendants at their current poses.
  void Map();
  void UnMapWithChildren();
  /// Initializes a fan of rays that may hit anything, and selects its grid layer.
  void PlaceFan(internal::sensing::Fan* fan, const Pose& origin, meters_t range, RayModel model);
  /// Seed for the noise of a device; differs for each device name of a world.
  uint64_t NoiseSeed(const std::string& device) const;

  struct Charged {
    std::shared_ptr<bool> charging;  // shared with the pack: whether it is charging
    uint32_t model;                  // id of the pack's model, which may be deleted
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
  std::vector<Charged> charging_;  // packs that this model charged in its last update
  std::string say_string;
  std::vector<TrailItem> trail;  // ring buffer: once full, trail_index is the oldest item
  unsigned int trail_index, trail_length, trail_interval;
  const std::string type;
  bool used;
  watts_t watts, watts_give, watts_take;
  Worldfile* wf;
  int wf_entity;
  World* world;

  // Members used in each step are adjacent from here on, because the models of a step exceed the
  // processor's caches.
  std::unique_ptr<PowerPack> power_pack;
  bool disabled;
  bool stack_children;
  bool stall;
  unsigned int subs;
  usec_t interval;
  mutable const ModelType* known_type_;  // result of FindModelType(), or null
  std::unique_ptr<BlockGroup> blockgroup;
  WorldBase* world_base_;  // same object as world
  Pose pose;
  Geom geom;
  Model* parent;
  Model* root;

 public:
  Visibility vis;

 private:
  struct Callback {
    model_callback_t function;  // null: removed
    void* user;
    callback_type_t type;
    bool parallel;  // may be called in parallel with those of other trees
    bool operator==(const Callback& o) const {
      return function == o.function && user == o.user && type == o.type;
    }
  };
  struct Callbacks {
    std::vector<Callback> all;   // in registration order
    bool model_deleted = false;  // the model has been deleted
    int rounds = 0;              // number of loops in progress
    struct Round;
    bool Have(callback_type_t t) const {
      for (const Callback& entry : all)
        if (entry.type == t) return true;
      return false;
    }
    int CountLeft(callback_type_t t) const;
    void Tidy();
  };

  struct KeptState {
    std::string name;
    void* data;
    size_t bytes;
    StateKeeper* keeper;  // null: `bytes` at `data`
  };
  static const uint32_t kNoRow = 0xffffffff;
  static const int8_t kRoundIfRegular = -1;
  void ExchangeContacts(StateExchange& exchange);
  void LoadContacts();
  void LoadRoundBody();
  void ExchangeSubscriptions(StateExchange& exchange);
  void ExchangeEnergy(StateExchange& exchange);
  void ExchangeCallbacks(StateExchange& exchange);
  void ExchangeFlags(StateExchange& exchange);
  void ExchangeLoadFlags(StateExchange& exchange);
  void SetFlagCount(uint64_t count);
  /// Height above the origin at which children stand.
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
  void AssignName(const std::string& name);
  void LoadTrail();
  void LoadControllers();
  void AddBoundary();
  void SetRoot(Model* new_root);
  unsigned int Height() const;
  /// Global pose of a child at local pose `local`, while this model is at `global`.
  Pose PlacedOnThis(const Pose& global, const Pose& local) const;
  static Model* LimitDepth(const WorldBase& world, Model* parent);
  void RegisterName(const std::string& name);
  bool RefusesParent(const Model& newparent) const;
  void InitOrThrow();
  template <typename F>
  int CallEach(callback_type_t t, F call);
  /// CollectRasterizations() into a buffer that is valid until the thread's next call.
  const internal::grid::Rasterizations& OwnRasterizations(bool exact) const;
  void StopCharging();
  void ScheduleUpdate();
  void AddCallback(const Callback& entry);

  struct SelfMasks;

  internal::sensing::Scene* scene_;
  std::shared_ptr<Callbacks> callbacks_;   // null for most models
  std::unique_ptr<SelfMasks> self_masks_;  // only in roots with ray sensors
  uint64_t update_generation_;             // pending updates of an older generation are void
  usec_t updated_at_;                      // simulated time; 0: never
  uint32_t tree_updated_in_;               // in roots: Host::steps_begun at the tree's last update
  uint64_t callback_interval_;             // in roots: the last interval with callbacks of the tree
  bool serial_update_callbacks_;           // a CB_UPDATE callback is not parallel
  bool hidden_from_rangers_;               // body was rasterized while invisible to rangers
  bool loaded_;                            // Load() has run
  bool shares_name_;                       // another model had this name before
  bool drives_ = false;                    // the model is a ModelPosition
  bool pushable_ = false;
  int8_t round_ = kRoundIfRegular;  // see ContactOutline
  double floor_friction_ = -1;      // negative: the default
  uint32_t contact_row_ = kNoRow;   // in roots: its row in the columns of motion
  // The pose before the last step, in pushable models that are no robots. See GetSensedPose().
  std::unique_ptr<Pose> pose_before_push_;
  uint16_t controllers_;            // number loaded
  uint16_t batch_controllers_ = 0;  // those of them that are batch controllers
  LazyRandomStream random_;
  std::unique_ptr<Raster> last_raster_;
  // Empty for most models.
  std::forward_list<std::shared_ptr<void> > adopted_;
  std::forward_list<KeptState> kept_state_;  // in the order of the calls
};

/// Argument of a plug-in's entry point. Both strings belong to this entry and may be modified.
struct CtrlArgs {
  std::string worldfile;  ///< the whole `ctrl` string, including the library name
  std::string cmdline;    ///< the text of --args

  CtrlArgs(std::string w, std::string c) : worldfile(std::move(w)), cmdline(std::move(c)) {}
};

}  // namespace Stg

#endif
