// SPDX-License-Identifier: GPL-2.0-or-later
//
// A line on standard error that is overwritten repeatedly.

#ifndef STAGE_TOOLS_STAGE_STATUS_LINE_HH
#define STAGE_TOOLS_STAGE_STATUS_LINE_HH

#include <cstddef>
#include <string>

namespace Stg::program {

class StatusLine {
 public:
  StatusLine() = default;
  ~StatusLine() { Erase(); }
  StatusLine(const StatusLine&) = delete;
  StatusLine& operator=(const StatusLine&) = delete;

  void Print(const std::string& text);
  /// Clears the line so that something else can be printed.
  void Erase();

 private:
  size_t length_ = 0;
};

/// Formats a duration: "9 s", "4 min 5 s", "2 h 10 min".
std::string DurationText(double seconds);

}  // namespace Stg::program

#endif
