// SPDX-License-Identifier: GPL-2.0-or-later
//
// A reference implementation of the walk of a ray: it applies the rules at the top of
// kernels/ray_walk.h cell by cell, with integers so wide that nothing overflows.

#ifndef STAGE_TESTS_SUPPORT_PLAIN_WALK_HH
#define STAGE_TESTS_SUPPORT_PLAIN_WALK_HH

#include <cstdint>

namespace Stg::test {

/// True if a * b < c * d. Products have up to 128 bits, for which not every compiler has a type.
inline bool ProductIsLess(uint64_t a, uint64_t b, uint64_t c, uint64_t d) {
  struct Product {
    uint64_t high, low;
  };
  const auto multiply = [](uint64_t x, uint64_t y) {
    constexpr uint64_t kLow = 0xffffffffu;
    const uint64_t low = (x & kLow) * (y & kLow);
    const uint64_t one = (x >> 32) * (y & kLow) + (low >> 32);
    const uint64_t other = (x & kLow) * (y >> 32) + (one & kLow);
    return Product{(x >> 32) * (y >> 32) + (one >> 32) + (other >> 32), other << 32 | (low & kLow)};
  };
  const Product first = multiply(a, b), second = multiply(c, d);
  return first.high != second.high ? first.high < second.high : first.low < second.low;
}

/// A ray from the fraction (fx, fy) of the cell (x, y), with the displacement (dx, dy). Fractions
/// and displacement are in 1/65536 cell.
struct PlainRay {
  int64_t x, y, fx, fy, dx, dy;
};

/// Calls f(u, v, x, y) for each cell of the ray, in order, until f returns true. u and v are the
/// numbers of borders crossed along x and y to reach the cell (x, y).
template <typename F>
void WalkPlainly(const PlainRay& ray, F f) {
  const int64_t sx = ray.dx < 0 ? -1 : 1, sy = ray.dy < 0 ? -1 : 1;
  const int64_t ox = ray.dx < 0 ? 65536 - ray.fx : ray.fx;
  const int64_t oy = ray.dy < 0 ? 65536 - ray.fy : ray.fy;
  const int64_t length_x = ray.dx * sx, length_y = ray.dy * sy;
  const auto unsigned_of = [](int64_t n) { return static_cast<uint64_t>(n); };  // none is negative
  int64_t u = 0, v = 0;
  while (!f(u, v, ray.x + sx * u, ray.y + sy * v)) {
    const int64_t border_x = (u + 1) * 65536 - ox, border_y = (v + 1) * 65536 - oy;
    if (ProductIsLess(unsigned_of(border_x), unsigned_of(length_y), unsigned_of(border_y),
                      unsigned_of(length_x))) {
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
