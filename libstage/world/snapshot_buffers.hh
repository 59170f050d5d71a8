// SPDX-License-Identifier: GPL-2.0-or-later
//
// Data that a world keeps between snapshots.

#ifndef STAGE_WORLD_SNAPSHOT_BUFFERS_HH
#define STAGE_WORLD_SNAPSHOT_BUFFERS_HH

#include <memory>
#include <utility>

#include "world/state_row.hh"

namespace Stg {

struct SnapshotBuffers {
  // Buffers, kept for their memory.
  StateRow row, before;
  StateRow::Bytes difference;
  /// Row to which lean snapshots store their difference.
  std::shared_ptr<const StateRow> shared;

  /// Computes the difference of `row` to `shared`. If it is too large, `row` becomes the new shared
  /// row.
  void KeepDifference(std::shared_ptr<const StateRow>* to_what,
                      std::shared_ptr<const StateRow::Bytes>* to) {
    constexpr size_t kTooMuch = 4;  // limit of the difference: row size / kTooMuch
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
