// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/settings.hh"

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "worldfile/lexer.hh"
#include "worldfile/numbers.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {
namespace {

constexpr char kExpected[] =
    "expected NAME.PROPERTY=VALUE, such as world.resolution=0.05 or robot.ctrl=wander, or "
    "NAME=COUNT, such as robots=100";

bool IsQuoted(std::string_view text) {
  return text.size() >= 2 && text.front() == '"' && text.back() == '"';
}

/// The value as written in a world file: words get quotes.
std::string ValueText(const Setting& setting) {
  const std::string& value = setting.value;
  if (value.starts_with('[') || IsQuoted(value) || IsNumberToken(value)) return value;
  if (value.find('"') != std::string::npos || value.find('\n') != std::string::npos)
    throw LoadError("--set " + setting.selector + "." + setting.property +
                    ": found a quote or the end of a line in the value, expected neither");
  return '"' + value + '"';
}

/// The number of the entity that a selector #N is for, otherwise kNone.
std::uint32_t EntityOf(const std::string& selector) {
  std::uint32_t number = kNone;
  const char* const end = selector.data() + selector.size();
  if (!selector.starts_with('#')) return kNone;
  const auto read = std::from_chars(selector.data() + 1, end, number);
  return read.ec == std::errc() && read.ptr == end ? number : kNone;
}

std::uint32_t LastToken(const Document& document) {
  return static_cast<std::uint32_t>(document.tokens.size() - 1);
}

bool IsValue(const Token& token) {
  return token.kind == TokenKind::kNumber || token.kind == TokenKind::kString;
}

/// Makes a property of NAME VALUE or NAME [ VALUE ... ], the tokens from `first` to the last.
Property MakeProperty(Document& document, std::uint32_t first) {
  const std::uint32_t last = LastToken(document);
  std::uint32_t from = first + 1, to = last;
  const bool tuple = from <= last && document.tokens[from].kind == TokenKind::kOpenBracket;
  if (tuple) {
    if (document.tokens[last].kind != TokenKind::kCloseBracket)
      document.Fail(document.tokens[last], "found a tuple without an end, expected ']'");
    ++from;
    --to;
  }
  for (std::uint32_t i = from; i <= to; ++i) {
    if (!IsValue(document.tokens[i]))
      document.Fail(document.tokens[i], "found '" + std::string(document.Text(document.tokens[i])) +
                                            "', expected a number or a text");
  }
  if (!tuple && from != to)
    document.Fail(document.tokens[first],
                  "found no single value, expected a number, a text or "
                  "values in square brackets");
  Property property{document.names.Intern(document.Text(document.tokens[first])), first, from, 0,
                    0};
  property.value_count = (to + 1 - from) & 0x3fffffffU;
  return property;
}

/// A suggestion of the most similar candidate, or "".
std::string DidYouMean(const std::string& name, const std::vector<std::string>& candidates) {
  const std::string similar = FindSimilar(name, candidates);
  return similar.empty() ? "" : "; did you mean " + Quoted(similar) + "?";
}

/// All valid selectors, sorted.
std::vector<std::string> Selectors(const Document& document) {
  std::vector<std::string> names{"world"};
  for (std::uint32_t entity = 1; entity < document.entities.size(); ++entity) {
    const Chain& chain = document.chains[document.entities[entity].chain];
    names.push_back(document.names.Text(chain.type));
    for (const std::uint32_t macro : chain.macros)
      names.push_back(document.names.Text(document.macros[macro].name));
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace

Setting ReadSetting(const std::string& text) {
  const std::size_t equals = text.find('=');
  const std::string left = text.substr(0, equals);
  const std::size_t dot = left.rfind('.');
  const bool no_name = left.empty() || dot == 0 || dot == left.size() - 1;
  if (equals == std::string::npos || no_name || equals + 1 == text.size())
    throw LoadError("--set: found " + Quoted(text) + ", " + kExpected);
  if (dot == std::string::npos) return {left, "", text.substr(equals + 1)};
  return {left.substr(0, dot), left.substr(dot + 1), text.substr(equals + 1)};
}

void Override(Document& document, const Setting& setting) {
  const std::string name = "--set " + setting.selector + "." + setting.property;
  if (document.overrides.size() >= kMaxSettings || document.sources.Count() >= kMaxSources)
    throw LoadError(name + ": found too many settings, expected at most " +
                    std::to_string(kMaxSettings));
  const auto first = static_cast<std::uint32_t>(document.tokens.size());
  const std::uint32_t source =
      document.sources.Add(name, "", setting.property + " " + ValueText(setting));
  Lexer(document, "").LexText(static_cast<std::uint16_t>(source));
  document.properties.push_back(MakeProperty(document, first));
  const auto property = static_cast<std::uint32_t>(document.properties.size() - 1);
  document.overrides.push_back({document.names.Intern(setting.selector),
                                document.properties.back().name, property,
                                EntityOf(setting.selector)});
}

void CheckOverridesAreRead(const Document& document) {
  for (const OverridingProperty& given : document.overrides) {
    const Property& property = document.properties[given.property];
    if (property.used) continue;
    const std::string& selector = document.names.Text(given.selector);
    bool overridden = false, fits = false;
    for (const OverridingProperty& other : document.overrides)
      overridden |= &other > &given && other.name == given.name;
    if (overridden) continue;
    for (std::uint32_t entity = 0; entity < document.entities.size() && !fits; ++entity)
      fits = document.Selects(given, entity);
    document.Fail(document.tokens[property.name_token],
                  fits ? "nothing reads " + Quoted(document.names.Text(given.name)) + " of " +
                             Quoted(selector)
                       : "found nothing in the world file that is called " + Quoted(selector) +
                             ", expected \"world\", a type or a name" +
                             DidYouMean(selector, Selectors(document)));
  }
}

}  // namespace Stg::worldfile
