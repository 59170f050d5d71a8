// SPDX-License-Identifier: GPL-2.0-or-later
//
// The range of a hit in the cell model: to the middle of the ray's way through the cell, as the
// outline that was hit lies anywhere in it. It has the same bits one by one, in pairs
// (MiddlesOf()), and in the lanes of wide_walk_lanes.hh; tests compare them.

#ifndef STAGE_SENSING_MIDDLE_HH
#define STAGE_SENSING_MIDDLE_HH

#include <algorithm>

#include "kernels/ray_walk.h"

namespace Stg::internal::sensing {

/// A ray in a cell, Q16: where it entered it, as offsets of the borders from its start, and the
/// size of its displacement in x and y.
struct Passage {
  int in_x, in_y;
  int across, along;
};

inline Passage PassageOf(const ray_t& ray) {
  return {(ray.u << 16) - ray.ox, (ray.v << 16) - ray.oy, ray.adx, ray.ady};
}

/// The larger of two quotients of integers, with denominators of 0 or more; one that is divided by
/// 0 does not count. Which is larger is told by their cross products, so that a single division is
/// left; division rounds monotonically, so the result is that of dividing both.
inline double LargerQuotient(int a, int across, int b, int along) {
  const bool first = along == 0 || (across != 0 && ray_product(a, along) > ray_product(b, across));
  return first ? double{1} * a / across : double{1} * b / along;
}

/// The same of the smaller one.
inline double SmallerQuotient(int a, int across, int b, int along) {
  return -LargerQuotient(-a, across, -b, along);
}

/// Where along its leg the ray is halfway through the cell that it has reached: 0 start, 1 end. The
/// ray as a whole ends at `end`.
inline double MiddleOf(const Passage& p, double end = 1.0) {
  if ((p.across | p.along) == 0) return 0.5 * end;
  const double in = std::max(0.0, LargerQuotient(p.in_x, p.across, p.in_y, p.along));
  const double out =
      std::min(end, SmallerQuotient(p.in_x + 65536, p.across, p.in_y + 65536, p.along));
  return 0.5 * (in + out);
}

/// Two numbers that the processor handles at once: what x86-64 and AArch64 all have.
typedef double Pair __attribute__((vector_size(16)));

/// Stands for a displacement of 0 in MiddlesOf(). The start lies within the cell then, so that the
/// border behind it comes out far back, and the one ahead far on.
inline constexpr double kNearlyNothing = 1e-290;

/// MiddleOf() of two rays at once. Dividing by numbers of which none is 0.
inline Pair MiddlesOf(Pair in_x, Pair in_y, Pair across, Pair along) {
  const auto larger = [](Pair a, Pair b) { return a > b ? a : b; };
  const auto smaller = [](Pair a, Pair b) { return a < b ? a : b; };
  const Pair in = larger(larger(in_x / across, in_y / along), Pair{0, 0});
  const Pair out_x = (in_x + 65536.0) / across, out_y = (in_y + 65536.0) / along;
  return 0.5 * (in + smaller(smaller(out_x, out_y), Pair{1, 1}));
}

}  // namespace Stg::internal::sensing

#endif
