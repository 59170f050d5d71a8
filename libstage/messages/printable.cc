// SPDX-License-Identifier: GPL-2.0-or-later

#include <algorithm>
#include <cstdint>
#include <string>
#include <string_view>

#include "messages/report.hh"

namespace Stg {
namespace {

bool IsPlain(char c) { return c >= 0x20 && c < 0x7f; }

bool IsContinuation(char c) { return (static_cast<unsigned char>(c) & 0xc0U) == 0x80U; }

struct Character {
  std::size_t length;  // bytes
  bool shown;          // shown unescaped
};

/// True if a terminal acts on the character instead of showing it: C1 controls, line separators,
/// and marks that change the writing direction.
bool IsObeyed(std::uint32_t code) {
  return (code >= 0x80 && code <= 0x9f) || code == 0x61c || code == 0x200e || code == 0x200f ||
         (code >= 0x2028 && code <= 0x202e) || (code >= 0x2066 && code <= 0x2069) || code == 0xfeff;
}

/// Decodes the first character. Bytes that are not UTF-8 (RFC 3629) are returned one at a time.
Character FirstOf(std::string_view text) {
  const auto lead = static_cast<unsigned char>(text[0]);
  if (lead < 0x80) return {1, IsPlain(text[0])};
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return {1, false};
  std::uint32_t code = lead & (0x7fU >> length);
  for (std::size_t i = 1; i < length; i++) {
    if (!IsContinuation(text[i])) return {1, false};
    code = code << 6 | (static_cast<unsigned char>(text[i]) & 0x3fU);
  }
  const bool overlong = code < (length == 4 ? 0x10000U : length == 3 ? 0x800U : 0x80U);
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  if (overlong || surrogate || code > 0x10ffff) return {1, false};
  return {length, !IsObeyed(code)};
}

void AppendEscaped(char c, std::string* to) {
  constexpr char kDigits[] = "0123456789abcdef";
  const auto byte = static_cast<unsigned char>(c);
  if (c == '\n')
    *to += "\\n";
  else if (c == '\r')
    *to += "\\r";
  else if (c == '\t')
    *to += "\\t";
  else
    *to += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 0xf]};
}

std::string ElideMiddle(const std::string& text, std::size_t longest) {
  constexpr std::string_view kGap = "...";
  // Keeps more of the beginning, which tells more, and some of the end: names made by programs may
  // differ only there.
  std::size_t tail = text.size() - longest / 4;
  std::size_t head = longest - std::min(longest, longest / 4 + kGap.size());
  while (head > 0 && IsContinuation(text[head])) head--;
  while (tail < text.size() && IsContinuation(text[tail])) tail++;
  return text.substr(0, head).append(kGap).append(text, tail);
}

}  // namespace

std::string Printable(const std::string& text, std::size_t longest) {
  const auto odd = std::find_if_not(text.begin(), text.end(), IsPlain);
  std::string shown(text.begin(), odd);
  for (std::string_view rest(text.data() + shown.size(), text.size() - shown.size());
       !rest.empty();) {
    const Character first = FirstOf(rest);
    for (const char c : rest.substr(0, first.length)) {
      if (first.shown)
        shown += c;
      else
        AppendEscaped(c, &shown);
    }
    rest.remove_prefix(first.length);
  }
  return shown.size() <= longest ? shown : ElideMiddle(shown, longest);
}

namespace messages {

std::string Shortened(std::string_view text, std::size_t longest) {
  return Printable(std::string(text), longest);
}

std::string Quoted(std::string_view text) { return "\"" + Shortened(text) + "\""; }

std::string PrintableLines(const std::string& text) {
  std::string result;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    result += Printable(text.substr(at, end - at));
    if (end < text.size()) result += '\n';
    at = end + 1;
  }
  return result;
}

}  // namespace messages
}  // namespace Stg
