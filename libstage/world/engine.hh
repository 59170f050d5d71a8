// SPDX-License-Identifier: GPL-2.0-or-later
//
// Implementation of a running world behind World's interface: models, scheduler, phases, the
// tracing of rays, and the threads.

#ifndef STAGE_WORLD_ENGINE_HH
#define STAGE_WORLD_ENGINE_HH

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "models/host.hh"
#include "models/position.hh"
#include "models/types/fiducial_index.hh"
#include "models/types/light_index.hh"
#include "models/types/radio_traffic.hh"
#include "sensing/batch_tracer.hh"
#include "threads/wall_clock.hh"
#include "threads/worker_pool.hh"
#include "world/batch_controls.hh"
#include "world/metric_list.hh"
#include "world/phases/callback_phase.hh"
#include "world/phases/contact_phase.hh"
#include "world/phases/gather_phase.hh"
#include "world/phases/move_phase.hh"
#include "world/phases/parallel_choice.hh"
#include "world/phases/thread_choice.hh"
#include "world/scheduler.hh"
#include "world/statistics.hh"

namespace Stg {

struct PopulationPlan;
struct SnapshotBuffers;
struct WorldImage;

class WorldEngine : public Host {
 public:
  WorldEngine();
  ~WorldEngine() override;

  sensing::BatchTracer tracer{&scene};
  Scheduler scheduler;
  FiducialIndex fiducial_index;     ///< Host::fiducials
  LightIndex light_index;           ///< Host::lights
  RadioTraffic messages_of_radios;  ///< Host::traffic
  GatherPhase gather;
  MovePhase move;
  ContactPhase contacts;  ///< part of the move phase
  CallbackPhase callbacks;
  ParallelChoice parallel_choice;     ///< whether the phases use several threads
  RunStatistics statistics;           ///< without the tracer's counts, see Statistics()
  std::vector<Scheduler::Event> due;  ///< events due in this step
  struct UpdateCallback {
    world_callback_t function;  ///< null: removed
    void* user;
  };
  std::vector<UpdateCallback> update_callbacks;  ///< callbacks of the world
  std::vector<std::function<void(World&)>> calls_after_step;
  size_t plugins_left_out = 0;  ///< see RunOptions::controllers
  std::vector<std::unique_ptr<CtrlArgs>> controller_arguments;
  std::vector<std::unique_ptr<BatchArguments>> batch_arguments;
  BatchControls batch_controls;
  /// Highest stamp when loading ended. Bodies that have not moved since have stamps up to this one,
  /// in the order of creation.
  uint64_t last_stamp_of_loading = 0;
  grid::CellBox extent_of_loading;          ///< extent of the grid when loading ended
  std::shared_ptr<const WorldImage> image;  ///< shared by copies; null before the first copy
  std::mutex image_mutex;                   ///< held while the image is made
  std::mutex models_mutex;                  ///< protects the list of models of a listed world
  std::unique_ptr<SnapshotBuffers> snapshot_buffers;
  MetricList metrics;
  /// Whether World::Validate() is called after each phase of a step, in builds with assertions.
  const bool validates = AsksForValidation();
  std::shared_ptr<const PopulationPlan> populations;  ///< null without populations
  std::vector<Model*> made;  ///< used while loading: model of each entity, or null
  /// Likely mistakes noticed during loading, for --explain.
  std::vector<std::string> load_warnings;

  // Implementation of Host.
  void TraceBatch() override;
  void TraceBatchAndPostponeThrowing() noexcept override;
  void ScheduleUpdate(Model* model, usec_t time, uint64_t generation) override {
    scheduler.Add(time, {model, nullptr, nullptr, generation});
  }
  void PrepareMove() override;
  bool IsBlocked(const Model& model, const Pose& before, const Placement& placement) override;
  void ForEachContact(const Model* root,
                      const std::function<void(const ContactPoint&)>& f) override {
    contacts.FindContacts(this);
    contacts.ForEachContact(root, f);
  }
  void LoadController(Model* model, const std::string& text) override;
  std::string DescribeInitFailure(const std::string& model_name,
                                  const void* arguments) const override;

