// SPDX-License-Identifier: GPL-2.0-or-later
//
// Interface of the running world to its models, below World's public interface: the shared scene,
// and the lists of models that are due. Implemented by WorldEngine.

#ifndef STAGE_MODELS_HOST_HH
#define STAGE_MODELS_HOST_HH

#include <algorithm>
#include <atomic>
#include <deque>
#include <forward_list>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/body.hh"
#include "models/flag.hh"
#include "models/memory_budget.hh"
#include "models/model.hh"
#include "models/model_names.hh"
#include "models/placement.hh"
#include "models/power_pack.hh"
#include "motion/contact_model.hh"
#include "sensing/scene.hh"

namespace Stg {

class DeletionWatch;
class FiducialIndex;
class ModelField;
class ModelGroundSensor;
class ModelRanger;
class LightIndex;
class ModelWifi;
class RadioTraffic;

namespace picture {
struct Outlines;
struct Samples;
}  // namespace picture

/// Numbers of a model's successive scheduled updates. Numbers of different models differ, even if
/// the models were allocated at the same address.
struct UpdateGeneration {
  static uint64_t First(uint32_t model_id) { return uint64_t{model_id} << 32; }
  static uint64_t Next(uint64_t generation) {
    return (generation & ~uint64_t{0xffffffff}) | static_cast<uint32_t>(generation + 1);
  }
};

/// The base of a world. Defined by module `world`, as only that knows World.
WorldBase& BaseOf(World& world);
/// Searches all listed worlds, oldest first. Defined by module `world`, too.
Model* FindModelOfAnyWorld(uint32_t id);

/// Adds a model to a list of models in the order of creation, which is that of their ids.
template <typename T>
void InsertByAge(std::vector<T*>* models, T* model) {
  models->insert(std::ranges::upper_bound(*models, model->GetId(), {}, &Model::GetId), model);
}

/// Share its ownership to keep it alive: callbacks may delete the world.
class Host : public std::enable_shared_from_this<Host> {
 public:
  virtual ~Host() = default;

  // ---- the models ----

  std::vector<Model*> models;  ///< in the order of creation, the ground first
  ModelNames names;
  uint32_t next_model_id = 0;
  /// Flags that restoring a snapshot removed from models, to be reused for others.
  std::vector<Model::Flag*> spare_flags;
  std::deque<Model::Flag> own_flags;               ///< flags created for that
  uint64_t topology_version = 0;                   ///< counts added, removed and moved models
  std::vector<ModelWifi*> radios;                  ///< in the order of creation
  std::vector<ModelField*> fields;                 ///< in the order of creation
  std::vector<ModelGroundSensor*> ground_sensors;  ///< in the order of creation
  std::vector<ModelRanger*> sweeping_rangers;      ///< those with a scan that takes time
  FiducialIndex* fiducials = nullptr;              ///< candidates of fiducial finders; the engine's
  LightIndex* lights = nullptr;                    ///< all lights; the engine's
  DeletionWatch* watches = nullptr;                ///< list of all watches
  double max_dissipation = 0;       ///< joules in one square metre: see DissipationVis
  RadioTraffic* traffic = nullptr;  ///< messages of radios; the engine's
  bool listed = true;               ///< see RunOptions::listed
  bool loads_controllers = true;    ///< see RunOptions::controllers
  /// See RunOptions::pictures.
  std::shared_ptr<const std::map<std::string, std::string>> pictures;
  size_t controllers_left_out = 0;  ///< number not loaded for that reason
  size_t power_packs = 0;
  EnergyTotals energy_totals;
  std::vector<uint32_t> placed;  ///< ids of models that a pool places, see WorldPoolOptions
  /// A robot without subscribers has received a command: see ModelPosition::WarnIfNotSubscribed().
  /// Set by several threads.
  std::atomic<bool> command_without_subscriber{false};

  /// Returns null if there is no model with this id.
  Model* FindModel(uint32_t id) const;
  /// Finds a model by full name, including former names. Returns null with a warning if none.
  Model* GetModel(const std::string& name) const;
  /// Insert into a list sorted by id unless the model is in it, and erase if it is.
  static void Insert(std::vector<Model*>* list, Model* model);
  static void Erase(std::vector<Model*>* list, const Model* model);

  // ---- bodies and rays ----

  sensing::Scene scene;
  Placement placement;                      ///< for models that move serially
  std::vector<Model*> hidden_from_rangers;  ///< bodies rasterized while invisible to rangers

  /// Resolves kDefault to the world's ray model.
  bool IsExact(RayModel model) const {
    return (model == RayModel::kDefault ? scene.ray_model : model) == RayModel::kExact;
  }
  /// Rasterizes bodies for the exact ray model from now on. Does nothing if already done.
  void RasterizeForExactRays();
  /// Number of the cell at coordinate `x`, clamped to the valid range.
  int32_t MetersToPixels(meters_t x) const;

