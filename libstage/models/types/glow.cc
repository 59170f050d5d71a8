// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/types/glow.hh"

#include <algorithm>
#include <cmath>

#include "models/light.hh"

namespace Stg {

double GlowRadius(const LightSource& light) {
  constexpr double kEdge = 4;     // W/m2
  constexpr double kLargest = 2;  // metres
  if (!light.IsOn() || light.GetIntensity() == 0) return 0;
  const Size size = light.model().GetGeom().size;
  const double reach = std::sqrt(light.GetIntensity() / kEdge);
  return std::min(kLargest, std::max({reach, size.x, size.y}));
}

}  // namespace Stg
