// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_WORLDFILE_NUMBERS_HH
#define STAGE_WORLDFILE_NUMBERS_HH

#include <optional>
#include <string>
#include <string_view>

/// Text to numbers and back, whatever the user's locale is.
namespace Stg::worldfile {

struct ReadNumber {
  double value = 0;
  bool clean = false;  // digits, and nothing after them but blanks
};

struct ReadInteger {
  long long value = 0;
  bool clean = false;  // the same; a fraction that is zero ("3.0") is clean too
};

/// As C's atof in the C locale: what cannot be read is 0, what follows the number is ignored.
/// May give infinities and NaN.
ReadNumber ReadFloatText(std::string_view text);

/// The number that all of the text is: digits, with a point, an exponent and a minus sign or
/// without, no blanks, in the range of doubles. As std::from_chars would read it, which libc++ has
/// for doubles from version 20 on only.
std::optional<double> ReadWholeFloat(std::string_view text);

/// As C's atoi, but values beyond `long long` stop at its ends.
ReadInteger ReadIntText(std::string_view text);

/// Up to six decimals, at least three: "1.000", "0.1235", "0.000".
std::string FloatText(double value);

/// The same, but what would be 0.000 is "0".
std::string ScalarText(double value);

/// True if `text` may stand in a world file without quotes.
bool IsNumberToken(std::string_view text);

}  // namespace Stg::worldfile

#endif
