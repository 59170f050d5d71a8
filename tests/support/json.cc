// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/json.hh"

#include <ostream>

template class nlohmann::basic_json<>;

void nlohmann::PrintTo(const json& value, std::ostream* out) { *out << value; }

Json ParseJson(const std::string& text) { return Json::parse(text); }
