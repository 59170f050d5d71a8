// SPDX-License-Identifier: GPL-2.0-or-later
//
// A name with control characters that a terminal would execute, and a check for such characters.

#ifndef STAGE_TESTS_SUPPORT_ODD_NAMES_HH
#define STAGE_TESTS_SUPPORT_ODD_NAMES_HH

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

namespace odd_names {

/// A name with colours by ESC, a bell, CSI as one byte and as UTF-8, DEL, invalid UTF-8, and a
/// right-to-left override. It contains no line end and no quote, so it can be in a world file.
inline const std::string kEvil =
    "a\x1b[31mb\a\x9b"
    "31mc\xc2\x9b"
    "31md\x7f\xff\xc3(\xe2\x80\xae"
    "e";

/// Decodes the UTF-8 sequence at `at`. Returns its length, or 0 if it is invalid.
inline std::size_t Decode(const std::string& text, std::size_t at, std::uint32_t* code) {
  const auto byte = [&](std::size_t i) {
    return at + i < text.size() ? static_cast<unsigned char>(text[at + i]) : 0U;
  };
  *code = byte(0);
  if (*code < 0x80) return 1;
  const std::size_t length = *code >= 0xf0 ? 4 : *code >= 0xe0 ? 3 : *code >= 0xc0 ? 2 : 0;
  if (length > 0) *code &= 0x7fU >> length;
  for (std::size_t i = 1; i < length; i++) {
    if (byte(i) >> 6 != 2) return 0;
    *code = *code << 6 | (byte(i) & 0x3fU);
  }
  return length;
}

/// The reason why a text must not be written to a terminal: a control character that is not in
/// `allowed`, invalid UTF-8, or a line longer than `longest` bytes. Empty if there is none.
inline std::string WhyUnfit(const std::string& text, std::size_t longest,
                            const std::string& allowed) {
  std::size_t line = 0;
  for (std::size_t at = 0, length = 0; at < text.size(); at += length) {
    std::uint32_t code = 0;
    length = Decode(text, at, &code);
    if (length == 0) return "not UTF-8 at " + std::to_string(at);
    const bool allow = length == 1 && allowed.find(text[at]) != std::string::npos;
    const bool obeyed = code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x202e;
    if (obeyed && !allow) return "character " + std::to_string(code) + " at " + std::to_string(at);
    line = code == '\n' ? 0 : line + length;
    if (line > longest) return "a line is longer than " + std::to_string(longest) + " bytes";
  }
  return "";
}

}  // namespace odd_names

#endif
