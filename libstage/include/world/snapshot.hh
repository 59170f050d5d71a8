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

struct StateRow;

/// What World::Take() fills in and World::Restore() goes back to. A value: copies share their
/// bytes, which never change. May be handed from thread to thread.
class Snapshot {
 public:
  /// How much of the state.
  enum Keep {
    kFull,
    /// In some hundred bytes for each robot, and in a fraction of the time: as a difference to a
    /// state of the same world that many snapshots share; and without the readings of rangers that
    /// are due in the next step. These are unknown, so empty, from when the world goes back to it
    /// until then; from then on all is as with a full one.
    kLean
  };

  Snapshot() : time_(0), is_from_file_(false) {}

  /// Nothing has been taken.
  bool empty() const { return !row_; }
  /// Bytes; of a lean one, without what it shares.
  size_t size() const;
  /// Bytes of the state that a lean one shares with others; 0 of a full one.
  size_t shared_size() const { return difference_ ? SizeOfRow() : 0; }
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

  /// Of the state. Snapshots of worlds that are in the same state, seed included, have the same, if
  /// both are full or both are lean.
  uint64_t hash() const;

 private:
  friend class World;
  size_t SizeOfRow() const;
  /// The whole state. `room`: for the row, if there is none yet.
  const StateRow& Row(StateRow* room) const;

  std::shared_ptr<const StateRow> row_;
  std::shared_ptr<const StateExchange::Bytes> difference_;  // to that; null: there is none
  usec_t time_;
  bool is_from_file_;
};

}  // namespace Stg

#endif
