// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_TOOLS_STAGE_PARSE_NUMBER_HH
#define STAGE_TOOLS_STAGE_PARSE_NUMBER_HH

#include <charconv>
#include <optional>
#include <string_view>
#include <type_traits>

#include "worldfile/numbers.hh"

namespace Stg::program {

/// Parses text that must consist of a number alone: no blanks, and no sign for unsigned types.
template <typename Number>
std::optional<Number> ParseNumber(std::string_view text) {
  if constexpr (std::is_floating_point_v<Number>) {
    return worldfile::ReadWholeFloat(text);
  } else {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }
}

}  // namespace Stg::program

#endif
