// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_THREADS_WALL_CLOCK_HH
#define STAGE_THREADS_WALL_CLOCK_HH

#include <chrono>

namespace Stg::threads {

/// Seconds of a monotonic clock, since an unspecified moment.
inline double WallClock() {
  using Clock = std::chrono::steady_clock;
  return std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
}

}  // namespace Stg::threads

#endif
