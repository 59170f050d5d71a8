// SPDX-License-Identifier: GPL-2.0-or-later
//
// The rows of a pool, for code of the library that reads and writes their columns.

#ifndef STAGE_WORLDS_POOL_ACCESS_HH
#define STAGE_WORLDS_POOL_ACCESS_HH

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "rows/device_rows.hh"
#include "rows/rows.hh"
#include "world/snapshot.hh"
#include "worlds/world_pool.hh"

namespace Stg {

class Subscriptions;

/// A world in a row; without rows it has none.
struct PoolRow {
  rows::Rows* rows = nullptr;
  size_t row = 0;

  explicit operator bool() const { return rows != nullptr; }
};

/// A snapshot as a row, from which worlds of a pool are restored.
struct SnapshotRow {
  Subscriptions* subscriptions = nullptr;
  std::unique_ptr<rows::Rows> rows;  ///< one row; null if rows cannot hold the snapshot

  explicit operator bool() const { return rows != nullptr; }
};

/// An exception of a controller that the host calls between steps of a device.
struct ControlFailure {
  size_t index;   ///< of the world, among those that are stepped
  uint32_t step;  ///< number of the step, from 0
  std::string why;
};

class PoolAccess {
 public:
  /// Why worlds of a variant have no rows, in words that follow "because"; empty if they have.
  static std::string WhyNoRows(WorldPool& pool, uint32_t variant = 0);
  /// Reads a snapshot, in a pool of one variant. Readings that it omits stay undefined until the
  /// next step. Several threads of the pool may call it at once.
  static SnapshotRow ReadSnapshot(WorldPool& pool, const Snapshot& from);
  /// Makes the world a row in the state of the snapshot. Several threads may call it for different
  /// worlds; so may they the following functions.
  static void Restore(WorldPool& pool, uint32_t id, const SnapshotRow& from);
  /// Like WorldPool::SetPrototype(), for a scene in which numbers vary; see RowBridge::CanVary().
  static bool SetPrototype(WorldPool& pool, uint32_t variant, const World& prototype,
                           const std::vector<rows::VariedNumber>& varied);
  /// Like WorldPool::Reset(), and gives each world numbers of its own, in the units of the world
  /// file, which it keeps in later resets. `values` has `most` for each world, as many as vary in
  /// any scene; those of other scenes are at the beginning.
  static void Reset(WorldPool& pool, const std::vector<uint32_t>& ids,
                    const std::vector<uint64_t>& seeds, const std::vector<uint32_t>& variants,
                    const double* values, size_t most);
  /// The numbers of a world, in the units of the world file. NaN, or none at all: that of the
  /// prototype.
  static const std::vector<double>& Values(const WorldPool& pool, uint32_t id);
  /// See World::Reseed(). The world is a row.
  static void Reseed(WorldPool& pool, uint32_t id, uint64_t seed);
  /// Makes a step of a world that is a row. Nobody looks at its readings before `unseen` further
  /// steps have been made.
  static void StepRow(WorldPool& pool, uint32_t id, uint64_t unseen);
  /// See WorldPool::Take().
  static bool Take(WorldPool& pool, uint32_t id, Snapshot* to, Snapshot::Keep keep);
  /// The scene of the row that a world is in or can become; null if it has a World object.
  static const rows::Scene* SceneOf(WorldPool& pool, uint32_t id);
  /// A row with the state of the world, if it has no World object. It may be read until the next
  /// call by this thread. Several threads may call it for different worlds.
  static PoolRow RowToRead(WorldPool& pool, uint32_t id);
  /// The row of the world, which may be changed.
  static PoolRow RowToChange(WorldPool& pool, uint32_t id);
  /// Like WorldPool::Subscribe(), for several models.
  static void Subscribe(WorldPool& pool, uint32_t id, std::span<const uint32_t> models);
  /// Moves a robot of RowToChange(); see rows::Rows::Place().
  static void Place(WorldPool& pool, uint32_t id, size_t mover, const rows::Planar& pose);
  /// The present place of a model on the ground. Returns false if there is no such model.
  static bool FindPlace(WorldPool& pool, uint32_t id, uint32_t model, rows::Planar* place);
  /// A world of a variant, as it is after loading.
  static std::shared_ptr<const World> Example(const WorldPool& pool, uint32_t variant);
  /// True if the state of the world is in a World object.
  static bool HasWorld(const WorldPool& pool, uint32_t id);
  /// Like WorldPool::At(), for a caller that does not keep the World object: the world becomes a
  /// row again if it can.
  static World* Borrow(WorldPool& pool, uint32_t id);

  /// Makes the world a row in the state of the snapshot, which the caller writes. Several threads
  /// may call it for different worlds.
  static PoolRow Enter(WorldPool& pool, uint32_t id, const SnapshotRow& from);

