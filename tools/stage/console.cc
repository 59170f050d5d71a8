// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/console.hh"

#include <atomic>
#include <cstdio>
#include <string>

#include "messages/log.hh"

namespace Stg::program {

namespace {

std::atomic<bool> loading_line{false};  // of which more may come

/// "[Loading a.world][Include b.inc][Image "c.png"]", then "\r[Stage: 1m 02s 000msec]" over and
/// over.
void ShowProgress(const std::string& text) {
  const bool begins = text.starts_with("[Loading"), is_clock = text.starts_with("[Stage");
  if (is_clock) EndLine();
  if (begins) loading_line = true;
  std::fputs(((begins     ? " "
               : is_clock ? "\r"
                          : "") +
              text + (text.starts_with('[') ? "" : "\n"))
                 .c_str(),
             stdout);
  std::fflush(stdout);
}

void Show(LogLevel level, const std::string& line) {
  if (level == LogLevel::kProgress) return ShowProgress(line);
  if (level == LogLevel::kError) EndLine();
  // In one call, so that lines of several threads don't mix.
  std::fputs((line + "\n").c_str(), stderr);
}

}  // namespace

void ShowMessages() { SetLogSink(Show); }

void EndLine() {
  if (!loading_line.exchange(false)) return;
  std::fputs("\n", stdout);
  std::fflush(stdout);
}

}  // namespace Stg::program
