// SPDX-License-Identifier: GPL-2.0-or-later
//
// The worlds of a pool, and how they change their form; part of world_pool.hh.

#ifndef STAGE_WORLDS_POOL_IMPL_HH
#define STAGE_WORLDS_POOL_IMPL_HH

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <vector>

#include "messages/assert.hh"
#include "models/exception_origin.hh"
#include "rows/row_bridge.hh"
#include "rows/rows.hh"
#include "threads/worker_pool.hh"
#include "world/world_handle.hh"
#include "worlds/pool_access.hh"
#include "worlds/pool_device.hh"
#include "worlds/pool_scene.hh"
#include "worlds/pool_variant.hh"
#include "worlds/world_pool.hh"

namespace Stg {

struct WorldPool::Impl {
  /// Where the state of a world is.
  enum class Form : uint8_t {
    kStart,  ///< nowhere: it is that after loading with its seed and subscriptions
    kRow,
    kWorld  ///< in a World object, unless there is none
  };
  struct Slot {
    PoolVariant* variant = nullptr;
    uint32_t place = 0;  // the number of its row among those of its variant
    Form form = Form::kStart;
    bool returns = false;                    // kWorld: becomes a row as soon as it can
    uint16_t wait = 1, waited = 0;           // rounds until the next attempt at that
    Subscriptions* subscriptions = nullptr;  // kStart, kRow
    rows::Rows* rows = nullptr;              // kRow
    WorldHandle world;  // if another form than kWorld has one, its state is undefined
    uint64_t times_made = 0;
    std::vector<double> values;  // of what varies in the scene; empty: those of the prototype
    std::string failure;

    PoolScene* scene() const { return variant->scene.get(); }
  };
  /// Data of one thread. Aligned to a cache line, because each thread writes its own all the time.
  struct alignas(64) Thread {
    /// By the number of the subscriptions.
    struct OfVariant {
      std::array<std::shared_ptr<rows::Rows::Scratch>, Subscriptions::kMost> scratches;
      std::array<std::unique_ptr<rows::Rows>, Subscriptions::kMost> starts;  // one row each
    };
    OfVariant& Of(const PoolVariant& variant) {
      std::unique_ptr<OfVariant>& found = of_variants[variant.number];
      if (!found) found = std::make_unique<OfVariant>();
      return *found;
    }

    /// A world of the variant that is never stepped, number 0 or 1. It is valid until those of
    /// another variant are asked for.
    World* Spare(const PoolVariant& variant, int number) {
      if (spares_of != &variant)
        for (std::unique_ptr<SpareWorld>& spare : spares) spare.reset();
      spares_of = &variant;
      std::unique_ptr<SpareWorld>& spare = spares[number];
      if (!spare) spare = std::make_unique<SpareWorld>(variant.scene.get());
      return spare->get();
    }

    uint64_t steps = 0;  // made in the present round
    const PoolVariant* spares_of = nullptr;
    std::unique_ptr<SpareWorld> spares[2];
    std::vector<std::unique_ptr<OfVariant>> of_variants;  // made when they are needed
  };
  /// Tells the functions that clients call on threads of the pool which thread that is.
  class OnThread {
   public:
    explicit OnThread(Thread* thread) : before_(current) { current = thread; }
    ~OnThread() { current = before_; }
    OnThread(const OnThread&) = delete;
    OnThread& operator=(const OnThread&) = delete;

   private:
    Thread* const before_;
  };

  using Scenes = std::vector<std::shared_ptr<PoolScene>>;

  Impl(const Scenes& scenes, const std::vector<uint64_t>& with_seeds,
       const std::vector<uint32_t>& with_variants, unsigned threads,
       std::shared_ptr<rows::RowDevice> with_device);
  ~Impl();
  void Resize(const std::vector<uint64_t>& with_seeds, const std::vector<uint32_t>& with_variants);
  Scenes AllScenes() const;
  std::vector<uint32_t> AllVariants() const;
  void SetScene(uint32_t variant, std::shared_ptr<PoolScene> scene);
  void SetVariant(uint32_t id, uint32_t variant);
  void SetVariants(const Ids& ids, const std::vector<uint32_t>& to);
  void SetVariantOfRow(uint32_t id, PoolVariant* to, uint32_t place, Subscriptions* with,
                       rows::Rows* in);

  // Forms.
  /// Call it after each change of the form of a world, or of whether it has failed.
  void NoteForm() { forms_changed.fetch_add(1, std::memory_order_relaxed); }
  bool BecomeRow(uint32_t id);
  World* BecomeWorld(uint32_t id);
  bool TakeBack(uint32_t id, Thread* thread);
  void TakeBackSometimes(uint32_t id, Thread* thread);
  rows::Rows* NewestRows(const Slot& slot) { return Newest(slot.rows); }
  rows::Rows* RowsToChange(const Slot& slot) { return ToChange(slot.rows); }
  rows::Rows* Newest(rows::Rows* of) {
    if (device) device->Fetch(of);
    return of;
  }
  rows::Rows* ToChange(rows::Rows* of) {
    if (!device) return of;
    device->Fetch(of);
    device->NoteChange(of);
    return of;
  }
  PoolRow RowToRead(uint32_t id, Thread* thread);
  Thread* CurrentThread();
  void FreeUnusedRows();
  rows::Rows::Scratch* ScratchOf(const Slot& slot, Thread* thread, const rows::Rows& of);
  /// Calls f(world) with a World object in the state of the world. Throws WorldFailure.
  template <typename F>
  void WithWorld(uint32_t id, Thread* thread, F f);
  void Subscribe(uint32_t id, std::span<const uint32_t> models);
  static Subscriptions* WithAll(const Slot& slot, std::span<const uint32_t> models);
  std::string WhyNotClosed(uint32_t id);

