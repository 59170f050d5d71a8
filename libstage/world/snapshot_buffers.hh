// SPDX-License-Identifier: GPL-2.0-or-later
//
// Data that a world keeps between snapshots.

#ifndef STAGE_WORLD_SNAPSHOT_BUFFERS_HH
#define STAGE_WORLD_SNAPSHOT_BUFFERS_HH

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "world/state_row.hh"

namespace Stg {

/// The list of models as a section of a row, and what follows from it. Valid as long as the world's
/// topology version is that one.
struct ModelList {
  /// Kind of parts of a model whose number ExchangeState() expects to be unchanged.
  enum Parts : unsigned char { kNone, kSensors, kBumpers, kCells, kPoints, kUnknown };

  uint64_t topology_version = ~uint64_t{0};
  StateRow::Bytes section;
  std::vector<Parts> parts;  ///< one entry per model
};

/// The section of names. Valid as long as both versions are those of the world.
struct NameList {
  uint64_t topology_version = ~uint64_t{0}, names_version = ~uint64_t{0};
  StateRow::Bytes section;
};

struct SnapshotBuffers {
  ModelList list;
  NameList names;
  // Buffers, kept for their memory.
  StateRow row, before;
  StateRow::Bytes difference;
  /// Row to which lean snapshots store their difference.
  std::shared_ptr<const StateRow> shared;

  /// Computes the difference of `row` to `shared`. If it is too large, or fits other worlds, `row`
  /// becomes the new shared row.
  void KeepDifference(std::shared_ptr<const StateRow>* to_what,
                      std::shared_ptr<const StateRow::Bytes>* to) {
    constexpr size_t kTooMuch = 4;  // limit of the difference: row size / kTooMuch
    difference.clear();
    if (shared) AppendDifference(*shared, row, &difference);
    if (!shared || shared->fit != row.fit || difference.size() > row.bytes.size() / kTooMuch) {
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
