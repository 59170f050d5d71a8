// SPDX-License-Identifier: GPL-2.0-or-later

#include "worlds/world_pool.hh"

#include <algorithm>
#include <memory>
#include <mutex>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "messages/assert.hh"
#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "threads/processors.hh"
#include "threads/wall_clock.hh"
#include "threads/worker_pool.hh"
#include "world/copy_source.hh"
#include "world/world.hh"
#include "world/world_handle.hh"

namespace Stg {

void StepObserver::BeforeStep(uint32_t, uint64_t) {}
void StepObserver::AfterStep(uint32_t, uint64_t) {}
void StepObserver::AfterRound(uint32_t, uint64_t, uint64_t, Outcome) {}
void StepObserver::BetweenRounds() {}

namespace {

/// Thrown to make a world fail for this reason.
struct WorldFailure {
  std::string why;
};

/// The scene of one or several pools: the data that their worlds share.
class Scene {
 public:
  Scene(const World& prototype, const WorldPoolOptions& options)
      : source_(prototype, options.device), options_(source_.options()) {
    if (!options.branch) return;
    options_.branch = true;
    options_.duration = 0;
    options_.clock = false;
  }

  bool IsReady() const { return !source_.empty(); }

  /// Makes a world. Throws WorldFailure. Several threads may call it at once.
  std::unique_ptr<World> Make(uint64_t seed) const {
    RunOptions options = options_;
    options.seed = seed;
    const messages::ErrorTrap errors;
    std::unique_ptr<World> world = IsReady() ? source_.Make(options) : nullptr;
    if (!world) throw WorldFailure{errors.Last("the world can't be copied")};
    world->SetQuitTime(0);
    return world;
  }

  /// The state to which worlds are reset; null if they must be made again. The first caller finds
  /// it out, in a world of its own.
  const InitialState* initial_state() {
    std::call_once(initial_state_once_, [this] {
      const std::unique_ptr<World> world = Make(options_.seed);
      const WorldHandle handle(world.get());
      initial_state_ = world->CaptureInitialState();
    });
    return initial_state_.get();
  }

 private:
  const CopySource source_;
  RunOptions options_;
  std::once_flag initial_state_once_;
  std::shared_ptr<const InitialState> initial_state_;
};

}  // namespace

struct WorldPool::Impl {
  struct Slot {
    WorldHandle world;
    uint64_t times_made = 0;
    std::string failure;
  };
  /// Aligned to a cache line, because each thread writes its own all the time.
  struct alignas(64) StepCounter {
    uint64_t steps = 0;
  };

  Impl(std::shared_ptr<Scene> of, const std::vector<uint64_t>& with_seeds, unsigned threads)
      : scene(std::move(of)),
        seeds(with_seeds),
        slots(with_seeds.size()),
        workers(threads::MakeWorkerPool(threads)),
        steps_of_threads(workers->threads()) {}
  ~Impl() {
    for (const Slot& slot : slots) delete slot.world.get();
  }

  void Load(uint32_t id);
  void TryToLoad(uint32_t id);
  World* Require(uint32_t id);
  void Reset(uint32_t id);
  StepObserver::Outcome StepWorld(uint32_t id, uint64_t first, uint64_t end,
                                  StepObserver* observer);
  uint64_t StepsOfRound(size_t worlds, uint64_t unit) const;
  void StepRound(const Ids& ids, uint64_t first, uint64_t end, StepObserver* observer);
  /// Calls f(id, thread) for these worlds on all threads. An exception fails its world.
  template <typename F>
  void ForEach(const Ids& ids, F f);

