// SPDX-License-Identifier: GPL-2.0-or-later
//
// A pointer to a world that becomes null when the world is deleted.
//
// Callbacks may delete the world that calls them. A handle tells the calling code whether it did.
// World::Exists() would have to lock a list that all worlds of the process share.

#ifndef STAGE_WORLD_WORLD_HANDLE_HH
#define STAGE_WORLD_WORLD_HANDLE_HH

#include <memory>

#include "models/host.hh"
#include "world/world.hh"

namespace Stg {

/// Use it only in the thread that uses the world. It does not keep the world or its memory alive.
class WorldHandle {
 public:
  WorldHandle() = default;
  /// Null, or a world that exists.
  explicit WorldHandle(World* world) : world_(world) {
    if (!world) return;
    host_ = world->host().shared_from_this();
    host_address_ = &world->host();
  }

  /// The world, or null if it has been deleted.
  World* get() const {
    // The host may outlive its world while a caller of a callback still shares ownership.
    return !host_.expired() && !host_address_->world_deleted ? world_ : nullptr;
  }
  explicit operator bool() const { return get() != nullptr; }

 private:
  World* world_ = nullptr;
  std::weak_ptr<Host> host_;
  const Host* host_address_ = nullptr;  // read directly to avoid the atomic operations of lock()
};

}  // namespace Stg

#endif
