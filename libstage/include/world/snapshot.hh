// SPDX-License-Identifier: GPL-2.0-or-later
//
// Snapshot: the state of a world at one moment, which can be restored. Part of <stage.hh>.

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

/// Filled in by World::Take() and used by World::Restore(). Copies share their immutable data and
/// may be used by different threads.
class Snapshot {
 public:
  /// How much of the state a snapshot contains.
  enum Keep {
    kFull,
    /// Smaller (some hundred bytes per robot) and much faster: stores the difference to a state
    /// that many snapshots of the world share, and omits readings of rangers due in the next step.
    /// After restoring, these are empty until that step; from then on the world equals one restored
    /// from a full snapshot.
    kLean
  };

  Snapshot() : time_(0), is_from_file_(false) {}

  /// True if no snapshot was taken.
  bool empty() const { return !row_; }
  /// True if both are copies of one snapshot. Equal states of different snapshots do not count.
  bool IsCopyOf(const Snapshot& other) const {
    return row_ == other.row_ && difference_ == other.difference_;
  }
  /// Size in bytes; for a lean snapshot without the shared state.
  size_t size() const;
  /// Bytes of the shared state of a lean snapshot; 0 for a full one.
  size_t shared_size() const { return difference_ ? SizeOfRow() : 0; }
  /// Simulated time at which it was taken, in microseconds.
  usec_t time() const { return time_; }
  /// Writes the snapshot in a portable format. Returns false if the stream fails.
  bool Write(std::ostream& out) const;
  /// Reads what Write() has written; `name` is the stream's name in messages. Returns false with a
  /// message, and leaves *this unchanged, if the data is invalid, damaged or truncated. Allocates
  /// no more memory than there are bytes to read.
  bool Read(std::istream& in, const std::string& name = "the snapshot");
  /// The first bytes of a snapshot file.
  static const char kMagic[9];

  /// Hash of the state. Snapshots of worlds in equal states, including the seed, have equal hashes
  /// if both are full or both are lean.
  uint64_t hash() const;

 private:
  friend class World;
  size_t SizeOfRow() const;
  /// The whole state. `buffer` is a buffer for the row if it must be computed.
  const StateRow& Row(StateRow* buffer) const;

  std::shared_ptr<const StateRow> row_;
  std::shared_ptr<const StateExchange::Bytes> difference_;  // to row_; null: none
  usec_t time_;
  bool is_from_file_;
};

}  // namespace Stg

#endif
