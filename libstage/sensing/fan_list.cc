// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan_list.hh"

#include "messages/assert.hh"

namespace Stg::internal::sensing {

void FanList::Add(const Fan& fan, uint32_t samples, bool ignores_own_tree) {
  entries_.push_back({fan, samples, ignores_own_tree, false, 0});
}

void FanList::Add(const Fan& fan, std::span<const double> bearings) {
  entries_.push_back(
      {fan, static_cast<uint32_t>(bearings.size()), true, true, unit_vectors_.size()});
  for (const double bearing : bearings) unit_vectors_.push_back(UnitVectorOf(bearing));
}

std::span<const SineCosine> FanList::UnitVectorsOf(const Entry& entry) const {
  if (!entry.has_own_directions) return {};
  STAGE_ASSERT(entry.first_unit_vector + entry.samples <= unit_vectors_.size());
  return std::span(unit_vectors_).subspan(entry.first_unit_vector, entry.samples);
}

void FanList::Clear() {
  entries_.clear();
  unit_vectors_.clear();
}

}  // namespace Stg::internal::sensing
