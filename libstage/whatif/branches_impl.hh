// SPDX-License-Identifier: GPL-2.0-or-later
//
// The branches of a world; part of branches.hh.
//
// The worlds of a pool are those of the threads, followed by the branches. A branch is a row of the
// pool, or a snapshot, which the world of a thread is restored from in order to make steps. It
// becomes a row when it makes steps that need no World, and a snapshot when a World is needed.

#ifndef STAGE_WHATIF_BRANCHES_IMPL_HH
#define STAGE_WHATIF_BRANCHES_IMPL_HH

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "models/exception_origin.hh"
#include "whatif/branches.hh"
#include "whatif/command_check.hh"
#include "whatif/row_models.hh"
#include "world/world.hh"
#include "worlds/pool_access.hh"
#include "worlds/world_pool.hh"

namespace Stg {

using whatif::RowModels;

struct Branches::Impl {
  struct Copy;
  /// A state that branches start from: a row, or a snapshot, which the first branch that becomes a
  /// row reads.
  struct Origin {
    explicit Origin(const Snapshot& from) : snapshot(from) {}
    explicit Origin(SnapshotRow given) : row(std::move(given)) {}
    const Snapshot snapshot;
    std::once_flag once;
    SnapshotRow row;
  };
  struct Row {
    Branch seen;
    const RowModels* models = nullptr;  // if it is a row of the pool
    Snapshot state;                     // if it is not
    std::shared_ptr<Origin> origin;     // of `state`, if known; on the device, that of the row
    bool can_be_row = true;             // as far as is known
    bool records = true;                // otherwise only the latest sightings are kept
    bool needs_end = true;              // somebody may ask for its state after it has ended
    uint64_t seed = 0;
    bool reseed = false;  // reseed before the branch's next step
    CommandCheck check;
    size_t applied = 0;      // number of commands carried out so far
    Copy* latest = nullptr;  // copy whose world was last in this state
    PoolRow at;              // on the device
    // On the device: how the branch was started from its origin.
    struct Start {
      bool is_pending = false;  // the state has not been sent yet
      bool is_whole = false;    // the row on the host has all columns of it, not only some
      bool reseeds = false;
      uint64_t step = 0;
      size_t applied = 0;
    } start;
  };
  /// A thread's world of the pool.
  struct Copy {
    uint32_t id;
    uint64_t times_made = 0;        // value of WorldPool::times_made() when it was last used
    const Row* resident = nullptr;  // row whose latest state the world is in
  };

  Impl(const World& prototype, uint32_t count, const BranchOptions& wanted)
      : options(wanted), pool(prototype, {}, PoolOptionsOf(wanted)), seed(prototype.seed()) {
    for (uint32_t id = 0; id < pool.threads(); id++) copies.push_back({id});
    Resize(count);
    ready = pool.IsReady() && pool.At(0);
    uses_device = ready && options.rows && !pool.StepDevice().empty();
  }

  static WorldPoolOptions PoolOptionsOf(const BranchOptions& options) {
    WorldPoolOptions of_pool;
    of_pool.threads = options.threads;
    of_pool.device = options.device;
    of_pool.branch = true;
    of_pool.device_steps = options.device_steps;
    of_pool.device_choice = options.device_choice;
    of_pool.changing_map = options.changing_map;
    return of_pool;
  }
  void Resize(size_t count) {
    rows.resize(count);
    pool.Resize(std::vector<uint64_t>(copies.size() + count, seed));
  }
  static void ClearQuit(World* world) {
    world->SetQuitTime(0);
    world->CancelQuit();
  }
  World* WorldOf(Copy* copy);
  World* ExistingWorldOf(const Copy& copy);
  bool LoadState(Row* row, Copy* copy);
  void SaveState(Row* row, Copy* copy);
  void Step(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario, bool needs_world,
            Copy* copy);
  bool StepOnce(Row* row, uint32_t branch, Scenario* scenario, bool needs_world, Copy* copy);
  void ApplyCommands(Row* row, World* world);
  void RecordSightings(Row* row, const World& world) const;
  static void Fail(Row* row, Copy* copy, const std::string& why);
  static void Refuse(Row* row, Copy* copy, const CommandRefused& refused);
  /// Restores the branch in the copy's world, calls f(), and stores the resulting state.
  template <typename F>
  void WithWorld(Row* row, Copy* copy, F f);

