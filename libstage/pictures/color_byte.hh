// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_PICTURES_COLOR_BYTE_HH
#define STAGE_PICTURES_COLOR_BYTE_HH

#include <cstdint>

namespace Stg {

/// Converts a channel of a colour, nominally 0..1, to the nearest of 0..255. Values outside of the
/// range become the nearest end of it, and NaN becomes 0.
inline uint8_t ColorByte(double fraction) {
  if (!(fraction > 0)) return 0;
  return fraction < 1 ? static_cast<uint8_t>(fraction * 255 + 0.5) : uint8_t{255};
}

}  // namespace Stg

#endif
