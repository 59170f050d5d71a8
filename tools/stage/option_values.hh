// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the commands of the program have in common on their command lines. All of these throw
// UsageError, in one line that names the option, what was found and what was expected.

#ifndef STAGE_TOOLS_STAGE_OPTION_VALUES_HH
#define STAGE_TOOLS_STAGE_OPTION_VALUES_HH

#include <getopt.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "recording/compression.hh"
#include "recording/ros_messages.hh"
#include "stage.hh"

namespace Stg::program {

/// what() is one line that says what is wrong with the command line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Options without a short form have values from here on, above all characters.
constexpr int kFirstLongOption = 256;
constexpr double kLongestDuration = 1e12;  // seconds; keeps microseconds well inside usec_t

[[noreturn]] void RefuseValue(const std::string& option, const std::string& expected,
                              const std::string& found);

/// What getopt_long(), with a colon in front of its short options, did not understand: `id` is what
/// it has returned, `word` the one it has looked at last.
[[noreturn]] void RefuseOption(int id, const option* table, const std::string& word);

/// `expected` says what the limits are.
double ParseWithin(const std::string& option, double least, double most, const char* expected,
                   const std::string& text);
/// Simulated seconds.
usec_t ParseDuration(const std::string& option, const std::string& text);
/// NAME,NAME
std::vector<std::string> ParseNames(const std::string& option, const std::string& text);
uint64_t ParseSeed(const std::string& option, const std::string& text);
int ParseThreads(const std::string& option, const std::string& text);
RayModel ParseRayModel(const std::string& option, const std::string& text);
recording::Compression ParseCompression(const std::string& option, const std::string& text);
recording::RangeConvention ParseRanges(const std::string& option, const std::string& text);

}  // namespace Stg::program

#endif
