// SPDX-License-Identifier: GPL-2.0-or-later
//
// Classes of characters in world files, whatever the locale.

#ifndef STAGE_WORLDFILE_CHARACTERS_HH
#define STAGE_WORLDFILE_CHARACTERS_HH

namespace Stg::worldfile {

inline bool IsLineEnd(char c) { return c == '\n' || c == '\r'; }
inline bool IsDigit(char c) { return c >= '0' && c <= '9'; }

/// True for characters that the lexer accepts in a number before its exponent.
inline bool IsNumberPart(char c) { return IsDigit(c) || c == '+' || c == '-' || c == '.'; }

}  // namespace Stg::worldfile

#endif
