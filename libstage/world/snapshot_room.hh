// SPDX-License-Identifier: GPL-2.0-or-later
//
// What a world keeps from one snapshot to the next.

#ifndef STAGE_WORLD_SNAPSHOT_ROOM_HH
#define STAGE_WORLD_SNAPSHOT_ROOM_HH

#include <memory>
#include <utility>

#include "world/state_row.hh"

namespace Stg {

struct SnapshotRoom {
  // For their memory.
  StateRow row, before;
  StateRow::Bytes difference;
  /// What lean snapshots are differences to.
  std::shared_ptr<const StateRow> shared;

  /// Of `row` to `shared`. If that has become too different, the row is the next one that
  /// snapshots share.
  void KeepDifference(std::shared_ptr<const StateRow>* to_what,
                      std::shared_ptr<const StateRow::Bytes>* to) {
    constexpr size_t kTooMuch = 4;  // of a row: a fourth of it
    difference.clear();
    if (shared) AppendDifference(*shared, row, &difference);
    if (!shared || difference.size() > row.bytes.size() / kTooMuch) {
      shared = std::make_shared<const StateRow>(row);
      difference.clear();
      AppendDifference(*shared, row, &difference);
    }
    *to_what = shared;
    *to = std::make_shared<const StateRow::Bytes>(difference);
  }
};

}  // namespace Stg

#endif
