// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_MODELS_BUMPER_TOUCH_HH
#define STAGE_MODELS_BUMPER_TOUCH_HH

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"

namespace Stg {

/// True if a contact of outlines counts as one at a bumper's line of that length, which starts at
/// `start` in the direction `along`. Metres.
inline bool IsAtLine(const point_t& start, const SineCosine& along, double length,
                     const point_t& contact) {
  constexpr double kTouchDistance = 0.01;
  const double dx = contact.x - start.x, dy = contact.y - start.y;
  const double nearest = constrain(dx * along.cosine + dy * along.sine, 0, length);
  const double x = dx - nearest * along.cosine, y = dy - nearest * along.sine;
  return x * x + y * y < kTouchDistance * kTouchDistance;
}

}  // namespace Stg

#endif
