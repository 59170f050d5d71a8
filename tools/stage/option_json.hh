// SPDX-License-Identifier: GPL-2.0-or-later
//
// Options of runs as JSON, by the names of RunOptionTable().

#ifndef STAGE_TOOLS_STAGE_OPTION_JSON_HH
#define STAGE_TOOLS_STAGE_OPTION_JSON_HH

#include <nlohmann/json_fwd.hpp>

#include "world/run_option.hh"

namespace Stg::program {

/// Returns the value; null if there is none.
nlohmann::ordered_json ToJson(const OptionValue& value);
/// Throws nlohmann::json::exception if the value is not of the option's type.
void FromJson(const nlohmann::ordered_json& json, const RunOption& option, RunOptions* options);
/// Returns an object with the values of all options.
nlohmann::ordered_json ToJson(const RunOptions& options);

}  // namespace Stg::program

#endif
