// SPDX-License-Identifier: GPL-2.0-or-later

#include "stage/option_json.hh"

#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>
#include <vector>

namespace Stg::program {

using Json = nlohmann::ordered_json;

Json ToJson(const OptionValue& value) {
  return std::visit(
      [](const auto& kept) {
        if constexpr (std::is_same_v<decltype(kept), const std::monostate&>)
          return Json();
        else
          return Json(kept);
      },
      value);
}

void FromJson(const Json& json, const RunOption& option, RunOptions* options) {
  using Type = RunOption::Type;
  OptionValue value;
  if (!json.is_null()) switch (option.type) {
      case Type::kSwitch:
        value = json.get<bool>();
        break;
      case Type::kNumber:
        value = json.get<uint64_t>();
        break;
      case Type::kSeconds:
        value = json.get<double>();
        break;
      case Type::kChoice:
      case Type::kDevice:
        value = json.get<std::string>();
        break;
      case Type::kTexts:
        value = json.get<std::vector<std::string>>();
    }
  option.set(options, value);
}

Json ToJson(const RunOptions& options) {
  Json json = Json::object();
  for (const RunOption& option : RunOptionTable()) json[option.name] = ToJson(option.get(options));
  return json;
}

}  // namespace Stg::program
