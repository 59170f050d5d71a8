// SPDX-License-Identifier: GPL-2.0-or-later
//
// The order in which fans are best traced: those of a robot together, and those of neighbours one
// after the other, since they look at the same cells, which are then at hand.

#ifndef STAGE_SENSING_FAN_ORDER_HH
#define STAGE_SENSING_FAN_ORDER_HH

#include <cstdint>
#include <span>
#include <vector>

#include "sensing/batch.hh"

namespace Stg::internal::sensing {

/// Fans of a batch that are traced together: the next to each other in it, of one model, with no
/// more rays than are walked together.
struct FanRun {
  uint32_t first, count;
};

/// Fans that begin in cells with keys next to each other begin near each other.
uint64_t PlaceKeyOf(int32_t cell_x, int32_t cell_y);

class FanOrder {
 public:
  /// All fans of the batch. As sensors don't move far in a step, an old order serves for a while.
  const std::vector<FanRun>& Of(const RayBatch& batch);
  /// The same in the order of the batch.
  const std::vector<FanRun>& InBatch(const RayBatch& batch);

 private:
  void Renew(const RayBatch& batch);
  void MakeRuns(std::span<const Fan> fans);
  void Sort(std::span<const Fan> fans);

  std::vector<FanRun> in_batch_, order_;
  struct Keyed {
    uint64_t key;
    FanRun run;
  };
  std::vector<Keyed> keyed_;  // scratch
  uint32_t fans_ = 0;         // of the batch that the order is of
  unsigned age_ = 0;          // batches
};

}  // namespace Stg::internal::sensing

#endif
