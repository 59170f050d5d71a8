// SPDX-License-Identifier: GPL-2.0-or-later
//
// The numbers of a batch as records of the kernels.

#ifndef STAGE_CONTROL_RECORDS_HH
#define STAGE_CONTROL_RECORDS_HH

#include <cstring>

#include "control/batch_controller.hh"
#include "kernels/row_records.h"

namespace Stg::control {

static_assert(sizeof(RandomStream) == sizeof(row_random_t));

inline row_random_t RecordOf(const RandomStream& random) {
  row_random_t record;
  std::memcpy(&record, static_cast<const void*>(&random), sizeof record);
  return record;
}
inline void Store(const row_random_t& record, RandomStream* random) {
  std::memcpy(static_cast<void*>(random), &record, sizeof record);
}
inline row_planar_t RecordOf(const PlanarPose& pose) { return {pose.x, pose.y, pose.a}; }
inline row_planar_t RecordOf(const PlanarVelocity& v) { return {v.x, v.y, v.a}; }

}  // namespace Stg::control

#endif
