// SPDX-License-Identifier: GPL-2.0-or-later
//
// What makes a world run, behind World's interface: the scene, the scheduler, the threads, the
// prefilter.

#ifndef STAGE_WORLD_ENGINE_HH
#define STAGE_WORLD_ENGINE_HH

#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/block.hh"
#include "models/position.hh"
#include "sensing/fan_order.hh"
#include "sensing/prefilter.hh"
#include "sensing/scene.hh"
#include "sensing/tracer.hh"
#include "sensing/worker_pool.hh"
#include "world/callback_phase.hh"
#include "world/fiducial_index.hh"
#include "world/gather_phase.hh"
#include "world/memory_budget.hh"
#include "world/model_names.hh"
#include "world/move_phase.hh"
#include "world/path_chooser.hh"
#include "world/scheduler.hh"
#include "world/statistics.hh"

namespace Stg {

class ModelWifi;
class Watch;

class WorldEngine {
 public:
  sensing::Scene scene;
  Placement placement;
  Scheduler scheduler;
  RunStatistics statistics;
  FiducialIndex fiducials;

  std::vector<Model*> models;  ///< in the order of creation, the ground first
  ModelNames names;
  MemoryBudget memory;
  std::vector<Model*> moving;                ///< those that asked for it, in the order of creation
  std::vector<Model*> energy;                ///< running ones with a pack, in the same order
  std::vector<Model*> hidden_from_rangers;   ///< drawn while rangers looked through them
  std::vector<Model*> sensed;                ///< models with a rest of their update to do
  std::vector<ModelWifi*> radios;            ///< in the order of creation
  std::vector<Model*> update_callbacks_due;  ///< models that updated in this step
  std::vector<Scheduler::Event> due;         ///< those of this step
  struct UpdateCallback {
    world_callback_t function;  ///< null: struck out
    void* user;
  };
  std::vector<UpdateCallback> update_callbacks;  ///< of the world
  uint64_t family_changes = 0;                   ///< of who there is and whose child it is
  size_t controllers_left_out = 0;               ///< see RunOptions::controllers

  // Callbacks may do anything. Who calls some and goes on afterwards shares in the engine, so that
  // it is still there, and looks at these.
  uint64_t life = 0;      ///< another number once everything there was is gone
  bool deserted = false;  ///< the world has been deleted
  Watch* watches = nullptr;
  bool stepping = false;
  bool writing = false;      ///< the world is loaded again, or saved
  unsigned int loads = 0;    ///< in progress: one within another
  bool loading = false;      ///< bodies are drawn when all is loaded
  std::vector<Model*> made;  ///< while a world is loaded: of each entity, or null

  /// By path, while a world is loaded.
  std::map<std::string, std::vector<std::vector<point_t>>> outlines_of_pictures;

  /// Null if there is none of that number.
  Model* FindModel(uint32_t id) const;
  /// Takes a model that is going to be deleted out of all that is above.
  void Forget(Model* model);
  /// Says what a callback has done to the world while it was being `what`; returns false.
  bool TellLost(const char* what) const;
  /// Calls f(model) for those that there are now, in their order, except those that are deleted
  /// meanwhile.
  template <typename F>
  void ForEachModel(F f);

  void SetThreads(unsigned threads);
  /// In a process that was forked meanwhile: starts threads of its own.
  void NoticeFork();
  /// See RunOptions::share_from.
  void ShareFrom(int count);
  void SetPrefilter(std::unique_ptr<sensing::Prefilter> prefilter, bool always);

  /// Which way batches go: where it is faster, or, for measurements, one of the two.
  enum class Path { kFaster, kHost, kDevice };
  void ForcePath(Path path) { path_ = path; }

  /// Traces the rays of the batch and hands the results to their sensors; empties the batch.
  void TraceBatch();
  /// As TraceBatch, for what must not throw, such as destructors: what is thrown is thrown by the
  /// next TraceBatch instead, and the rays are left untraced.
  void TraceBatchAndPostponeThrowing() noexcept;
  /// Gets ready for the next step, and lets go of what no sensor has used for a long time; the
  /// batch is empty.
  void EndStep();
  /// Instead of that, if something was thrown: forgets what the step was about to do, but for what
  /// is due and has not happened, which is due in the next step.
  void AbandonStep(usec_t now) noexcept;
  /// Puts bodies back into the rangers' layer whose ranger_return is no longer negative.
  void RefreshHidden();
  void ForgetRays(const Model* finder);

