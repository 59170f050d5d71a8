// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_FORMAT_HH
#define STAGE_TOOLS_STAGE_FORMAT_HH

#include <string>

#include "messages/report.hh"

namespace Stg::program {

using messages::Format;

/// A count with a noun: "1 robot", "12 robots".
std::string Count(double number, const std::string& thing);
/// Three significant digits, or all digits of a whole number: "0.0123", "4.5", "12345".
std::string Rounded(double value);
/// A duration: "0.3 s", "45 s", "4 min", "2.5 h", "3 days".
std::string Time(double seconds);
/// Wraps text at 100 characters; all lines but the first start with `indent` blanks.
std::string Wrapped(const std::string& text, size_t indent);

}  // namespace Stg::program

#endif
