// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/sweep/json_text.hh"

#include <algorithm>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

namespace Stg::program {

namespace {

using Json = nlohmann::ordered_json;

// The JSON library accepts only UTF-8 without lone surrogates. In its texts, the placeholder
// U+10FF00 + NN represents the byte 0xNN. The bytes of a placeholder that occurs in the original
// text are themselves replaced, so that every text is restored exactly.
constexpr uint32_t kFirstPlaceholder = 0x10ff00;
constexpr size_t kPlaceholderSize = 4;  // bytes

bool IsPlaceholder(std::string_view character) {
  return character.size() == kPlaceholderSize && character.starts_with("\xf4\x8f") &&
         static_cast<unsigned char>(character[2]) >= 0xbc;
}

void AppendPlaceholder(unsigned char byte, std::string* to) {
  *to += "\xf4\x8f";
  *to += static_cast<char>(0xbc + (byte >> 6));
  *to += static_cast<char>(0x80 | (byte & 0x3f));
}

/// Length of the first character of a text; 0 if it does not start with valid UTF-8 (RFC 3629).
size_t LengthOfFirst(std::string_view text) {
  const auto byte = [text](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = byte(0);
  if (lead < 0x80) return 1;
  const size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return 0;
  for (size_t i = 1; i < length; i++)
    if (byte(i) >> 6 != 2) return 0;
  const bool overlong = (lead == 0xe0 && byte(1) < 0xa0) || (lead == 0xf0 && byte(1) < 0x90);
  const bool surrogate = lead == 0xed && byte(1) >= 0xa0;
  const bool too_large = lead == 0xf4 && byte(1) >= 0x90;
  return overlong || surrogate || too_large ? 0 : length;
}

/// Converts any bytes to UTF-8.
std::string WithPlaceholders(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    const size_t length = LengthOfFirst(text);
    const std::string_view character = text.substr(0, std::max<size_t>(length, 1));
    if (length == 0 || IsPlaceholder(character))
      for (const char c : character) AppendPlaceholder(static_cast<unsigned char>(c), &result);
    else
      result += character;
    text.remove_prefix(character.size());
  }
  return result;
}

std::string WithoutPlaceholders(std::string_view text) {
  std::string result;
  for (size_t at = 0; at < text.size();) {
    const std::string_view four = text.substr(at, kPlaceholderSize);
    const bool found = IsPlaceholder(four);
    result += found ? static_cast<char>((four[2] & 0x3) << 6 | (four[3] & 0x3f)) : text[at];
    at += found ? kPlaceholderSize : 1;
  }
  return result;
}

/// Returns a copy of the value in which every text, including member names, is changed.
template <typename Change>
Json Changed(const Json& json, Change change) {
  if (json.is_string()) return change(json.get_ref<const std::string&>());
  if (!json.is_structured()) return json;
  Json result = json.is_object() ? Json::object() : Json::array();
  for (const auto& [name, value] : json.items()) {
    if (json.is_object())
      result[change(name)] = Changed(value, change);
    else
      result.push_back(Changed(value, change));
  }
  return result;
}

/// Code of the escape \uXXXX at this position of a JSON text; nothing if there is none.
std::optional<uint32_t> EscapeAt(std::string_view text, size_t at) {
  if (text.substr(at, 2) != "\\u" || text.size() < at + 6) return std::nullopt;
  uint32_t code = 0;
  for (const char c : text.substr(at + 2, 4)) {
    const bool letter = (c | 0x20) >= 'a' && (c | 0x20) <= 'f';
    if (!letter && (c < '0' || c > '9')) return std::nullopt;
    code = code << 4 | static_cast<uint32_t>(letter ? (c | 0x20) - 'a' + 10 : c - '0');
  }
  return code;
}

bool IsHigh(uint32_t code) { return code >= 0xd800 && code < 0xdc00; }
bool IsLow(uint32_t code) { return code >= 0xdc00 && code < 0xe000; }

/// Calls f(text, code) for each unit of a JSON text. Escapes have a code; a pair of surrogates
/// counts as one escape. Other units are single characters and other escapes, without a code.
template <typename F>
void ForEachUnit(std::string_view text, F f) {
  for (size_t at = 0, length = 0; at < text.size(); at += length) {
    std::optional<uint32_t> code = EscapeAt(text, at);
    length = code ? 6 : text[at] == '\\' ? 2 : 1;
    const std::optional<uint32_t> next = code && IsHigh(*code) ? EscapeAt(text, at + 6) : code;
    if (code && IsHigh(*code) && next && IsLow(*next)) {
      code = 0x10000 + ((*code - 0xd800) << 10) + (*next - 0xdc00);
      length = 12;
    }
    f(text.substr(at, length), code);
  }
}

}  // namespace

std::string ToJsonText(const Json& json, int indent) {
  std::string text;
  ForEachUnit(Changed(json, WithPlaceholders).dump(indent, ' ', true),
              [&text](std::string_view part, std::optional<uint32_t> code) {
                if (code && *code >= kFirstPlaceholder)
                  text.append("\\udc").append(part.substr(part.size() - 2));
                else
                  text += part;
              });
  return text;
}

Json ParseJsonText(const std::string& text) {
  std::string taken;
  ForEachUnit(
      WithPlaceholders(text), [&taken](std::string_view part, std::optional<uint32_t> code) {
        if (code && *code >= 0xdc80 && *code < 0xdd00) {
          AppendPlaceholder(static_cast<unsigned char>(*code & 0xff), &taken);
        } else if (code && *code >= kFirstPlaceholder) {
          const char bytes[] = {'\xf4', '\x8f', static_cast<char>(0xbc + ((*code >> 6) & 0x3)),
                                static_cast<char>(0x80 | (*code & 0x3f))};
          for (const char c : bytes) AppendPlaceholder(static_cast<unsigned char>(c), &taken);
        } else {
          taken += part;
        }
      });
  return Changed(Json::parse(taken), WithoutPlaceholders);
}

}  // namespace Stg::program
