// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_SUPPORT_PATIENCE_HH
#define STAGE_TESTS_SUPPORT_PATIENCE_HH

#include <algorithm>
#include <chrono>
#include <cstdint>

/// How long tests wait, on machines of any speed and under any load. tests/support/patience.py is
/// the same for Python.
namespace patience {

/// Seconds to wait for what must happen. A test goes on as soon as it has happened, so that the
/// limit costs nothing unless the test fails. ctest's own limit is longer, so that the test's
/// message is seen.
inline constexpr double kPatience = 1200;

/// How many times slower this machine is at this moment than an idle machine of two cores; at
/// least 1. A test that says that something is quick multiplies its limit with it.
inline double Slowness() {
  using Clock = std::chrono::steady_clock;
  constexpr int kRounds = 40'000'000;
  constexpr double kReference = 0.06;  // seconds that the loop below takes on an idle machine
  const auto begin = Clock::now();
  volatile uint32_t sink = 1;
  uint32_t number = sink;
  for (int i = 0; i < kRounds; i++) number = number * 1664525u + 1013904223u;
  sink = number;
  return std::max(1.0, std::chrono::duration<double>(Clock::now() - begin).count() / kReference);
}

}  // namespace patience

#endif