  /// Casts rays in a world; see rows::Rows::Cast(). Returns false if it has a World object. Several
  /// threads may call it for different worlds.
  static bool Cast(WorldPool& pool, uint32_t id, const rows::Casting& casting,
                   std::span<const rows::Planar> poses, const uint32_t* ignored, double* ranges);
  /// Finds the contacts in a world; see rows::Rows::FindContacts(). Returns false if it has a World
  /// object. Several threads may call it for different worlds.
  static bool FindContacts(WorldPool& pool, uint32_t id, std::vector<ContactPoint>* to);
  /// Calls call(world) with a World object in the state of a world, which it must not change.
  /// Several threads may call it for different worlds. Returns false, without a call, if the world
  /// does not exist.
  static bool Look(WorldPool& pool, uint32_t id, const std::function<void(World& world)>& call);

  // States as words.

  /// The subscriptions of a world whose state is in a row or can be; null if it has a World object.
  /// One that is only lent becomes a row again.
  static Subscriptions* SubscriptionsOf(WorldPool& pool, uint32_t id);
  /// Subscriptions of worlds of a variant; null, with the reason, if such worlds are not closed.
  static Subscriptions* FindSubscriptions(WorldPool& pool, uint32_t variant,
                                          std::span<const uint32_t> models, std::string* reason);
  static bool IsReseeded(const WorldPool& pool, uint32_t id);
  /// False if the world cannot become a row, because clients expect callbacks.
  static bool CanEnter(WorldPool& pool, uint32_t id);
  /// Makes the world a row, which the caller writes. Several threads may call it for different
  /// worlds.
  static PoolRow Enter(WorldPool& pool, uint32_t id, Subscriptions* subscriptions);
  /// Hash of the texts of the files that worlds of a variant are loaded from.
  static uint64_t HashOfFiles(WorldPool& pool, uint32_t variant);

  // Pools with a device for whole steps. The functions throw rows::RowDeviceError.

  /// The rows of all worlds on the device, with their newest state; null if it cannot step all
  /// worlds, see WorldPool::WhyNotOnDevice().
  static rows::DeviceRows* OnDevice(WorldPool& pool);
  /// Rows on the device, which can step them, with their newest state.
  static rows::DeviceRows* OnDevice(WorldPool& pool, rows::Rows* rows);
  /// Why the device cannot step rows of this scene, in words that follow "because"; empty if it
  /// can.
  static std::string WhyNotOnDevice(WorldPool& pool,
                                    const std::shared_ptr<const rows::Scene>& scene);
  /// Like that, for the scene of a world that has just been loaded, in a pool of one variant that
  /// has rows.
  static std::string WhyNotOnDevice(WorldPool& pool);
  /// Steps worlds that are in the same rows as world `id`. Nobody looks at their readings before
  /// `unseen` further steps.
  static std::vector<ControlFailure> StepOnDevice(WorldPool& pool, uint32_t id,
                                                  std::span<const uint32_t> places, uint32_t steps,
                                                  uint32_t unseen);
  /// True if the host calls controllers of worlds of the first variant between steps of a device,
  /// so that OnDevice() is null.
  static bool HasControlsOnHost(WorldPool& pool);
  /// Call it after OnDevice()->Step() and the like.
  static void NoteDeviceSteps(WorldPool& pool);
  static void NoteDeviceSteps(WorldPool& pool, const rows::Rows* rows);
  /// Call it when the map of a scene changes, see rows::ChangingMap: states that the device has are
  /// not specified until somebody writes them.
  static void ForgetDeviceStates(WorldPool& pool);
  /// Forgets the device's rows after an error; what only the device had is lost.
  static void AbandonDevice(WorldPool& pool);
  /// The numbers of worlds for a reset, as in Reset().
  struct OwnValues {
    const double* data;  ///< null: those that the worlds have
    size_t most;         ///< for each world; those beyond what varies in its scene are not used
  };
  /// Like WorldPool::Reset() and then the present subscriptions, if OnDevice() is not null.
  static void ResetOnDevice(WorldPool& pool, std::span<const uint32_t> ids,
                            std::span<const uint64_t> seeds, OwnValues values = {nullptr, 0});
  /// Like that, for all worlds, in any order. They become those of a variant of the same file that
  /// had no worlds.
  static void ResetToVariant(WorldPool& pool, uint32_t variant, const std::vector<uint32_t>& ids,
                             const std::vector<uint64_t>& seeds, OwnValues values);
  /// Makes all worlds those of a variant of the same file in which more numbers vary. They keep
  /// their states. `values`: those that they get in later resets. Returns why it can't be done, and
  /// "" after it has been done. Only if OnDevice() is not null.
  static std::string CarryToVariant(WorldPool& pool, uint32_t variant, OwnValues values);

 private:
  static void SetValues(WorldPool& pool, uint32_t id, const double* values, size_t most);
};

}  // namespace Stg

#endif
