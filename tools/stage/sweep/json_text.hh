// SPDX-License-Identifier: GPL-2.0-or-later
//
// JSON with strings that need not be valid UTF-8, because names of files and models may contain any
// bytes. In the JSON of a sweep, a byte 0xNN that is not part of valid UTF-8 is written as the
// escape \udcNN, a lone surrogate. This is Python's error handler "surrogateescape" (PEP 383),
// which it also uses for file names.

#ifndef STAGE_TOOLS_STAGE_SWEEP_JSON_TEXT_HH
#define STAGE_TOOLS_STAGE_SWEEP_JSON_TEXT_HH

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace Stg::program {

/// Returns ASCII text; strings may contain any bytes. `indent` is the number of spaces per level,
/// or -1 for a single line.
std::string ToJsonText(const nlohmann::ordered_json& json, int indent);

/// Parses output of ToJsonText() or Python. Throws nlohmann::json::exception.
nlohmann::ordered_json ParseJsonText(const std::string& text);

}  // namespace Stg::program

#endif
