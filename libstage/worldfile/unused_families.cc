// SPDX-License-Identifier: GPL-2.0-or-later
#include "worldfile/unused_families.hh"

#include <map>
#include <tuple>

#include "messages/report.hh"
#include "worldfile/worldfile_impl.hh"

namespace Stg::worldfile {

std::string UnusedFamily::Message() const {
  std::string text = "property " + messages::Quoted(first.name) + " is never read";
  if (more > 0) text += " (nor " + std::to_string(more) + " more like it)";
  if (!first.successor.empty()) return text + "; older Stages had it: " + first.successor;
  if (!first.suggestion.empty())
    text += "; did you mean " + messages::Quoted(first.suggestion) + "?";
  return text;
}

namespace {

/// Common name of the properties of a family. `polygon[0].points` and `polygon[1].point[2]` have
/// the same successor and belong together.
std::string FamilyName(const UnusedProperty& property) {
  if (property.successor.empty()) return WithoutIndices(property.name);
  return property.name.substr(0, property.name.find('['));
}

}  // namespace

std::vector<UnusedFamily> GroupUnused(const std::vector<UnusedProperty>& unused) {
  std::vector<UnusedFamily> families;
  std::map<std::tuple<std::string, std::string, std::string>, std::size_t> numbers;
  for (const UnusedProperty& property : unused) {
    const auto [found, is_new] = numbers.try_emplace(
        {FamilyName(property), property.suggestion, property.successor}, families.size());
    if (is_new)
      families.push_back({property, 0});
    else
      ++families[found->second].more;
  }
  return families;
}

}  // namespace Stg::worldfile
