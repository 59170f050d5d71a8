// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/format.hh"

#include <cmath>

namespace Stg::program {

std::string Count(double number, const std::string& thing) {
  return Rounded(number) + " " + thing + (number == 1 ? "" : "s");
}

std::string Rounded(double value) {
  const double size = std::fabs(value);
  if (!std::isfinite(value)) return value > 0 ? "infinite" : "unknown";
  if (size >= 1000) return Format(size < 1e7 ? "%.0f" : "%.3g", value);
  return Format("%.3g", value);
}

std::string Time(double seconds) {
  if (seconds < 100) return Rounded(seconds) + " s";
  if (seconds < 100 * 60) return Rounded(seconds / 60) + " min";
  if (seconds < 48 * 3600) return Rounded(seconds / 3600) + " h";
  return Rounded(seconds / 86400) + " days";
}

std::string Wrapped(const std::string& text, size_t indent) {
  constexpr size_t kWidth = 100;
  std::string lines, rest = text;
  while (rest.size() > kWidth) {
    const size_t blank = rest.rfind(' ', kWidth);
    if (blank == std::string::npos || rest.find_first_not_of(' ') > blank) break;
    lines += rest.substr(0, blank) + "\n";
    rest = std::string(indent, ' ') + rest.substr(blank + 1);
  }
  return lines + rest;
}

}  // namespace Stg::program
