// SPDX-License-Identifier: GPL-2.0-or-later
//
// Fans on their way into the batch of a step. Models that update on several threads first list
// their fans; then each fan gets its place in the batch.

#ifndef STAGE_SENSING_FAN_LIST_HH
#define STAGE_SENSING_FAN_LIST_HH

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "sensing/fan.hh"

namespace Stg::internal::sensing {

class FanList {
 public:
  struct Entry {
    Fan fan;
    uint32_t samples = 0;
    bool ignores_own_tree = false;    ///< its rays pass cells of the finder's own tree
    bool has_own_directions = false;  ///< has `samples` own directions, from first_unit_vector on
    size_t first_unit_vector = 0;
  };

  /// Adds a fan with directions from the tables.
  void Add(const Fan& fan, uint32_t samples, bool ignores_own_tree = true);
  /// Adds a fan with its own bearings, in radians.
  void Add(const Fan& fan, std::span<const double> bearings);

  size_t size() const { return entries_.size(); }
  std::span<const Entry> From(size_t first) const { return std::span(entries_).subspan(first); }
  std::span<const SineCosine> UnitVectorsOf(const Entry& entry) const;
  void Clear();

 private:
  std::vector<Entry> entries_;
  std::vector<SineCosine> unit_vectors_;
};

}  // namespace Stg::internal::sensing

#endif
