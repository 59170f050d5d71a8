// SPDX-License-Identifier: GPL-2.0-or-later
//
// Numbers on command lines.

#ifndef STAGE_BENCHMARKS_TRUTH_NUMBERS_HH
#define STAGE_BENCHMARKS_TRUTH_NUMBERS_HH

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <stdexcept>
#include <string>

namespace truth {

struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The number that the whole text is.
inline double Number(const std::string& option, const std::string& text, double low, double high) {
  double value = 0;
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc() && stop == end && value >= low && value <= high) return value;
  char range[80];
  std::snprintf(range, sizeof range, "a number from %g to %g", low, high);
  throw UsageError(option + ": found '" + text + "', expected " + range);
}

/// The same for a whole number.
inline uint64_t WholeNumber(const std::string& option, const std::string& text, double low,
                            double high) {
  const double value = Number(option, text, low, high);
  if (value == std::floor(value)) return static_cast<uint64_t>(value);
  throw UsageError(option + ": found '" + text + "', expected a whole number");
}

}  // namespace truth

#endif