  /// Creates a model. Returns null if its constructor deleted it, usually together with its parent.
  Model* Make(World* world, Model* parent, const std::string& type, creator_t create);
  /// Removes a model that is about to be deleted from all members above.
  void Forget(Model* model);
  /// Reports that a callback has deleted or unloaded the world while it was being `what`
  /// ("loaded"). Returns false.
  bool ReportWorldLost(const char* what) const;
  /// Calls f(model) for all models that exist at the start and still exist at their turn, by id.
  template <typename F>
  void ForEachModel(F f);

  /// Uses `count` threads in each step. Keeps the present pool if it has that many.
  void SetThreads(unsigned count);
  /// Uses one thread or `limit` in each step, whichever is faster. Starts the threads when a step
  /// first takes long enough.
  void ChooseThreads(unsigned limit);
  bool chooses_threads() const { return max_threads_ > 0; }
  /// Chooses the threads for a step in which `count` models update or move.
  void ChooseThreadsFor(size_t count);
  /// Uses all threads until the next step.
  void UseAllThreads();
  /// Reports the duration of a step to the choice of threads.
  void ReportStep(double seconds) {
    if (chooses_threads()) thread_choice_.Report(seconds);
  }
  /// Uses the present thread pool of the other engine from now on.
  void ShareThreadsOf(const WorldEngine& other);
  threads::WorkerPool* workers() { return workers_.get(); }
  /// Number of threads of the present step, or of the last one.
  unsigned threads() const { return workers_->threads(); }
  /// Maximum number of threads of a step.
  unsigned max_threads() const { return chooses_threads() ? max_threads_ : threads(); }
  /// Replaces the thread pool if the process has been forked since the last step.
  void CheckFork();
  /// See RunOptions::share_from.
  void ShareFrom(int count);

  /// Prepares for the next step and frees what sensors have not used for long. The batch must be
  /// empty.
  void EndStep();
  /// Call instead of EndStep() after an exception. Drops pending work of the step; due events that
  /// have not run are moved to the next step.
  void AbandonStep(usec_t now) noexcept;
  /// Delivers the messages of radios that are due at `now`.
  void DeliverMessages(usec_t now);
  /// Calls the CB_CONTACT callbacks of models that touch something. They may end the epoch.
  void CallContactCallbacks(uint64_t epoch_of_step);
  /// Warns about robots that got commands but have no subscriber, and so do not move.
  void WarnAboutUnsubscribed();
  /// Moves bodies whose ranger_return is no longer negative back into the rangers' layer.
  void RestoreRangerVisibilities();

  /// Whether rangers see only bodies with one ranger_return, all of which the grid shows to them.
  sensing::BatchTracer::RangerView FindRangerView();
  /// Statistics of the whole engine, including the tracer.
  RunStatistics Statistics() const;

  /// For tests: number of jobs that threads shared, and of updates, moves and callbacks examined to
  /// decide what can run in parallel.
  uint64_t shared_jobs() const { return workers_->shared_jobs(); }
  uint64_t examined() const { return gather.examined() + move.examined() + callbacks.examined(); }

 private:
  static bool AsksForValidation();
  void UsePool(std::shared_ptr<threads::WorkerPool> workers);

  std::shared_ptr<threads::WorkerPool> workers_;  // may be shared with other worlds
  // If threads are chosen per step: the maximum number (otherwise 0) and the two pools.
  unsigned max_threads_ = 0;
  std::shared_ptr<threads::WorkerPool> alone_, all_;  // `all_` is null until first needed
  ThreadChoice thread_choice_;
  size_t share_messages_from_ = 1;  // minimum number of receivers for several threads
  std::exception_ptr postponed_;

  unsigned forks_ = threads::CountForks();  // value of CountForks() at the last check
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

/// Sets a variable for the lifetime of this object and then restores its value.
template <typename T>
class ScopedValue {
 public:
  ScopedValue(T* variable, T value) : variable_(variable), before_(*variable) { *variable = value; }
  ~ScopedValue() { *variable_ = before_; }
  ScopedValue(const ScopedValue&) = delete;
  ScopedValue& operator=(const ScopedValue&) = delete;

 private:
  T* variable_;
  T before_;
};

using threads::WallClock;

}  // namespace Stg

#endif
