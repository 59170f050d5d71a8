// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of a world as a row of bytes in sections: one per model and some for the world itself.
// Most of it rarely changes, so a row is usually stored as its difference to another one.

#ifndef STAGE_WORLD_STATE_ROW_HH
#define STAGE_WORLD_STATE_ROW_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "messages/assert.hh"

namespace Stg {

struct StateRow {
  using Bytes = std::vector<unsigned char>;

  Bytes bytes;
  std::vector<uint32_t> ends;  ///< ends of the sections, in bytes
  /// Hash of what a world must have for the row to be restored directly: see Restorer::Fits(). 0:
  /// unknown, as in rows from files.
  uint64_t fit = 0;

  std::size_t count() const { return ends.size(); }
  std::span<const unsigned char> section(std::size_t i) const {
    STAGE_ASSERT(i < ends.size());
    const uint32_t begin = i > 0 ? ends[i - 1] : 0;
    return std::span(bytes).subspan(begin, ends[i] - begin);
  }
  void Clear() {
    bytes.clear();
    ends.clear();
    fit = 0;
  }
  bool operator==(const StateRow& o) const { return bytes == o.bytes && ends == o.ends; }
};

bool SameBytes(std::span<const unsigned char> a, std::span<const unsigned char> b);

/// Appends the difference of `row` to `base`. For use in memory only: Patch() does not validate it.
void AppendDifference(const StateRow& base, const StateRow& row, StateRow::Bytes* difference);
/// Applies a difference to `base` and stores the result in *row.
void Patch(const StateRow& base, std::span<const unsigned char> difference, StateRow* row);

}  // namespace Stg

#endif
