// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_CL_CALL_CLOCK_HH
#define STAGE_CL_CALL_CLOCK_HH

#include <algorithm>
#include <chrono>

#include "libstage_cl/calls.hh"

namespace Stg::cl {

/// Detects calls that take too long. Counts its own naps instead of reading a clock, because a
/// stopped process or a sleeping laptop does not mean a slow driver.
class CallClock {
 public:
  /// `seconds` is the limit; 0 means no limit.
  explicit CallClock(unsigned seconds)
      : limit_(std::chrono::seconds(seconds)), nap_(seconds == 1 ? 50 : 200) {}

  /// Time to sleep between checks.
  std::chrono::milliseconds nap() const { return nap_; }

  /// Call after each nap, always for one record. Returns true if its call has taken too long.
  bool IsOverdue(const calls::Record& record) {
    const uint32_t call_count = record.call_count.load(std::memory_order_relaxed);
    const bool same =
        record.call.load(std::memory_order_acquire) != nullptr && call_count == begun_;
    begun_ = call_count;
    taken_ = same ? taken_ + nap_ : std::chrono::milliseconds(0);
    return limit_.count() > 0 && taken_ >= limit_;
  }

 private:
  std::chrono::milliseconds limit_, nap_, taken_{0};
  uint32_t begun_ = 0;
};

}  // namespace Stg::cl

#endif
