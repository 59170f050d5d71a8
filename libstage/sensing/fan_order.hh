// SPDX-License-Identifier: GPL-2.0-or-later
//
// Order of tracing: fans of one robot together, then those of its neighbours, because they read the
// same cells, which are then in the cache.

#ifndef STAGE_SENSING_FAN_ORDER_HH
#define STAGE_SENSING_FAN_ORDER_HH

#include <cstdint>
#include <span>
#include <vector>

#include "sensing/batch.hh"

namespace Stg::internal::sensing {

/// Consecutive fans of a batch that are traced together: of one model, with at most RayGroup::kMost
/// rays, except for a single larger fan.
struct FanInterval {
  uint32_t first, count;
};

/// Sort key of a start cell: cells with similar keys are mostly close to each other.
uint64_t PlaceKeyOf(int32_t cell_x, int32_t cell_y);

class FanOrder {
 public:
  /// All fans of the batch, sorted by place. Reused for some batches, as sensors move slowly.
  const std::vector<FanInterval>& Of(const RayBatch& batch);
  /// All fans in the order of the batch.
  const std::vector<FanInterval>& InBatch(const RayBatch& batch);

 private:
  void Update(const RayBatch& batch);
  void MakeIntervals(std::span<const Fan> fans);
  void Sort(std::span<const Fan> fans);

  std::vector<FanInterval> in_batch_, order_;
  struct Keyed {
    uint64_t key;
    FanInterval interval;
  };
  std::vector<Keyed> keyed_;  // scratch
  uint32_t fans_ = 0;         // number of fans in the batch that was sorted
  unsigned age_ = 0;          // number of batches since
};

}  // namespace Stg::internal::sensing

#endif
