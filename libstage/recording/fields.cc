// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/fields.hh"

#include <set>

#include "recording/ros_names.hh"

namespace Stg::recording {

std::vector<FieldSource> FieldsOf(const std::vector<Model*>& models) {
  std::vector<FieldSource> fields;
  std::vector<std::string> names;
  for (Model* model : models) {
    auto* const field = dynamic_cast<ModelField*>(model);
    if (!field || field->GetLogInterval() == 0) continue;
    fields.push_back({field, ""});
    names.push_back(field->TokenStr());
  }
  std::set<std::string> taken;
  const std::vector<std::string> unique = NamingSchemes().front().Prefixes(names, true, &taken);
  for (size_t i = 0; i < fields.size(); i++) fields[i].topic = "/fields/" + unique[i];
  return fields;
}

}  // namespace Stg::recording