  const std::shared_ptr<Scene> scene;
  std::vector<uint64_t> seeds;
  std::vector<Slot> slots;  // one per world
  const std::shared_ptr<threads::WorkerPool> workers;
  std::vector<StepCounter> steps_of_threads;  // steps made in the present round
  double step_seconds = 0;  // recent wall time per step and world, with all threads; 0: unknown
};

template <typename F>
void WorldPool::Impl::ForEach(const Ids& ids, F f) {
  workers->Run(ids.size(), 1, [&](size_t begin, size_t end, unsigned thread) {
    for (size_t i = begin; i < end; i++) {
      STAGE_ASSERT(ids[i] < slots.size());
      try {
        f(ids[i], thread);
      } catch (const WorldFailure& failure) {
        slots[ids[i]].failure = failure.why;
      } catch (...) {
        slots[ids[i]].failure = DescribeException();
      }
    }
  });
}

/// Makes the world, or makes it again.
void WorldPool::Impl::Load(uint32_t id) {
  Slot& slot = slots[id];
  delete slot.world.get();
  slot.world = WorldHandle();
  slot.failure.clear();
  slot.times_made++;
  slot.world = WorldHandle(scene->Make(seeds[id]).release());
}

/// Makes the world like Load(); it has failed if that fails.
void WorldPool::Impl::TryToLoad(uint32_t id) {
  try {
    Load(id);
  } catch (const WorldFailure& failure) {
    slots[id].failure = failure.why;
  } catch (...) {
    slots[id].failure = DescribeException();
  }
}

/// The world, made if this has not been done yet. Throws WorldFailure if there is none.
World* WorldPool::Impl::Require(uint32_t id) {
  Slot& slot = slots[id];
  if (slot.times_made == 0) Load(id);
  World* const world = slot.world.get();
  if (!world) throw WorldFailure{"there is no world number " + std::to_string(id)};
  return world;
}

/// Resets the world to the state after loading with its seed, and makes it again if it cannot be
/// reset.
void WorldPool::Impl::Reset(uint32_t id) {
  Slot& slot = slots[id];
  const InitialState* const initial_state = scene->initial_state();
  World* const world = slot.world.get();
  if (!world || !initial_state || !world->RestartFrom(*initial_state, seeds[id])) return Load(id);
  slot.failure.clear();
}

/// Makes steps first to end - 1, or fewer if the world ends.
StepObserver::Outcome WorldPool::Impl::StepWorld(uint32_t id, uint64_t first, uint64_t end,
                                                 StepObserver* observer) {
  World* const world = Require(id);
  const Slot& slot = slots[id];
  for (uint64_t step = first; step < end; step++) {
    if (observer) observer->BeforeStep(id, step);
    if (world->Update()) {
      if (!slot.world) throw WorldFailure{"a controller has deleted the world"};
      return StepObserver::kHasEnded;
    }
    if (observer) observer->AfterStep(id, step);
  }
  return StepObserver::kMadeAllSteps;
}

/// The number of steps of a round of about 50 ms, which a user who waits for Ctrl-C does not
/// notice. Shorter rounds would be slower, because each world starts a round with cold caches.
uint64_t WorldPool::Impl::StepsOfRound(size_t worlds, uint64_t unit) const {
  constexpr double kSeconds = 0.05;
  if (step_seconds <= 0) return unit;
  const double units =
      kSeconds / (step_seconds * static_cast<double>(unit) * static_cast<double>(worlds));
  return unit * static_cast<uint64_t>(std::clamp(units, 1.0, 1e9));
}

/// Makes a round, and measures it. Worlds that have ended or failed take no time; if all have, the
/// time per step stays as it is.
void WorldPool::Impl::StepRound(const Ids& ids, uint64_t first, uint64_t end,
                                StepObserver* observer) {
  const double start = threads::WallClock();
  for (StepCounter& counter : steps_of_threads) counter.steps = 0;
  ForEach(ids, [&](uint32_t id, unsigned thread) {
    if (!slots[id].failure.empty() || (slots[id].times_made > 0 && !slots[id].world)) return;
    StepObserver::Outcome outcome = StepObserver::kHasFailed;
    try {
      outcome = StepWorld(id, first, end, observer);
    } catch (...) {
      if (observer) observer->AfterRound(id, first, end, outcome);
      throw;
    }
    if (observer) observer->AfterRound(id, first, end, outcome);
    if (outcome == StepObserver::kMadeAllSteps) steps_of_threads[thread].steps += end - first;
  });
  uint64_t steps = 0;
  for (const StepCounter& counter : steps_of_threads) steps += counter.steps;
  if (steps > 0) step_seconds = (threads::WallClock() - start) / static_cast<double>(steps);
}

WorldPool::WorldPool(const World& prototype, const std::vector<uint64_t>& seeds,
                     const WorldPoolOptions& options)
    : impl_(new Impl(std::make_shared<Scene>(prototype, options), seeds,
                     options.threads > 0 ? options.threads : threads::CountUsableProcessors())) {}

WorldPool::WorldPool(const WorldPool& other, const std::vector<uint64_t>& seeds)
    : impl_(new Impl(other.impl_->scene, seeds, other.threads())) {}

WorldPool::~WorldPool() = default;

bool WorldPool::IsReady() const { return impl_->scene->IsReady(); }

uint32_t WorldPool::size() const { return static_cast<uint32_t>(impl_->slots.size()); }

unsigned WorldPool::threads() const { return impl_->workers->threads(); }

WorldPool::Ids WorldPool::All() const {
  Ids all(size());
  std::iota(all.begin(), all.end(), 0u);
  return all;
}

void WorldPool::Resize(const std::vector<uint64_t>& seeds) {
  const size_t count = seeds.size();
  for (size_t id = count; id < size(); id++) delete impl_->slots[id].world.get();
  for (size_t id = size(); id < count; id++) impl_->seeds.push_back(seeds[id]);
  impl_->seeds.resize(count);
  impl_->slots.resize(count);
}

const std::vector<uint64_t>& WorldPool::seeds() const { return impl_->seeds; }

const std::string& WorldPool::Failure(uint32_t id) const { return impl_->slots[id].failure; }

void WorldPool::SetFailure(uint32_t id, const std::string& why) { impl_->slots[id].failure = why; }

uint64_t WorldPool::times_made(uint32_t id) const { return impl_->slots[id].times_made; }

World* WorldPool::At(uint32_t id) {
  if (id >= size()) return nullptr;
  if (impl_->slots[id].times_made == 0) impl_->TryToLoad(id);
  return impl_->slots[id].world.get();
}

World* WorldPool::AtOrMake(uint32_t id) {
  World* const world = At(id);
  if (id >= size() || (world && world->GetWorldFile())) return world;
  impl_->TryToLoad(id);
  return impl_->slots[id].world.get();
}

void WorldPool::Make(const Ids& ids) {
  impl_->ForEach(ids, [this](uint32_t id, unsigned) { AtOrMake(id); });
}

void WorldPool::Step(const Ids& ids, uint64_t steps, StepObserver* observer, uint64_t unit) {
  STAGE_ASSERT(unit > 0);
  for (uint64_t done = 0; done < steps;) {
    const uint64_t end = done + std::min(impl_->StepsOfRound(ids.size(), unit), steps - done);
    impl_->StepRound(ids, done, end, observer);
    done = end;
    if (observer && done < steps) observer->BetweenRounds();
  }
}

void WorldPool::Reset(const Ids& ids, const std::vector<uint64_t>& seeds) {
  STAGE_ASSERT(ids.size() == seeds.size());
  for (size_t i = 0; i < ids.size(); i++) impl_->seeds[ids[i]] = seeds[i];
  impl_->ForEach(ids, [this](uint32_t id, unsigned) { impl_->Reset(id); });
}

void WorldPool::Restore(const Ids& ids, const Snapshot& from) {
  impl_->ForEach(ids, [&](uint32_t id, unsigned) {
    if (!impl_->slots[id].world) impl_->Load(id);
    World* const world = impl_->Require(id);
    const messages::ErrorTrap errors;
    if (!world->Restore(from)) throw WorldFailure{errors.Last("the snapshot doesn't fit")};
    world->CancelQuit();
    impl_->slots[id].failure.clear();
  });
}

bool WorldPool::Take(uint32_t id, Snapshot* to, Snapshot::Keep keep) {
  if (const World* const world = At(id)) return world->Take(to, keep);
  messages::Report(LogLevel::kError, "stage: a snapshot can't be taken: there is no world number " +
                                         std::to_string(id));
  return false;
}

std::vector<uint64_t> WorldPool::StateHashes(const Ids& ids) {
  std::vector<uint64_t> hashes(size(), 0);
  impl_->ForEach(ids, [&](uint32_t id, unsigned) {
    if (const World* const world = At(id)) hashes[id] = world->StateHash();
  });
  std::vector<uint64_t> of_ids;
  for (const uint32_t id : ids) of_ids.push_back(hashes[id]);
  return of_ids;
}

void WorldPool::ForEach(const Ids& ids, const std::function<void(uint32_t id)>& call) {
  impl_->ForEach(ids, [&](uint32_t id, unsigned) { call(id); });
}

void WorldPool::Run(size_t count, const std::function<void(size_t, unsigned)>& job) {
  impl_->workers->Run(count, 1, [&](size_t begin, size_t end, unsigned thread) {
    for (size_t i = begin; i < end; i++) job(i, thread);
  });
}

}  // namespace Stg
