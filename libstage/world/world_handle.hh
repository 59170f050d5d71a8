// SPDX-License-Identifier: GPL-2.0-or-later
//
// A pointer to a world that becomes null when the world is deleted.
//
// Callbacks may delete the world that they are called in. Code that goes on afterwards holds a
// handle, which answers from the world's own memory: World::Exists() would have to ask a list that
// all worlds of the process share, and a lock with it.

#ifndef STAGE_WORLD_WORLD_HANDLE_HH
#define STAGE_WORLD_WORLD_HANDLE_HH

#include <memory>

#include "models/host.hh"
#include "world/world.hh"

namespace Stg {

/// To be used by the thread that uses the world. It does not keep the world, or its memory, alive.
class WorldHandle {
 public:
  WorldHandle() = default;
  /// The world exists, or is null.
  explicit WorldHandle(World* world) : world_(world) {
    if (!world) return;
    host_ = world->ShareHost();
    host_address_ = &world->host();
  }

  /// Null once the world is deleted.
  World* get() const {
    // The host outlives its world while code that called a callback still shares in it.
    return !host_.expired() && !host_address_->deserted ? world_ : nullptr;
  }
  explicit operator bool() const { return get() != nullptr; }

 private:
  World* world_ = nullptr;
  std::weak_ptr<Host> host_;
  const Host* host_address_ = nullptr;  // read without the atomic operations of lock()
};

}  // namespace Stg

#endif
