// SPDX-License-Identifier: GPL-2.0-or-later
//
// Populations: many models of one type without writing them out.
#include <algorithm>
#include <deque>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "geometry/load_error.hh"
#include "worldfile/expander.hh"
#include "worldfile/numbers.hh"
#include "worldfile/settings.hh"
#include "worldfile/worldfile.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {
namespace worldfile {
namespace {

constexpr char kSection[] = "population";
constexpr int kMaxMembers = 100'000;

/// Name of a member of `name`, such as "robot" for "robots".
std::string Singular(const std::string& name) {
  return name.size() > 1 && name.ends_with('s') ? name.substr(0, name.size() - 1) : name;
}

int ReadCount(const std::string& text) {
  const ReadInteger count = ReadIntText(text);
  const bool good = count.clean && count.value >= 0 && count.value <= kMaxMembers;
  return good ? static_cast<int>(count.value) : -1;
}

std::string CountError(const std::string& found) {
  return "found " + Quoted(found) + ", expected a whole number, from 0 to " +
         std::to_string(kMaxMembers);
}

Token MakeToken(std::uint32_t source, TokenKind kind, const std::string& part, std::string* text) {
  Token token{static_cast<std::uint32_t>(text->size()), 0, 0, kind, false};
  token.length = part.size() & 0x3ffffU;
  token.source = source & 0x3ffU;
  *text += part;
  return token;
}

/// Makes a body per member with a name, followed by a pose that is hidden unless needed.
std::vector<std::uint32_t> NamedBodies(Document& document, const std::string& name, int count) {
  std::string text;
  std::vector<std::uint32_t> bodies;
  const auto source = static_cast<std::uint32_t>(document.sources.Count());
  if (source >= kMaxSources) throw LoadError("found too many populations, expected fewer");
  const std::uint32_t pose = document.names.Intern("pose");
  for (int i = 0; i < count; ++i) {
    const auto at = static_cast<std::uint32_t>(document.tokens.size());
    const auto add = [&](TokenKind kind, const std::string& part) {
      document.tokens.push_back(MakeToken(source, kind, part, &text));
    };
    add(TokenKind::kString, '"' + name + std::to_string(i) + '"');
    add(TokenKind::kOpenBracket, "[");
    for (int k = 0; k < 4; ++k) add(TokenKind::kNumber, "0");
    add(TokenKind::kCloseBracket, "]");
    Body body;
    body.first_property = static_cast<std::uint32_t>(document.properties.size());
    body.property_count = 1;
    document.properties.push_back({document.name_of_models, at, at, 1, 0});
    document.properties.push_back({pose, at, at + 2, 4, 0});
    bodies.push_back(static_cast<std::uint32_t>(document.bodies.size()));
    document.bodies.push_back(body);
  }
  document.sources.Add("population " + Quoted(name), "", text);
  return bodies;
}

/// Adds the members of a population. Errors refer to token `at`.
std::vector<int> MakeMembers(Document& document, Expander* expander, const std::string& model,
                             const std::string& name, int count, std::uint32_t at) {
  std::vector<int> members;
  const std::uint32_t type = document.names.Intern(model), pose = document.names.Intern("pose");
  document.written_entities += static_cast<std::size_t>(count);
  for (const std::uint32_t body : NamedBodies(document, name, count)) {
    const auto member = static_cast<std::uint32_t>(document.entities.size());
    members.push_back(static_cast<int>(member));
    expander->Expand({type, at, body});
    // Ensures that there is a pose to write to.
    if (document.FindInFile(member, pose) == kNone) document.bodies[body].property_count = 2;
  }
  return members;
}

/// Top-level entities of the type or macro.
std::vector<std::uint32_t> OnTop(const Document& document, const std::string& type) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t entity = 1; entity < document.entities.size(); ++entity) {
    if (document.entities[entity].parent != 0) continue;
    const Chain& chain = document.chains[document.entities[entity].chain];
    const std::uint32_t written =
        chain.macros.empty() ? chain.type : document.macros[chain.macros[0]].name;
    if (document.names.Text(written) == type) found.push_back(entity);
  }
  return found;
}

