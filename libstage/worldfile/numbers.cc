// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/numbers.hh"

#include <locale.h>
#include <stdlib.h>
#if defined(__APPLE__)
#include <xlocale.h>
#endif

#include <algorithm>
#include <charconv>
#include <cmath>
#include <system_error>

namespace Stg::worldfile {
namespace {

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }

bool OnlySpaces(std::string_view text) { return std::all_of(text.begin(), text.end(), IsSpace); }

std::string_view WithoutLeadingSpaces(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  return text;
}

// ".000" and the like, then perhaps blanks.
bool IsZeroFraction(std::string_view text) {
  if (text.empty() || text.front() != '.') return false;
  text.remove_prefix(1);
  while (!text.empty() && text.front() == '0') text.remove_prefix(1);
  return OnlySpaces(text);
}

locale_t CLocale() {
  static const locale_t locale = newlocale(LC_ALL_MASK, "C", nullptr);
  return locale;
}

}  // namespace

ReadNumber ReadFloatText(std::string_view text) {
  const std::string copy(text);  // ends with a NUL, which the view need not
  char* end = nullptr;
  const double value = strtod_l(copy.c_str(), &end, CLocale());
  if (end == copy.c_str()) return {0, false};
  return {value, OnlySpaces(text.substr(static_cast<std::size_t>(end - copy.c_str())))};
}

std::optional<double> ReadWholeFloat(std::string_view text) {
  const bool plain = text.find_first_not_of("0123456789.eE+-") == std::string_view::npos;
  if (!plain || text.empty() || text.front() == '+') return std::nullopt;
  const ReadNumber number = ReadFloatText(text);
  if (!number.clean || !std::isfinite(number.value)) return std::nullopt;
  return number.value;
}

ReadInteger ReadIntText(std::string_view text) {
  text = WithoutLeadingSpaces(text);
  const bool negative = !text.empty() && text.front() == '-';
  if (negative || (!text.empty() && text.front() == '+')) text.remove_prefix(1);
  if (text.empty() || !IsDigit(text.front())) return {0, false};

  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  const bool fits = error == std::errc();
  if (!fits) value = 0x7fffffffffffffff;
  return {negative ? -value : value, fits && (OnlySpaces(rest) || IsZeroFraction(rest))};
}

std::string FloatText(double value) {
  constexpr int kMostDecimals = 6;
  constexpr std::size_t kFewestDecimals = 3;
  char buffer[400];  // the largest double has 309 digits before the point
  const auto [end, error] =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed, kMostDecimals);
  std::string text(buffer, error == std::errc() ? end : buffer);
  const std::size_t shortest = text.find('.') + 1 + kFewestDecimals;
  while (text.size() > shortest && text.back() == '0') text.pop_back();
  return text == "-0.000" ? "0.000" : text;
}

std::string ScalarText(double value) {
  std::string text = FloatText(value);
  return text == "0.000" ? "0" : text;
}

bool IsNumberToken(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return IsDigit(c) || c == '+' || c == '-' || c == '.';
  });
}

}  // namespace Stg::worldfile
