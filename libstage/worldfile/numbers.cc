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
#include <limits>
#include <system_error>

#include "worldfile/characters.hh"

namespace Stg::worldfile {
namespace {

bool IsSpace(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

bool OnlySpaces(std::string_view text) { return std::all_of(text.begin(), text.end(), IsSpace); }

std::string_view WithoutLeadingSpaces(std::string_view text) {
  while (!text.empty() && IsSpace(text.front())) text.remove_prefix(1);
  return text;
}

// True for zero fractions such as ".000", optionally followed by blanks.
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
  const std::string copy(text);  // NUL-terminated, unlike the view
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

namespace {

// Reads digits with an optional point and exponent. Returns false for other notations of C, such as
// hexadecimal; the caller then reads the text like atoi().
bool ReadDecimal(std::string_view text, ReadInteger* integer) {
  constexpr double kAllExact = 9007199254740992.0;  // 2^53: not every larger integer is a double
  const auto decimal = [](char c) { return IsNumberPart(c) || IsSpace(c) || c == 'e' || c == 'E'; };
  const ReadNumber number = ReadFloatText(text);
  if (!number.clean || !(std::fabs(number.value) <= kAllExact)) return false;
  if (!std::all_of(text.begin(), text.end(), decimal)) return false;
  const double whole = std::trunc(number.value);
  *integer = {static_cast<long long>(whole), whole == number.value};
  return true;
}

}  // namespace

ReadInteger ReadIntText(std::string_view text) {
  ReadInteger integer;
  if (ReadDecimal(text, &integer)) return integer;
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

namespace {

// Shortest text that reads back as the same number. Uses an exponent only where that saves many
// digits.
std::string ShortestText(double value) {
  constexpr double kMinDecimals = 1e-6, kTooManyDigits = 1e15;
  const double size = std::fabs(value);
  const bool is_plain = size == 0 || (size >= kMinDecimals && size < kTooManyDigits);
  char buffer[32];
  const auto [end, error] =
      is_plain ? std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed)
               : std::to_chars(buffer, buffer + sizeof buffer, value);
  return {buffer, error == std::errc() ? end : buffer};
}

double RoundToDigits(double value, int digits) {
  char buffer[40];
  const auto [end, error] =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general, digits);
  return ReadFloatText({buffer, error == std::errc() ? end : buffer}).value;
}

}  // namespace

std::string FloatText(double value) { return ShortestText(value); }

std::string TextInUnit(double value, double unit) {
  constexpr int kMaxDigits = 17;  // enough to distinguish any two doubles
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (unit == 1) return ShortestText(value);
  const double scaled = value / unit;
  if (!std::isfinite(scaled)) return ShortestText(scaled);
  for (int digits = 1; digits <= kMaxDigits; ++digits) {
    const double rounded = RoundToDigits(scaled, digits);
    if (rounded * unit == value) return ShortestText(rounded);
  }
  for (const double near : {std::nextafter(scaled, kInfinity), std::nextafter(scaled, -kInfinity)})
    if (near * unit == value) return ShortestText(near);
  return ShortestText(scaled);
}

bool StartsLikeExponent(std::string_view text) {
  if (text.size() < 2 || (text[0] != 'e' && text[0] != 'E')) return false;
  return IsDigit(text[1]) || text[1] == '+' || text[1] == '-';
}

std::size_t ExponentLength(std::string_view text) {
  if (!StartsLikeExponent(text)) return 0;
  const std::size_t digits = IsDigit(text[1]) ? 1 : 2;
  std::size_t end = digits;
  while (end < text.size() && IsDigit(text[end])) ++end;
  return end > digits ? end : 0;
}

bool IsNumberToken(std::string_view text) {
  std::size_t run = 0;
  while (run < text.size() && IsNumberPart(text[run])) ++run;
  if (run == text.size()) return run > 0;
  const bool has_digit =
      std::any_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(run), IsDigit);
  const std::size_t exponent = ExponentLength(text.substr(run));
  return has_digit && exponent > 0 && run + exponent == text.size();
}

}  // namespace Stg::worldfile
