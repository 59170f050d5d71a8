// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_SUPPORT_PATIENCE_HH
#define STAGE_TESTS_SUPPORT_PATIENCE_HH

#include <algorithm>
#include <chrono>
#include <cstdint>

/// Time limits of tests that hold on machines of any speed and load. tests/support/patience.py is
/// the equivalent for Python.
namespace patience {

/// Max seconds to wait for an event that must happen. A test goes on as soon as it has happened, so
/// a high limit costs nothing unless the test fails. ctest's own limit is longer, so that the
/// test's message is seen.
inline constexpr double kPatience = 300;

/// The current factor, at least 1, by which this machine is slower than an idle machine with two
/// cores. A test that limits a duration multiplies the limit by it.
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
