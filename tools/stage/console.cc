// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/console.hh"

#include <atomic>
#include <cstdio>
#include <string>

#include "messages/log.hh"

namespace Stg::program {

namespace {

std::atomic<bool> loading_line{false};  // of which more may come

bool IsPart(const std::string& text) {
  for (const char* begin : {"[Loading ", "[Include ", "[Image ", "[threads "})
    if (text.starts_with(begin)) return true;
  return false;
}

/// "[Loading a.world][Include b.inc][Image "c.png"]" is one line; the clock is written over again
/// and again; what controllers say has lines of its own.
void ShowProgress(const std::string& text) {
  if (text.starts_with("[Stage: ")) {
    EndLine();
    std::fputs(("\r" + text).c_str(), stdout);
  } else {
    const bool begins = text.starts_with("[Loading ");
    if (begins) loading_line = true;
    std::fputs(((begins ? " " : "") + text + (IsPart(text) ? "" : "\n")).c_str(), stdout);
  }
  std::fflush(stdout);
}

void Show(LogLevel level, const std::string& line) {
  if (level == LogLevel::kProgress) return ShowProgress(line);
  EndLine();
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