  // Branches that are rows.
  uint32_t IdOf(uint32_t branch) const { return static_cast<uint32_t>(copies.size()) + branch; }
  std::shared_ptr<Origin> OriginOf(const Snapshot& from);
  void Start(uint32_t branch, std::shared_ptr<Origin> from);
  void BeginSightings(Row* row) const {
    if (!row->records) row->seen.sightings.clear();
  }
  const RowModels* ModelsOf(const rows::Scene& scene);
  bool ReadOrigin(Row* row);
  bool BecomeRow(Row* row, uint32_t branch);
  void RestoreRow(const Row& row, uint32_t branch, bool reseeds);
  void BecomeSnapshot(Row* row, uint32_t branch, Copy* copy);
  Snapshot TakeOf(uint32_t branch);
  bool ApplyCommands(Row* row, const PoolRow& at);
  uint64_t StepRow(Row* row, uint32_t branch, uint64_t steps, Scenario* scenario);
  /// The sightings of the branch's last step.
  const Sighting* LatestOf(const Row& row) const {
    return row.seen.sightings.data() + row.seen.sightings.size() - options.watched.size();
  }

  // Branches on the device, see branches_on_device.cc.
  /// Steps of a branch that are left.
  struct Rest {
    uint32_t branch;
    uint64_t steps;
  };
  class DeviceRun;
  std::vector<Rest> StepOnDevice(const std::vector<uint32_t>& alive, uint64_t steps,
                                 Scenario* scenario);
  std::vector<uint32_t> ChooseForDevice(const std::vector<uint32_t>& alive, uint64_t steps,
                                        std::vector<Rest>* rest);
  bool CanEnter(const Row& row);
  void EnterRow(Row* row, uint32_t branch, bool whole);
  void TakeOver(const std::string& why);
  void Repeat(Row* row, uint32_t branch);
  /// Calls f(branch, row, copy) on all threads; an exception fails the branch.
  template <typename F>
  void ForEach(const std::vector<uint32_t>& branches, F f);
  void FetchRow(uint32_t branch);
  void StepOnHost(const std::vector<Rest>& rest, Scenario* scenario, bool needs_world);

  const BranchOptions options;
  WorldPool pool;
  const uint64_t seed;
  std::vector<Row> rows;
  std::vector<Copy> copies;  // one per thread
  bool ready = false;
  static constexpr size_t kRecent = 8;
  std::vector<std::shared_ptr<Origin>> recent;  // the latest is the last
  std::mutex making_models;
  std::map<const rows::Scene*, std::unique_ptr<const RowModels>> models;
  std::atomic<uint64_t> steps_in_rows{0};
  uint64_t steps_on_device = 0;
  bool uses_device = false;
  std::mutex taking;
};

template <typename F>
void Branches::Impl::ForEach(const std::vector<uint32_t>& branches, F f) {
  pool.Run(branches.size(), [&](size_t i, unsigned thread) {
    Row& row = rows[branches[i]];
    try {
      f(branches[i], &row, &copies[thread]);
    } catch (...) {
      Fail(&row, &copies[thread], DescribeException());
    }
  });
}

/// Branches that start from rows, for code of this module.
class BranchAccess {
 public:
  using Origin = Branches::Impl::Origin;

  static WorldPool& PoolOf(Branches& branches) { return branches.impl_->pool; }
  /// Starts a branch from a row, which must not change while branches are stepped. `records`: the
  /// sightings of all steps are kept, otherwise only those of the last one. Its state is not
  /// specified after it has ended.
  static void Restore(Branches& branches, uint32_t branch, std::shared_ptr<Origin> from,
                      bool records);
  /// Appends the sightings of the watched models of a row.
  static void Watch(Branches& branches, const rows::Rows& rows, std::vector<Sighting>* to) {
    branches.impl_->ModelsOf(rows.scene())->Watch(rows, 0, to);
  }
};

}  // namespace Stg

#endif
