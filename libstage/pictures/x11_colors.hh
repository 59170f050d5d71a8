// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_PICTURES_X11_COLORS_HH
#define STAGE_PICTURES_X11_COLORS_HH

#include <cstdint>
#include <span>
#include <string_view>

namespace Stg::geometry {

struct X11Color {
  std::string_view name;
  std::uint8_t red, green, blue;
};

/// The colour names of X11 with their values, sorted by name (bytewise).
std::span<const X11Color> X11Colors();

}  // namespace Stg::geometry

#endif
