// SPDX-License-Identifier: GPL-2.0-or-later

#ifndef STAGE_ROWS_PLACED_HH
#define STAGE_ROWS_PLACED_HH

#include <bit>
#include <cmath>
#include <cstdint>

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"

namespace Stg::rows {

/// normalize() without a call for angles that are in range.
inline double Normalized(double a) { return a >= -M_PI && a <= M_PI ? a : normalize(a); }

/// A pose in the plane with the sine and cosine of its heading. Sums have the bits of sums of Pose;
/// sines are computed only if the heading changes.
struct Placed {
  double x, y, a;
  SineCosine turn;

  Placed operator+(const Pose& p) const {
    Placed sum{x + p.x * turn.cosine - p.y * turn.sine, y + p.x * turn.sine + p.y * turn.cosine,
               Normalized(a + p.a), turn};
    if (std::bit_cast<uint64_t>(sum.a) != std::bit_cast<uint64_t>(a)) sum.turn = SinCos(sum.a);
    return sum;
  }
};

}  // namespace Stg::rows

#endif
