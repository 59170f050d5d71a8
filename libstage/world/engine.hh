// SPDX-License-Identifier: GPL-2.0-or-later
//
// What makes a world run, behind World's interface: the scene and the tracing of its rays, the
// scheduler, the threads and what they share.

#ifndef STAGE_WORLD_ENGINE_HH
#define STAGE_WORLD_ENGINE_HH

#include <algorithm>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "geometry/free_floor.hh"
#include "models/host.hh"
#include "models/position.hh"
#include "sensing/batch_tracer.hh"
#include "threads/wall_clock.hh"
#include "threads/worker_pool.hh"
#include "world/metric_list.hh"
#include "world/phases/callback_phase.hh"
#include "world/phases/gather_phase.hh"
#include "world/phases/move_phase.hh"
#include "world/phases/sharing.hh"
#include "world/phases/thread_choice.hh"
#include "world/scheduler.hh"
#include "world/statistics.hh"

namespace Stg {

struct SnapshotRoom;
struct WorldImage;

class WorldEngine : public Host {
 public:
  WorldEngine();
  ~WorldEngine() override;

  sensing::BatchTracer tracer{&scene};
  Scheduler scheduler;
  GatherPhase gather;
  MovePhase move;
  CallbackPhase callbacks;
  Sharing sharing;                    ///< of the work of these phases among threads
  RunStatistics statistics;           ///< but for the tracer's part, see Statistics()
  std::vector<Scheduler::Event> due;  ///< those of this step
  struct UpdateCallback {
    world_callback_t function;  ///< null: struck out
    void* user;
  };
  std::vector<UpdateCallback> update_callbacks;  ///< of the world
  std::vector<std::function<void(World&)>> calls_after_step;
  size_t plugins_left_out = 0;  ///< see RunOptions::controllers
  std::vector<std::unique_ptr<CtrlArgs>> controller_arguments;
  /// Of bodies that lie where they lay when the world had been loaded, the last one's; these were
  /// drawn in the order of creation.
  uint64_t last_stamp_of_loading = 0;
  grid::CellBox extent_of_loading;          ///< of the grid, when the world had been loaded
  std::shared_ptr<const WorldImage> image;  ///< for copies of the world; once one was made
  std::mutex image_mutex;                   ///< held by a thread that makes the image
  std::mutex models_mutex;                  ///< of the list of models, in a listed world
  std::unique_ptr<SnapshotRoom> snapshot_room;
  MetricList metrics;
  std::shared_ptr<const geometry::FreeFloor> floor;  ///< of populations; null without them
  std::vector<Model*> made;  ///< while a world is loaded: of each entity, or null
  /// Likely mistakes that were noticed when the world was loaded, for --explain.
  std::vector<std::string> doubts;

  // What models ask for, see Host.
  void TraceBatch() override;
  void TraceBatchAndPostponeThrowing() noexcept override;
  void ScheduleUpdate(Model* model, usec_t time, uint64_t chain) override {
    scheduler.Add(time, {model, nullptr, nullptr, chain});
  }
  void LoadController(Model* model, const std::string& text) override;
  std::string DescribeInitFailure(const std::string& model_name,
                                  const void* arguments) const override;

  /// Makes a model of a type. Null if its constructor has deleted it, mostly with its parent.
  Model* Make(World* world, Model* parent, const std::string& type, creator_t create);
  /// Takes a model that is going to be deleted out of all that is above.
  void Forget(Model* model);
  /// Says what a callback has done to the world while it was being `what`; returns false.
  bool TellLost(const char* what) const;
  /// Calls f(model) for those that there are now, in their order, except those that are deleted
  /// meanwhile.
  template <typename F>
  void ForEachModel(F f);

  /// Each step uses so many. Keeps the pool it has if that has so many threads.
  void SetThreads(unsigned count);
  /// Each step uses one thread or `most`, whichever is faster. They are started when a step first
  /// lasts long enough.
  void ChooseThreads(unsigned most);
  bool chooses_threads() const { return most_threads_ > 0; }
  /// For a step in which so many models update or move.
  void ChooseThreadsFor(size_t count);
  /// Uses all threads until the next step.
  void EmployAll();
  /// Tells the choice of threads how long the step took.
  void ReportStep(double seconds) {
    if (chooses_threads()) thread_choice_.Report(seconds);
  }
  /// From now on it works on the threads that the other one has now.
  void ShareThreadsOf(const WorldEngine& other);
  threads::WorkerPool* workers() { return workers_.get(); }
  /// The number of threads of the present step, or of the last one.
  unsigned threads() const { return workers_->threads(); }
  /// The most that a step may use.
  unsigned most_threads() const { return chooses_threads() ? most_threads_ : threads(); }
  /// In a process that was forked meanwhile: starts threads of its own.
  void NoticeFork();
  /// See RunOptions::share_from.
  void ShareFrom(int count);

  /// Gets ready for the next step, and lets go of what no sensor has used for a long time; the
  /// batch is empty.
  void EndStep();
  /// Instead of that, if something was thrown: forgets what the step was about to do, but for what
  /// is due and has not happened, which is due in the next step.
  void AbandonStep(usec_t now) noexcept;
  /// Warns of robots that were given commands and have no subscriber.
  void TellUnheardCommands();
  /// Puts bodies back into the rangers' layer whose ranger_return is no longer negative.
  void RefreshHidden();

  /// Those of everything.
  RunStatistics Statistics() const;

  /// Of threads sharing work, for tests: how often they did, and how many updates, moves and
  /// callbacks were looked at for that.
  uint64_t shared_jobs() const { return workers_->shared_jobs(); }
  uint64_t looks() const { return gather.looks() + move.looks() + callbacks.looks(); }

 private:
  void Employ(std::shared_ptr<threads::WorkerPool> workers);

  std::shared_ptr<threads::WorkerPool> workers_;  // maybe those of other worlds too
  // Where threads are chosen for each step: their number, or 0; the pools to choose from.
  unsigned most_threads_ = 0;
  std::shared_ptr<threads::WorkerPool> alone_, all_;  // the latter null until it is needed
  ThreadChoice thread_choice_;
  std::exception_ptr postponed_;

  unsigned forks_ = threads::CountForks();  // when threads were looked at last
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

using threads::WallClock;

}  // namespace Stg

#endif
