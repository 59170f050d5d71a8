// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/console.hh"

#include <unistd.h>

#include <atomic>
#include <cstdio>
#include <string>

#include "messages/log.hh"

namespace Stg::program {

namespace {

std::atomic<bool> shows_all{false};
std::atomic<bool> loading_line{false};  // an unfinished line on standard error
std::atomic<bool> clock_line{false};    // an unfinished line on standard output

bool IsPart(const std::string& text) {
  for (const char* begin : {"[Loading ", "[Include ", "[Image ", "[threads "})
    if (text.starts_with(begin)) return true;
  return false;
}

/// A single call keeps lines of several threads apart.
void PrintOnStandardError(const std::string& text) { std::fputs(text.c_str(), stderr); }

/// The clock overwrites its own line.
void ShowClock(const std::string& text) {
  EndLine();
  clock_line = true;
  std::fputs(("\r" + text).c_str(), stdout);
  std::fflush(stdout);
}

/// "[Loading a.world][Include b.inc][Image "c.png"]" is built up on one line; messages of
/// controllers get their own lines.
void ShowProgress(const std::string& text) {
  if (text.starts_with("[Stage: ")) return ShowClock(text);
  if (!shows_all) return;
  if (text.starts_with("[Loading ")) {
    EndLine();
    loading_line = true;
    return PrintOnStandardError(" " + text);
  }
  if (IsPart(text)) return PrintOnStandardError(text);
  EndLine();
  PrintOnStandardError(text + "\n");
}

void Show(LogLevel level, const std::string& line) {
  if (level == LogLevel::kProgress) return ShowProgress(line);
  EndLine();
  PrintOnStandardError(line + "\n");
}

}  // namespace

void ShowMessages(std::optional<bool> all) {
  shows_all = all.value_or(isatty(STDERR_FILENO) != 0);
  SetLogSink(Show);
}

bool ShowsAll() { return shows_all; }

void PrintProgress(const std::string& line) {
  if (!shows_all) return;
  EndLine();
  PrintOnStandardError(line + "\n");
}

void EndLine() {
  if (loading_line.exchange(false)) PrintOnStandardError("\n");
}

void EndClock() {
  if (!clock_line.exchange(false)) return;
  std::fputs("\n", stdout);
  std::fflush(stdout);
}

}  // namespace Stg::program
