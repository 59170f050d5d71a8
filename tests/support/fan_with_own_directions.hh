// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TESTS_SUPPORT_FAN_WITH_OWN_DIRECTIONS_HH
#define STAGE_TESTS_SUPPORT_FAN_WITH_OWN_DIRECTIONS_HH

#include <vector>

#include "sensing/batch.hh"

namespace Stg::test {

/// Adds a fan with explicit bearings to a batch.
inline void AddTurned(sensing::RayBatch* batch, const sensing::Fan& fan,
                      const std::vector<double>& bearings, const sensing::SelfMask& mask) {
  sensing::FanList list;
  list.Add(fan, bearings);
  sensing::BatchSpace share;
  share += list.From(0)[0];
  batch->Put(batch->Allocate(share), list, list.From(0)[0], mask);
}

}  // namespace Stg::test

#endif
