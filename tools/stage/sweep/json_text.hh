// SPDX-License-Identifier: GPL-2.0-or-later
//
// JSON with names that need not be UTF-8. Files and models may have any bytes in their names; in
// the JSON of a sweep, a byte 0xNN that is not part of UTF-8 is the escape \udcNN, a lone
// surrogate. Python reads and writes the same in texts with "surrogateescape" (PEP 383), names of
// files among them.

#ifndef STAGE_TOOLS_STAGE_SWEEP_JSON_TEXT_HH
#define STAGE_TOOLS_STAGE_SWEEP_JSON_TEXT_HH

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace Stg::program {

/// The JSON text, in ASCII; its strings may have any bytes. `indent`: spaces for each level, or -1
/// for a single line.
std::string ToJsonText(const nlohmann::ordered_json& json, int indent);

/// Reads what ToJsonText() or Python has written. Throws nlohmann::json::exception.
nlohmann::ordered_json ParseJsonText(const std::string& text);

}  // namespace Stg::program

#endif
