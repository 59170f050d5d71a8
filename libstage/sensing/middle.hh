// SPDX-License-Identifier: GPL-2.0-or-later
//
// The range of a hit in the cell model: to the midpoint of the ray's path in the cell, because
// the outline may lie anywhere in it. The result is bit-equal for single rays, pairs (MiddlesOf())
// and the lanes of wide_walk_lanes.hh, as tests verify.

#ifndef STAGE_SENSING_MIDDLE_HH
#define STAGE_SENSING_MIDDLE_HH

#include <algorithm>

#include "kernels/ray_walk.h"

namespace Stg::internal::sensing {

/// A ray's passage through a cell in Q16: offsets from the start of the borders by which it enters,
/// and the absolute displacement in x and y.
struct Passage {
  int in_x, in_y;
  int across, along;
};

inline Passage PassageOf(const ray_t& ray) {
  return {(ray.u << 16) - ray.ox, (ray.v << 16) - ray.oy, ray.adx, ray.ady};
}

/// The larger of a / across and b / along. Denominators are not negative; a quotient by 0 is
/// ignored. Compares cross products, so that one division suffices. Division rounds monotonically,
/// so the result is that of dividing both.
inline double LargerQuotient(int a, int across, int b, int along) {
  const bool first = along == 0 || (across != 0 && ray_product(a, along) > ray_product(b, across));
  return first ? double{1} * a / across : double{1} * b / along;
}

/// Like LargerQuotient(), for the smaller one.
inline double SmallerQuotient(int a, int across, int b, int along) {
  return -LargerQuotient(-a, across, -b, along);
}

/// Position halfway through the cell that the ray has reached, as a fraction of the leg (0 start, 1
/// end). `end` is the end of the whole ray in that unit.
inline double MiddleOf(const Passage& p, double end = 1.0) {
  if ((p.across | p.along) == 0) return 0.5 * end;
  const double in = std::max(0.0, LargerQuotient(p.in_x, p.across, p.in_y, p.along));
  const double out =
      std::min(end, SmallerQuotient(p.in_x + 65536, p.across, p.in_y + 65536, p.along));
  return 0.5 * (in + out);
}

/// Two numbers in one vector register, which all x86-64 and AArch64 processors have.
typedef double Pair __attribute__((vector_size(16)));

/// Replaces a displacement of 0 in MiddlesOf(). The start then lies within the cell, so the border
/// behind it comes out far back and the one ahead far away.
inline constexpr double kTinyDisplacement = 1e-290;

/// MiddleOf() of two rays at once. No divisor is 0.
inline Pair MiddlesOf(Pair in_x, Pair in_y, Pair across, Pair along) {
  const auto larger = [](Pair a, Pair b) { return a > b ? a : b; };
  const auto smaller = [](Pair a, Pair b) { return a < b ? a : b; };
  const Pair in = larger(larger(in_x / across, in_y / along), Pair{0, 0});
  const Pair out_x = (in_x + 65536.0) / across, out_y = (in_y + 65536.0) / along;
  return 0.5 * (in + smaller(smaller(out_x, out_y), Pair{1, 1}));
}

}  // namespace Stg::internal::sensing

#endif
