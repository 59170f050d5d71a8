// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/status_line.hh"

#include <cmath>
#include <cstdio>

namespace Stg::program {

void StatusLine::Print(const std::string& text) {
  // Trailing blanks erase the rest of a longer line.
  std::fprintf(stderr, "\r%-*s", static_cast<int>(length_), text.c_str());
  std::fflush(stderr);
  length_ = text.size();
}

void StatusLine::Erase() {
  if (length_ == 0) return;
  Print("");
  std::fputc('\r', stderr);
}

std::string DurationText(double seconds) {
  if (!(seconds < 1e7)) return "months";
  const long s = std::lround(seconds);
  char text[64];
  if (s < 100)
    std::snprintf(text, sizeof text, "%ld s", s);
  else if (s < 6000)
    std::snprintf(text, sizeof text, "%ld min %ld s", s / 60, s % 60);
  else
    std::snprintf(text, sizeof text, "%ld h %ld min", s / 3600, s / 60 % 60);
  return text;
}

}  // namespace Stg::program
