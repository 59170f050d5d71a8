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

/// As C's atoi, but values beyond `long long` stop at its ends, and exponents count.
ReadInteger ReadIntText(std::string_view text);

/// The shortest text that is read as the same number again: "1", "0.1235", "0.30000000000000004",
/// "1e+300".
std::string FloatText(double value);

/// The shortest text of a value in units of the file that is read as the same number again, if
/// there is one: degrees in radians may have none, and then come back within a rounding.
std::string TextInUnit(double value, double unit);

/// Whether a text begins like what follows a number's digits: e6, E+6, e-06, e-. It need not be
/// complete.
bool StartsLikeExponent(std::string_view text);

/// The length of the exponent at the start of a text; 0 if there is none.
std::size_t ExponentLength(std::string_view text);

/// True if `text` may stand in a world file without quotes.
bool IsNumberToken(std::string_view text);

}  // namespace Stg::worldfile

#endif
