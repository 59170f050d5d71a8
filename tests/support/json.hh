// SPDX-License-Identifier: GPL-2.0-or-later
//
// JSON in tests. The code of its class is compiled once, in json.cc: it takes a compiler five
// seconds.

#ifndef STAGE_TESTS_JSON_HH
#define STAGE_TESTS_JSON_HH

#include <iosfwd>
#include <nlohmann/json.hpp>
#include <string>

extern template class nlohmann::basic_json<>;

using Json = nlohmann::json;

namespace nlohmann {
/// Prints the value as JSON where an expectation fails.
void PrintTo(const json& value, std::ostream* out);
}  // namespace nlohmann

/// Parses a text. Throws nlohmann::json::parse_error if it is not JSON.
Json ParseJson(const std::string& text);

#endif
