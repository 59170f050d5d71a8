// SPDX-License-Identifier: GPL-2.0-or-later
//
// Parsing shared by the command lines of all commands. All functions throw UsageError with one line
// that names the option, what was found and what was expected.

#ifndef STAGE_TOOLS_STAGE_OPTION_VALUES_HH
#define STAGE_TOOLS_STAGE_OPTION_VALUES_HH

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/compression.hh"
#include "recording/ros_messages.hh"
#include "stage.hh"

namespace Stg::program {

/// what() is one line that explains the mistake on the command line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

constexpr double kMaxDuration = 1e12;  // seconds; well below the maximum of usec_t

[[noreturn]] void RefuseValue(const std::string& option, const std::string& expected,
                              const std::string& found);

/// `expected` describes the limits.
double ParseWithin(const std::string& option, double min, double max, const char* expected,
                   const std::string& text);
/// Parses seconds of simulated time.
usec_t ParseDuration(const std::string& option, const std::string& text);
/// Parses NAME,NAME.
std::vector<std::string> ParseNames(const std::string& option, const std::string& text);
recording::Compression ParseCompression(const std::string& option, const std::string& text);
recording::RangeConvention ParseRanges(const std::string& option, const std::string& text);

}  // namespace Stg::program

#endif
