// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/fan_list.hh"

#include "messages/assert.hh"

namespace Stg::internal::sensing {

void FanList::Add(const Fan& fan, uint32_t samples, bool past_own_tree) {
  entries_.push_back({fan, samples, past_own_tree, false, 0});
}

void FanList::Add(const Fan& fan, std::span<const double> bearings) {
  entries_.push_back({fan, static_cast<uint32_t>(bearings.size()), true, true, turns_.size()});
  for (const double bearing : bearings) turns_.push_back(TurnOf(bearing));
}

std::span<const SineCosine> FanList::TurnsOf(const Entry& entry) const {
  if (!entry.turned) return {};
  STAGE_ASSERT(entry.first_turn + entry.samples <= turns_.size());
  return std::span(turns_).subspan(entry.first_turn, entry.samples);
}

void FanList::Clear() {
  entries_.clear();
  turns_.clear();
}

}  // namespace Stg::internal::sensing
