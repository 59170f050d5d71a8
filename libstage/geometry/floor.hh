// SPDX-License-Identifier: GPL-2.0-or-later
//
// Rounding to integers without calls of the C library, which the compiler makes for processors
// whose instruction set it must assume to lack rounding.

#ifndef STAGE_GEOMETRY_FLOOR_HH
#define STAGE_GEOMETRY_FLOOR_HH

#include <cstdint>

namespace Stg {

/// The greatest integer not above `value`, which must be within the range of int32_t.
inline int32_t FloorToInt(double value) {
  const auto truncated = static_cast<int32_t>(value);
  return truncated - (static_cast<double>(truncated) > value);
}

/// True if the floor of `value` is above -limit and below `limit`. False for NaN.
inline bool FloorIsWithin(double value, int32_t limit) {
  return (value >= 1.0 - limit) & (value < limit);  // without a branch
}

}  // namespace Stg

#endif