  /// Decides whether threads share the updates, moves and callbacks of this step, of which `due`
  /// and `moving` tell how many there are. The outcome is the same.
  void ChooseSharing();
  /// What those of the step took, in seconds, rays left out.
  void ReportSharing(double seconds);
  /// Moves several of `moving` at once, from the given one on. Returns how many; 0 if those that
  /// come next have to move one after the other.
  size_t MoveTogether(size_t first);
  /// The same with the updates of `due`.
  size_t UpdateTogether(size_t first, World* world);
  /// The same with the callbacks of `update_callbacks_due`.
  size_t CallTogether(size_t first);

  /// Of threads sharing work, for tests: how often they did, and how many updates, moves and
  /// callbacks were looked at for that.
  uint64_t shared_jobs() const { return workers_->shared_jobs(); }
  uint64_t looks() const {
    return gather_phase_.looks() + move_phase_.looks() + callback_phase_.looks();
  }

 private:
  sensing::HitLists Prefilter(uint64_t rays);
  void SendAhead();
  void LoseDevice(const sensing::PrefilterError& error);
  void TraceFans(const sensing::HitLists& lists);
  struct Looks;
  bool Look(bool at_device);
  void KeepOthersFromDevice(const Looks& looks);
  void TraceLooks(const Looks& looks, bool at_device);
  uint64_t CountRays(const Looks& looks) const;
  void EndBatch();

  struct LetGo {
    void operator()(sensing::WorkerPool* pool) const {
      if (pool->IsHere()) delete pool;
    }
  };
  std::unique_ptr<sensing::WorkerPool, LetGo> workers_{new sensing::WorkerPool(1)};
  struct alignas(64) ThreadData {  // cache lines of its own, as it is written to all the time
    std::vector<sensing::RayHit> hits;
    sensing::TraceCounters counters;
  };
  template <typename At>
  void TraceRuns(const sensing::HitLists& lists, std::size_t count, At at);
  void TraceRun(const sensing::Tracer& tracer, const sensing::FanRun& run,
                const sensing::HitLists& lists, ThreadData* mine) const;
  std::size_t CountRays(const sensing::FanRun& run) const;
  std::vector<ThreadData> thread_data_ = std::vector<ThreadData>(1);
  sensing::FanOrder fan_order_;
  std::unique_ptr<sensing::Prefilter> prefilter_;
  PathChooser chooser_;
  Path path_ = Path::kFaster;
  bool device_in_use_ = false;  // the last batch was there
  std::exception_ptr postponed_;

  unsigned forks_ = sensing::CountForks();  // when threads were looked at last

  // In small steps sharing may cost more than it saves, if only because threads leave models in
  // their caches for others to fetch. It is measured like the choice between device and host: the
  // threads stand for the device, models for rays.
  PathChooser sharing_;
  bool shares_ = true;             // in this step
  bool compares_sharing_ = false;  // in this step
  double shared_seconds_ = 1;      // what the last step took that was shared

  GatherPhase gather_phase_;
  MovePhase move_phase_;
  CallbackPhase callback_phase_;
};

template <typename F>
void WorldEngine::ForEachModel(F f) {
  const uint32_t end = models.empty() ? 0 : models.back()->GetId() + 1;
  for (uint32_t id = 0; id < end; id++) {
    const auto model = std::lower_bound(models.begin(), models.end(), id,
                                        [](const Model* m, uint32_t i) { return m->GetId() < i; });
    if (model == models.end() || (*model)->GetId() >= end) return;
    id = (*model)->GetId();
    f(*model);
  }
}

/// Sets a variable for as long as it lives.
template <typename T>
class While {
 public:
  While(T* variable, T value) : variable_(variable), before_(*variable) { *variable = value; }
  ~While() { *variable_ = before_; }
  While(const While&) = delete;
  While& operator=(const While&) = delete;

 private:
  T* variable_;
  T before_;
};

/// Seconds since some fixed moment.
double WallClock();

}  // namespace Stg

#endif
