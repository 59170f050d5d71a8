// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_ENERGY_SUPPLY_HH
#define STAGE_MODELS_ENERGY_SUPPLY_HH

#include <cmath>

#include "geometry/geometry.hh"

namespace Stg {

/// True if a store with this amount gives without limit.
inline bool IsInfiniteSupply(joules_t stored) { return stored < 0 || std::isinf(stored); }

/// An amount's contribution to a total; 0 if it is infinite or negative.
inline joules_t Countable(joules_t amount) {
  return amount > 0 && std::isfinite(amount) ? amount : 0;
}

}  // namespace Stg

#endif
