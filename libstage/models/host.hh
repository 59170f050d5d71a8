// SPDX-License-Identifier: GPL-2.0-or-later
//
// What models need of the running world that they are in, below World's public interface: the scene
// that they share, and the lists that say whose turn it is. The engine of a world is one.

#ifndef STAGE_MODELS_HOST_HH
#define STAGE_MODELS_HOST_HH

#include <atomic>
#include <deque>
#include <forward_list>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/block.hh"
#include "models/fiducial_index.hh"
#include "models/flag.hh"
#include "models/memory_budget.hh"
#include "models/model.hh"
#include "models/model_names.hh"
#include "sensing/scene.hh"

namespace Stg {

class ModelWifi;
class Watch;

namespace picture {
struct Outlines;
}

/// Numbers for the updates that a model plans one after the other. Those of different models
/// differ, even of two that have had the same place in memory.
struct UpdateChain {
  static uint64_t First(uint32_t model_id) { return uint64_t{model_id} << 32; }
  static uint64_t Next(uint64_t chain) {
    return (chain & ~uint64_t{0xffffffff}) | static_cast<uint32_t>(chain + 1);
  }
};

class Host {
 public:
  virtual ~Host() = default;

  // ---- the models ----

  std::vector<Model*> models;  ///< in the order of creation, the ground first
  ModelNames names;
  uint32_t next_model_id = 0;
  /// Flags that snapshots have taken from models, for others that they give flags to.
  std::vector<Model::Flag*> spare_flags;
  std::deque<Model::Flag> own_flags;  ///< those made for that
  uint64_t family_changes = 0;        ///< of who there is and whose child it is
  std::vector<ModelWifi*> radios;     ///< in the order of creation
  FiducialIndex fiducials;            ///< what fiducial finders may see
  Watch* watches = nullptr;           ///< the list of all, see Watch
  double greatest_dissipation = 0;    ///< J, of a square metre: see DissipationVis
  size_t controllers_left_out = 0;    ///< see RunOptions::controllers
  /// A robot has been given a command that it may not hear: see ModelPosition::TellIfUnheard().
  /// Robots of several threads set it.
  std::atomic<bool> unheard_command{false};

  /// Null if there is none of that number.
  Model* FindModel(uint32_t id) const;
  /// In and out of a list in the order of creation; nothing if it is there, or isn't.
  static void Insert(std::vector<Model*>* list, Model* model);
  static void Erase(std::vector<Model*>* list, const Model* model);

  // ---- bodies and rays ----

  sensing::Scene scene;
  Placement placement;                      ///< of the model that moves, if it does so alone
  std::vector<Model*> hidden_from_rangers;  ///< drawn while rangers looked through them

  /// Traces the rays that are waiting in the batch. To be called before anything changes that they
  /// may meet, and before callbacks: rays meet the world as it was when the sensor updated, batch
  /// or no batch.
  virtual void TraceBatch() = 0;
  /// As TraceBatch, for what must not throw, such as destructors: what is thrown is thrown by the
  /// next TraceBatch instead, and the rays are left untraced.
  virtual void TraceBatchAndPostponeThrowing() noexcept = 0;
  /// Traces the batch if there are rays of a model in it, which is going to be deleted.
  void FinishRaysOf(const Model* finder);

  // ---- the steps ----

  std::vector<Model*> moving;                ///< those that asked for it, in the order of creation
  std::vector<Model*> energy;                ///< running ones with a pack, in the same order
  std::vector<Model*> sensed;                ///< models with a rest of their update to do
  std::vector<Model*> update_callbacks_due;  ///< models that updated in this step
  bool stepping = false;                     ///< a step is being made
  uint32_t steps_begun = 0;                  ///< by this engine; it never goes back

  /// Plans a model's update. It is void if the model has another chain by then.
  virtual void ScheduleUpdate(Model* model, usec_t time, uint64_t chain) = 0;
  /// Move() is called once a step from now on, or no longer.
  void StartMoving(Model* model) { Insert(&moving, model); }
  void StopMoving(Model* model) { Erase(&moving, model); }
  /// The same of UpdateCharge().
  void EnableEnergy(Model* model) { Insert(&energy, model); }
  void DisableEnergy(Model* model) { Erase(&energy, model); }

  // ---- loading ----

  bool loading = false;  ///< bodies are drawn when all is loaded
  MemoryBudget memory;
  /// Of pictures, by path. Copies of a world share them.
  using Outlines = std::map<std::string, std::shared_ptr<const picture::Outlines>>;
  Outlines outlines_of_pictures;

  /// Loads the plug-in that is the first word of `text` and registers its Init() as a callback of
  /// type CB_INIT. Throws LoadError with status 255.
  virtual void LoadController(Model* model, const std::string& text) = 0;
  /// What a callback of type CB_INIT, which got these arguments, has just thrown; to be called in
  /// the handler of the exception.
  virtual std::string DescribeInitFailure(const std::string& model_name,
                                          const void* arguments) const = 0;

  // ---- callbacks ----

  // They may do anything. Who calls some and goes on afterwards shares in the host, so that it is
  // still there, and looks at these.
  uint64_t life = 0;       ///< another number once everything there was is gone
  bool deserted = false;   ///< the world has been deleted
  bool writing = false;    ///< the world is loaded again, or saved
  unsigned int calls = 0;  ///< of callbacks, outside of steps, in progress
  unsigned int loads = 0;  ///< in progress: one within another

  /// No callback is running, nor anything that calls some.
  bool IsIdle() const { return !stepping && !writing && loads == 0 && calls == 0; }
  /// Keeps what a model has adopted that is being deleted, perhaps by a callback that uses it.
  void KeepForNow(std::forward_list<std::shared_ptr<void>> data) noexcept;
  /// Frees that if the world is idle.
  void LetOrphansGo();

 private:
  std::forward_list<std::shared_ptr<void>> orphans_;  // see KeepForNow()
};

}  // namespace Stg

#endif
