// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/format.hh"

#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace Stg::program {

std::string Format(const char* format, ...) {
  std::va_list arguments, again;
  va_start(arguments, format);
  va_copy(again, arguments);
  const int length = std::vsnprintf(nullptr, 0, format, arguments);
  va_end(arguments);
  std::string text(length > 0 ? static_cast<size_t>(length) + 1 : 1, '\0');
  std::vsnprintf(text.data(), text.size(), format, again);
  va_end(again);
  text.pop_back();
  return text;
}

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
