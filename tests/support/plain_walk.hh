// SPDX-License-Identifier: GPL-2.0-or-later
//
// The walk of a ray in the plainest way: the rules at the head of kernels/ray_walk.h, one cell at a
// time, with integers so wide that nothing can overflow.

#ifndef STAGE_TESTS_SUPPORT_PLAIN_WALK_HH
#define STAGE_TESTS_SUPPORT_PLAIN_WALK_HH

#include <cstdint>

namespace Stg::test {

__extension__ typedef __int128 WideInt;

/// A ray from the fraction (fx, fy) of the cell (x, y), by (dx, dy); fractions and displacement in
/// 1/65536 cell.
struct PlainRay {
  int64_t x, y, fx, fy, dx, dy;
};

/// Calls f(u, v, x, y) for each cell of the ray, in order, until f returns true; (u, v) borders
/// have been crossed to reach the cell (x, y).
template <typename F>
void WalkPlainly(const PlainRay& ray, F f) {
  const int64_t sx = ray.dx < 0 ? -1 : 1, sy = ray.dy < 0 ? -1 : 1;
  const int64_t ox = ray.dx < 0 ? 65536 - ray.fx : ray.fx;
  const int64_t oy = ray.dy < 0 ? 65536 - ray.fy : ray.fy;
  const int64_t length_x = ray.dx * sx, length_y = ray.dy * sy;
  int64_t u = 0, v = 0;
  while (!f(u, v, ray.x + sx * u, ray.y + sy * v)) {
    const int64_t border_x = (u + 1) * 65536 - ox, border_y = (v + 1) * 65536 - oy;
    if (WideInt{border_x} * length_y < WideInt{border_y} * length_x) {
      if (border_x > length_x) return;
      u++;
    } else {
      if (border_y > length_y) return;
      v++;
    }
  }
}

}  // namespace Stg::test

#endif
