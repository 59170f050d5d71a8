// SPDX-License-Identifier: GPL-2.0-or-later
//
// The rows of a pool, for code of the library that reads and writes their columns.

#ifndef STAGE_WORLDS_POOL_ACCESS_HH
#define STAGE_WORLDS_POOL_ACCESS_HH

#include <cstddef>
#include <cstdint>
#include <span>

#include "rows/device_rows.hh"
#include "rows/rows.hh"
#include "worlds/world_pool.hh"

namespace Stg {

/// A world in a row; without rows it has none.
struct PoolRow {
  rows::Rows* rows = nullptr;
  size_t row = 0;

  explicit operator bool() const { return rows != nullptr; }
};

class PoolAccess {
 public:
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
  /// True if the state of the world is in a World object.
  static bool HasWorld(const WorldPool& pool, uint32_t id);
  /// Like WorldPool::At(), for a caller that does not keep the World object: the world becomes a
  /// row again if it can.
  static World* Borrow(WorldPool& pool, uint32_t id);

  // Pools with a device for whole steps. The functions throw rows::RowDeviceError.

  /// The rows of all worlds on the device, with their newest state; null if it cannot step all
  /// worlds, see WorldPool::WhyNotOnDevice().
  static rows::DeviceRows* OnDevice(WorldPool& pool);
  /// Call it after OnDevice()->Step() and the like.
  static void NoteDeviceSteps(WorldPool& pool);
  /// Like WorldPool::Reset() and then the present subscriptions, if OnDevice() is not null.
  static void ResetOnDevice(WorldPool& pool, std::span<const uint32_t> ids,
                            std::span<const uint64_t> seeds);
};

}  // namespace Stg

#endif
