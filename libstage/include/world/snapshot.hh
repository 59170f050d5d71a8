// SPDX-License-Identifier: GPL-2.0-or-later
//
// Snapshot: the state of a world at one moment, to go back to. Part of <stage.hh>.

#ifndef STAGE_WORLD_SNAPSHOT_HH
#define STAGE_WORLD_SNAPSHOT_HH

#include <stddef.h>
#include <stdint.h>

#include <iosfwd>
#include <memory>
#include <string>

#include "geometry/geometry.hh"
#include "models/state_exchange.hh"

namespace Stg {

/// What World::Take() fills in and World::Restore() goes back to. A value: copies share their
/// bytes, which never change. May be handed from thread to thread.
class Snapshot {
 public:
  Snapshot() : time_(0), is_from_file_(false) {}

  /// Nothing has been taken.
  bool empty() const { return !bytes_; }
  /// Bytes.
  size_t size() const { return bytes_ ? bytes_->size() : 0; }
  /// Simulated, when it was taken, microseconds.
  usec_t time() const { return time_; }
  /// Writes it, in a form that every build on every processor can read. False if the stream fails.
  bool Write(std::ostream& out) const;
  /// Reads what Write() has written. `name`: what the stream is called in messages. False, with a
  /// message, and *this as it was, if it is something else, is damaged, or was cut short. Takes no
  /// more memory than there are bytes to read.
  bool Read(std::istream& in, const std::string& name = "the snapshot");
  /// What a file begins with that Write() has written.
  static const char kMagic[9];

  /// Of the bytes. Two worlds that are in the same state, seed included, have equal bytes.
  uint64_t hash() const;

 private:
  friend class World;
  std::shared_ptr<const StateExchange::Bytes> bytes_;
  usec_t time_;
  bool is_from_file_;
};

}  // namespace Stg

#endif