  // World objects.
  void MakeWorld(uint32_t id);
  bool Restart(uint32_t id);
  void VaryWorld(uint32_t id);
  void Load(uint32_t id);
  void TryToMake(uint32_t id);
  World* Require(uint32_t id);
  void Reset(uint32_t id);
  enum class Fit { kFits, kFitsWorlds, kDoesNotFit };
  bool CanRestoreRow(uint32_t id);
  static Fit ReadSnapshot(PoolVariant* variant, const Snapshot& from, RowBridge::Readings readings,
                          Thread* thread, SnapshotRow* to, std::string* error);
  void RestoreRow(uint32_t id, const SnapshotRow& from);
  Fit RestoreRows(const Ids& ids, const Snapshot& from, std::string* error);
  void RestoreVariant(const Ids& ids, const Snapshot& from);
  void RestoreWorld(uint32_t id, const Snapshot& from);

  // Steps.
  uint64_t StepsAtOnce(StepObserver* observer, uint32_t id, uint64_t step, uint64_t end);
  StepObserver::Outcome StepWorld(uint32_t id, uint64_t first, uint64_t end, StepObserver* observer,
                                  Thread* thread);
  uint64_t StepsOfRound(double seconds_of_step, size_t worlds, uint64_t unit) const;
  Ids ByVariant(const Ids& ids) const;
  void StepOnHost(const Ids& ids, uint64_t steps, StepObserver* observer, uint64_t unit);
  void StepRound(const Ids& ids, uint64_t first, uint64_t end, StepObserver* observer);
  // On the device.
  /// Worlds that are in the same rows, by their places there.
  struct DeviceGroup {
    rows::Rows* rows;
    Ids ids;
    std::vector<uint32_t> places;
  };
  void BecomeRows();
  rows::Rows* CommonRows();
  std::vector<DeviceGroup> GroupForDevice(const Ids& ids, Ids* others);
  void AbandonDevice(const std::string& why);
  Ids StepOnDevice(const Ids& ids, uint64_t steps, StepObserver* observer, uint64_t unit);
  void StepOnDevice(std::vector<DeviceGroup> groups, Ids ids, uint64_t steps,
                    StepObserver* observer, uint64_t unit);
  void StepGroup(DeviceGroup* group, uint32_t steps);
  std::vector<ControlFailure> StepRows(const Slot& any, std::span<const uint32_t> places,
                                       uint32_t steps, uint32_t unseen);
  void CallControllers(const Slot& any, std::span<const uint32_t> places, uint32_t step,
                       std::vector<ControlFailure>* failures);
  void Fail(const Ids& ids, const std::string& why);

  /// Calls f(id, thread) for these worlds on all threads. An exception fails its world.
  template <typename F>
  void ForEach(const Ids& ids, F f);

  const std::unique_ptr<PoolDevice> device;  // null: steps are made on the host
  std::vector<std::unique_ptr<PoolVariant>> variants;
  std::vector<uint64_t> seeds;
  std::vector<Slot> slots;  // one per world
  const std::shared_ptr<threads::WorkerPool> workers;
  std::vector<Thread> of_threads;
  // Recent wall time per step and world, with all threads, and on the device; 0: unknown.
  double step_seconds = 0, device_step_seconds = 0;
  std::atomic<uint64_t> forms_changed{1};  // see NoteForm()
  uint64_t forms_of_common = 0;            // its value when `common` was determined
  rows::Rows* common = nullptr;            // see CommonRows()
  uint64_t forms_of_freeing = 0;           // its value when unused rows were freed
  bool may_have_unused_rows = false;       // some are kept for a while

  static thread_local Thread* current;
};

template <typename F>
void WorldPool::Impl::WithWorld(uint32_t id, Thread* thread, F f) {
  const PoolRow row = RowToRead(id, thread);
  if (!row) return f(*Require(id));
  World* const spare = thread->Spare(*slots[id].variant, 0);
  if (!RowBridge::Write(*row.rows, row.row, spare)) return f(*Require(id));
  f(*spare);
}

template <typename F>
void WorldPool::Impl::ForEach(const Ids& ids, F f) {
  // Worlds may take different times, so each thread gets many ranges.
  const size_t grain = std::clamp<size_t>(ids.size() / (size_t{32} * workers->threads()), 1, 16);
  workers->Run(ids.size(), grain, [&](size_t begin, size_t end, unsigned thread) {
    const OnThread on_thread(&of_threads[thread]);
    for (size_t i = begin; i < end; i++) {
      STAGE_ASSERT(ids[i] < slots.size());
      try {
        f(ids[i], &of_threads[thread]);
      } catch (const WorldFailure& failure) {
        slots[ids[i]].failure = failure.why;
        NoteForm();
      } catch (...) {
        slots[ids[i]].failure = DescribeException();
        NoteForm();
      }
    }
  });
}

}  // namespace Stg

#endif
