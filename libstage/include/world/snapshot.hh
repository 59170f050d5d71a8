// SPDX-License-Identifier: GPL-2.0-or-later
//
// Snapshot: the state of a world at one moment, to go back to. Part of <stage.hh>.

#ifndef STAGE_WORLD_SNAPSHOT_HH
#define STAGE_WORLD_SNAPSHOT_HH

#include <stddef.h>
#include <stdint.h>

#include <memory>
#include <string>

#include "geometry/geometry.hh"
#include "models/state_exchange.hh"

namespace Stg {

/// What World::Take() fills in and World::Restore() goes back to. A value: copies share their
/// bytes, which never change. May be handed from thread to thread.
class Snapshot {
 public:
  Snapshot() : time_(0) {}

  /// Nothing has been taken.
  bool empty() const { return !bytes_; }
  /// Bytes.
  size_t size() const { return bytes_ ? bytes_->size() : 0; }
  /// Simulated, when it was taken, microseconds.
  usec_t time() const { return time_; }
  /// Of the bytes. Two worlds that are in the same state, seed included, have equal bytes.
  uint64_t hash() const;

 private:
  friend class World;
  std::shared_ptr<const StateExchange::Bytes> bytes_;
  usec_t time_;
};

}  // namespace Stg

#endif
