// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/document.hh"

#include <algorithm>

namespace Stg::worldfile {

std::uint32_t NameTable::Intern(std::string_view text) {
  const auto found = numbers_.find(text);
  if (found != numbers_.end()) return found->second;
  const auto number = static_cast<std::uint32_t>(texts_.size());
  texts_.emplace_back(text);
  numbers_.emplace(texts_.back(), number);
  return number;
}

/// Rebuilds the map, whose keys point to the texts of this table.
void NameTable::NumberAll() {
  numbers_.clear();
  for (std::uint32_t number = 0; number < Count(); number++)
    numbers_.emplace(texts_[number], number);
}

Document::Document() {
  bodies.emplace_back();
  chains.push_back({{}, names.Intern("")});
  entities.push_back({0, 0, kNone, -1});
  name_of_models = names.Intern("name");
}

std::string_view Document::Text(const Token& token) const {
  const std::string_view text = sources.Text(token.source).substr(token.offset, token.length);
  return token.kind == TokenKind::kString ? text.substr(1, text.size() - 2) : text;
}

Place Document::PlaceOf(const Token& token) const {
  return sources.PlaceOf(token.source, token.offset);
}

void Document::Fail(const Token& token, const std::string& message) const {
  sources.Fail(token.source, token.offset, message);
}

void Document::Warn(const Token& token, const std::string& message) {
  if (!HasAllWarnings()) Warn(PlaceOf(token).Text(), message);
}

void Document::Warn(const std::string& place, const std::string& message) {
  if (HasAllWarnings()) return;
  std::string line = Printable(place + ": warning: " + message);
  if (warnings_seen.insert(line).second) warnings.push_back(std::move(line));
}

std::uint32_t Document::FindIn(std::uint32_t body, std::uint32_t name) const {
  const Body& in = bodies[body];
  const auto begin = properties.begin() + in.first_property;
  const auto end = begin + in.property_count;
  const auto found = std::lower_bound(
      begin, end, name, [](const Property& p, std::uint32_t wanted) { return p.name < wanted; });
  if (found == end || found->name != name) return kNone;
  return static_cast<std::uint32_t>(found - properties.begin());
}

std::uint32_t Document::Find(std::uint32_t entity, std::uint32_t name) const {
  for (std::size_t i = overrides.size(); i-- > 0;) {
    if (overrides[i].name == name && Selects(overrides[i], entity)) return overrides[i].property;
  }
  return FindInFile(entity, name);
}

bool Document::IsCalled(std::uint32_t entity, std::uint32_t selector) const {
  if (entity == 0) return names.Text(selector) == "world";
  const Chain& chain = chains[entities[entity].chain];
  if (chain.type == selector) return true;
  for (const std::uint32_t macro : chain.macros) {
    if (macros[macro].name == selector) return true;
  }
  const std::uint32_t own = FindInFile(entity, name_of_models);
  return own != kNone && Text(tokens[properties[own].first_value]) == names.Text(selector);
}

std::uint32_t Document::FindInFile(std::uint32_t entity, std::uint32_t name) const {
  const Entity& of = entities[entity];
  const std::uint32_t own = FindIn(of.body, name);
  if (own != kNone) return own;
  for (const std::uint32_t macro : chains[of.chain].macros) {
    const std::uint32_t inherited = FindIn(macros[macro].body, name);
    if (inherited != kNone) return inherited;
  }
  return kNone;
}

}  // namespace Stg::worldfile
