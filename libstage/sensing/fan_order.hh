// SPDX-License-Identifier: GPL-2.0-or-later
//
// The order in which fans are best traced: those of neighbours one after the other, since they look
// at the same cells, which are then at hand.

#ifndef STAGE_SENSING_FAN_ORDER_HH
#define STAGE_SENSING_FAN_ORDER_HH

#include <cstdint>
#include <utility>
#include <vector>

#include "sensing/batch.hh"

namespace Stg::internal::sensing {

class FanOrder {
 public:
  /// A permutation of the indices of the batch's fans. As sensors don't move far in a step, an old
  /// order serves for a while.
  const std::vector<uint32_t>& Of(const RayBatch& batch);

 private:
  std::vector<uint32_t> order_;
  std::vector<std::pair<uint64_t, uint32_t>> keys_;
  unsigned age_ = 0;  // batches
};

}  // namespace Stg::internal::sensing

#endif
