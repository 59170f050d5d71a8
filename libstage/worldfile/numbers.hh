// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_NUMBERS_HH
#define STAGE_WORLDFILE_NUMBERS_HH

#include <optional>
#include <string>
#include <string_view>

/// Locale-independent conversion between text and numbers.
namespace Stg::worldfile {

struct ReadNumber {
  double value = 0;
  bool clean = false;  // only blanks follow the number
};

struct ReadInteger {
  long long value = 0;
  bool clean = false;  // also true for a zero fraction ("3.0")
};

/// Like atof() in the C locale: returns 0 for invalid text and ignores what follows the number. May
/// return infinities and NaN.
ReadNumber ReadFloatText(std::string_view text);

/// Reads the whole text as a number: digits with optional point, exponent and minus sign, no
/// blanks, within the range of doubles. Replaces std::from_chars, which libc++ has for doubles only
/// since version 20.
std::optional<double> ReadWholeFloat(std::string_view text);

/// Like atoi(), but clamps to the range of `long long` and accepts exponents.
ReadInteger ReadIntText(std::string_view text);

/// Shortest text that reads back as the same number: "1", "0.1235", "0.30000000000000004",
/// "1e+300".
std::string FloatText(double value);

/// Shortest text of the value in units of the file that reads back as the same number. Some angles
/// given in degrees have none; their text reads back within rounding.
std::string TextInUnit(double value, double unit);

/// True if the text begins like an exponent, complete or not: e6, E+6, e-06, e-.
bool StartsLikeExponent(std::string_view text);

/// Length of the exponent at the start of a text, or 0.
std::size_t ExponentLength(std::string_view text);

/// True if `text` can be written without quotes in a world file.
bool IsNumberToken(std::string_view text);

}  // namespace Stg::worldfile

#endif
