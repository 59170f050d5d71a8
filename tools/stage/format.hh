// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_FORMAT_HH
#define STAGE_TOOLS_STAGE_FORMAT_HH

#include <string>

namespace Stg::program {

/// As printf() would print it.
[[gnu::format(printf, 1, 2)]] std::string Format(const char* format, ...);

/// A number of things: "1 robot", "12 robots".
std::string Count(double number, const std::string& thing);
/// With three digits, or all those of a whole number: "0.0123", "4.5", "12345".
std::string Rounded(double value);
/// "0.3 s", "45 s", "4 min", "2.5 h", "3 days".
std::string Time(double seconds);
/// In lines of at most 100 characters; all but the first begin with `indent` blanks.
std::string Wrapped(const std::string& text, size_t indent);

}  // namespace Stg::program

#endif
