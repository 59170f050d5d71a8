// SPDX-License-Identifier: GPL-2.0-or-later
//
// Entities that are added to a world file after loading.
#include <algorithm>
#include <string>
#include <unordered_set>
#include <vector>

#include "geometry/load_error.hh"
#include "worldfile/expander.hh"
#include "worldfile/lexer.hh"
#include "worldfile/parser.hh"
#include "worldfile/worldfile.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg {

void Worldfile::Include(const std::string& file) {
  worldfile::Document& document = impl_->document;
  if (impl_->included.count(file) > 0) return;
  if (file.find_first_of(std::string("\"\r\n\0", 4)) != std::string::npos)
    throw LoadError("found the file name " + worldfile::Quoted(file) +
                    ", expected one without quotes and line ends");
  if (document.sources.Count() >= worldfile::kMaxSources)
    throw LoadError("found too many files with definitions, expected fewer");
  const std::uint32_t source =
      document.sources.Add("<definitions>", "", "include \"" + file + "\"\n");
  const auto first = static_cast<std::uint32_t>(document.tokens.size());
  worldfile::Lexer(document, impl_->base_directory).Run(static_cast<std::uint16_t>(source));
  worldfile::Parser(document).ParseDefinitions(first);
  impl_->included.insert(file);
}

bool Worldfile::HasMacro(const std::string& name) const {
  const worldfile::Document& document = impl_->document;
  return std::ranges::any_of(document.macros, [&](const worldfile::Macro& macro) {
    return document.names.Text(macro.name) == name;
  });
}

std::vector<std::string> Worldfile::MacrosOf(const std::string& type) const {
  const worldfile::Document& document = impl_->document;
  std::vector<std::string> found;
  std::unordered_set<std::uint32_t> leading;  // names that lead to the type
  for (const worldfile::Macro& macro : document.macros) {
    if (document.names.Text(macro.base) != type && leading.count(macro.base) == 0) continue;
    leading.insert(macro.name);
    found.push_back(document.names.Text(macro.name));
  }
  return found;
}

int Worldfile::Add(const std::string& type) {
  worldfile::Document& document = impl_->document;
  const int first = GetEntityCount();
  worldfile::Expander expander(document);
  const std::uint32_t name = document.names.Intern(type);
  const worldfile::Macro* const macro = expander.FindMacro(name);
  const auto body = static_cast<std::uint32_t>(document.bodies.size());
  document.bodies.emplace_back();
  document.written_entities++;
  try {
    expander.Expand({name, macro ? macro->name_token : 0, body});
  } catch (const LoadError&) {
    for (worldfile::Macro& each : document.macros) each.expanding = false;
    RemoveAdded(first);
    throw;
  }
  return first;
}

void Worldfile::RemoveAdded(int first) {
  worldfile::Document& document = impl_->document;
  first = std::max(first, impl_->written_count);
  if (first >= GetEntityCount()) return;
  document.entities.erase(document.entities.begin() + first, document.entities.end());
  std::erase_if(impl_->handles, [&](const auto& handle) {
    return handle.first.first >= static_cast<std::uint32_t>(first);
  });
}

int Worldfile::GetWrittenCount() const { return impl_->written_count; }

}  // namespace Stg