  /// Traces the rays in the batch. Call it before changing anything that rays may hit, and before
  /// callbacks, so that rays see the world as it was when the sensor updated, with or without a
  /// batch.
  virtual void TraceBatch() = 0;
  /// Like TraceBatch(), for destructors and others that must not throw. An exception is rethrown by
  /// the next TraceBatch(); the rays stay untraced.
  virtual void TraceBatchAndPostponeThrowing() noexcept = 0;
  /// Traces the batch if it has rays of this model, which is about to be deleted.
  void FinishRaysOf(const Model* finder);

  // ---- contacts ----

  ContactModel contact_model = ContactModel::kOutlines;
  bool contacts_changed = true;          ///< properties or outlines of unknown models have changed
  std::vector<Model*> changed_outlines;  ///< roots with other outlines than in the last step

  /// Prepares for IsBlocked(). Must be called before the model's pose is changed.
  virtual void PrepareMove() = 0;
  /// True if the model cannot go from its pose `before` to its present one, where its tree would be
  /// rasterized as in `placement`.
  virtual bool IsBlocked(const Model& model, const Pose& before, const Placement& placement) = 0;
  /// Notes that the outline of a tree has changed.
  void NoteOutlineChange(Model* root);
  size_t contact_callbacks = 0;  ///< number of CB_CONTACT callbacks that were ever added
  bool contacts_known = false;   ///< contacts have been found since a pose changed
  /// See Model::ForEachContact(). null: contacts of all trees.
  virtual void ForEachContact(const Model* root,
                              const std::function<void(const ContactPoint&)>& f) = 0;

  // ---- the steps ----

  std::vector<Model*> moving;  ///< models that asked to move, in the order of creation
  std::vector<Model*> energy;  ///< running models with a pack, in the same order
  std::vector<Model*> sensed;  ///< models whose Sensed() must be called
  std::vector<Model*> update_callbacks_due;  ///< models that updated in this step
  bool stepping = false;                     ///< a step is in progress
  uint32_t steps_begun = 0;                  ///< monotonic count of steps of this engine

  /// Schedules an update of a model. It is void if the model has another generation by then.
  virtual void ScheduleUpdate(Model* model, usec_t time, uint64_t generation) = 0;
  /// Start or stop calling Move() once per step.
  void StartMoving(Model* model) { Insert(&moving, model); }
  void StopMoving(Model* model) { Erase(&moving, model); }
  /// Start or stop calling UpdateCharge().
  void EnableEnergy(Model* model) { Insert(&energy, model); }
  void DisableEnergy(Model* model) { Erase(&energy, model); }

  // ---- loading ----

  bool loading = false;  ///< bodies are rasterized after loading
  MemoryBudget memory;
  /// Outlines of pictures by path, or by the name in `pictures`. Copies of a world share them.
  using Outlines = std::map<std::string, std::shared_ptr<const picture::Outlines>>;
  Outlines outlines_of_pictures;
  /// Pixels of pictures, which fields have their values from, by the same keys.
  using Samples = std::map<std::string, std::shared_ptr<const picture::Samples>>;
  Samples samples_of_pictures;

  /// Loads the plug-in named by the first word of `text` and registers its Init() as a CB_INIT
  /// callback. Throws LoadError with status 255.
  virtual void LoadController(Model* model, const std::string& text) = 0;
  /// Describes the exception thrown by a CB_INIT callback with these arguments. Call it in the
  /// exception handler.
  virtual std::string DescribeInitFailure(const std::string& model_name,
                                          const void* arguments) const = 0;

  // ---- callbacks ----

  // Callbacks may do anything. Code that calls them and continues must share ownership of the host,
  // to keep it alive, and check these members.
  uint64_t epoch = 0;          ///< incremented when all models are deleted
  bool world_deleted = false;  ///< the world has been deleted
  bool writing = false;        ///< the world is being reloaded or saved
  unsigned int calls = 0;      ///< number of callbacks running outside of steps
  unsigned int loads = 0;      ///< depth of nested loads in progress

  /// True if neither a callback nor anything that calls callbacks is running.
  bool IsIdle() const { return !stepping && !writing && loads == 0 && calls == 0; }
  /// Keeps the adopted data of a model that is being deleted, possibly by a callback that uses it.
  void DeferDelete(std::forward_list<std::shared_ptr<void>> data) noexcept;
  /// Frees the kept data if the world is idle.
  void RunDeferredDeletes();

 private:
  std::forward_list<std::shared_ptr<void>> kept_data_;  // see DeferDelete()
};

}  // namespace Stg

#endif