/// Removes the entities, which must be sorted, and everything in them.
void Remove(Document& document, const std::vector<std::uint32_t>& entities) {
  std::vector<std::int32_t> moved(document.entities.size(), -1);
  std::deque<Entity> kept;
  for (std::uint32_t entity = 0; entity < document.entities.size(); ++entity) {
    Entity from = document.entities[entity];
    const bool orphan = from.parent >= 0 && moved[static_cast<std::size_t>(from.parent)] < 0;
    if (orphan || std::binary_search(entities.begin(), entities.end(), entity)) continue;
    if (from.parent >= 0) from.parent = moved[static_cast<std::size_t>(from.parent)];
    moved[entity] = static_cast<std::int32_t>(kept.size());
    kept.push_back(from);
  }
  document.entities.swap(kept);
}

/// The meaning of a setting TYPE=COUNT if there is no population of that name.
struct Order {
  std::string type;
  std::uint32_t at = 0;  // name token of the first replaced entity
  int count = 0;
};

Order RemoveModels(Document& document, const std::string& name) {
  Order order{name};
  std::vector<std::uint32_t> replaced = OnTop(document, name);
  if (replaced.empty()) {
    order.type = Singular(name);
    replaced = OnTop(document, order.type);
  }
  if (replaced.empty())
    throw LoadError("--set " + name + ": found no population and no model of that name, expected " +
                    "the name of a population or the type of models");
  order.at = document.entities[replaced[0]].name_token;
  Remove(document, replaced);
  return order;
}

}  // namespace
}  // namespace worldfile

const std::vector<Population>& Worldfile::populations() const { return impl_->populations; }

void Worldfile::ApplySettings() {
  for (const std::string& text : settings_) {
    worldfile::Setting setting = worldfile::ReadSetting(text);
    if (setting.property.empty()) {
      if (worldfile::ReadCount(setting.value) < 0)
        throw LoadError("--set " + setting.selector + ": " + worldfile::CountError(setting.value));
      if (!HasPopulation(setting.selector)) continue;  // AddPopulations() makes one
      setting.property = "count";
    }
    worldfile::Override(impl_->document, setting);
  }
}

bool Worldfile::HasPopulation(const std::string& name) {
  for (int entity = 1; entity < GetEntityCount(); ++entity) {
    if (GetEntityType(entity) != std::string(worldfile::kSection)) continue;
    if (ReadString(entity, "name", worldfile::kSection) == name) return true;
  }
  return false;
}

void Worldfile::AddPopulations(worldfile::Expander* expander) {
  // Removes all replaced entities before adding any, because entities are identified by number.
  std::map<std::string, worldfile::Order> orders;
  for (const std::string& text : settings_) {
    const worldfile::Setting setting = worldfile::ReadSetting(text);
    if (!setting.property.empty() || HasPopulation(setting.selector)) continue;
    const auto [order, is_new] = orders.try_emplace(setting.selector);
    if (is_new) order->second = worldfile::RemoveModels(impl_->document, setting.selector);
    order->second.count = worldfile::ReadCount(setting.value);
  }
  const int written = GetEntityCount();
  for (const auto& [name, order] : orders)
    impl_->populations.push_back({name, -1,
                                  worldfile::MakeMembers(impl_->document, expander, order.type,
                                                         order.type, order.count, order.at)});
  for (int entity = 1; entity < written; ++entity) {
    if (GetEntityType(entity) == std::string(worldfile::kSection)) AddPopulation(entity, expander);
  }
}

void Worldfile::AddPopulation(int entity, worldfile::Expander* expander) {
  worldfile::Document& document = impl_->document;
  if (GetEntityParent(entity) != 0)
    Fail(entity, "", "found a population inside something else, expected it outside of all models");
  const std::string name = ReadString(entity, "name", worldfile::kSection);
  const std::string model = ReadString(entity, "model", "");
  if (model.empty())
    Fail(entity, "model", "found a population without a model, expected model \"TYPE\"");
  if (model == worldfile::kSection)
    Fail(entity, "model", "found a population of populations, expected the type of a model");
  ReadFloat(entity, "count", 1);  // warns if it is not finite
  const std::string count = ReadString(entity, "count", "1");
  if (worldfile::ReadCount(count) < 0) Fail(entity, "count", worldfile::CountError(count));
  const std::uint32_t at = document.entities[static_cast<std::size_t>(entity)].name_token;
  impl_->populations.push_back(
      {name, entity,
       worldfile::MakeMembers(document, expander, model, worldfile::Singular(name),
                              worldfile::ReadCount(count), at)});
}

}  // namespace Stg
