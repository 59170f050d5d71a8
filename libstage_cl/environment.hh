// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_CL_ENVIRONMENT_HH
#define STAGE_CL_ENVIRONMENT_HH

#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <string>

#include "sensing/prefilter.hh"

namespace Stg::cl {

/// Value of an environment variable, or an empty string if it is not set.
inline std::string FromEnvironment(const char* name) {
  const char* text = std::getenv(name);
  return text ? text : "";
}

/// Value of an integer variable, or `default_value` if it is not set. Throws
/// sensing::PrefilterError.
inline uint32_t NumberFromEnvironment(const std::string& name, uint32_t default_value, uint32_t min,
                                      uint32_t max) {
  const std::string text = FromEnvironment(name.c_str());
  if (text.empty()) return default_value;
  uint32_t number = 0;
  const char* const text_end = text.data() + text.size();
  const auto [end, error] = std::from_chars(text.data(), text_end, number);
  if (error != std::errc() || end != text_end || number < min || number > max)
    throw sensing::PrefilterError(name + " is \"" + text + "\", expected " + std::to_string(min) +
                                  " to " + std::to_string(max));
  return number;
}

}  // namespace Stg::cl

#endif
