/* SPDX-License-Identifier: GPL-2.0-or-later
 *
 * Arithmetic of rows on devices, bit-equal to that of the host: only operations that IEEE 754
 * rounds correctly. The functions are those of libstage/geometry and libstage/random. Compiled
 * after row_records.h.
 */
#ifndef STAGE_KERNELS_ROW_MATH_H
#define STAGE_KERNELS_ROW_MATH_H

#ifdef RAY_IN_OPENCL
#define ROW_BITS(number) as_ulong(number)
#define ROW_NUMBER(bits) as_double(bits)
#else
#include <bit>
#include <cmath>

#include "kernels/row_records.h"
#define ROW_BITS(number) std::bit_cast<uint64_t>(number)
#define ROW_NUMBER(bits) std::bit_cast<double>(bits)
namespace Stg {
#endif

/* A compiler option may define it otherwise, to test that such a device is refused. */
#ifndef ROW_PI
#define ROW_PI 3.14159265358979323846
#endif

RAY_FUNCTION int row_is_nan(double value) { return value != value; }
RAY_FUNCTION int row_is_infinite(double value) {
  return (ROW_BITS(value) & (((ray_ulong)1 << 63) - 1)) == (ray_ulong)0x7ff << 52;
}
RAY_FUNCTION int row_is_finite(double value) { return ((ROW_BITS(value) >> 52) & 0x7ff) != 0x7ff; }
RAY_FUNCTION double row_infinity(void) { return ROW_NUMBER((ray_ulong)0x7ff << 52); }
RAY_FUNCTION double row_smaller(double a, double b) { return b < a ? b : a; }
RAY_FUNCTION double row_larger(double a, double b) { return a < b ? b : a; }
RAY_FUNCTION double row_constrain(double value, double low, double high) {
  return value < low ? low : value > high ? high : value;
}

/* See geometry/floor.hh. */
RAY_FUNCTION int row_floor(double value) {
  const int truncated = (int)value;
  return truncated - ((double)truncated > value ? 1 : 0);
}
RAY_FUNCTION int row_floor_is_within(double value, int limit) {
  return value >= 1.0 - limit && value < limit;
}

/* Rounds to the nearest integer, ties away from zero. */
RAY_FUNCTION int row_rounded(double value) {
  return value < 0 ? -row_floor(0.5 - value) : row_floor(value + 0.5);
}

/* The exact remainder with the nearest multiple of y, ties to even, as IEEE 754 defines it. For
 * |x| > y > 0, both normal numbers. NaN for NaN and infinity. */
RAY_FUNCTION double row_remainder(double x, double y) {
  const ray_ulong one = (ray_ulong)1 << 52;
  const ray_ulong bits = ROW_BITS(x), divisor = (ROW_BITS(y) & (one - 1)) | one;
  const int exponent_of_y = (int)((ROW_BITS(y) >> 52) & 0x7ff);
  ray_ulong rest = (bits & (one - 1)) | one;
  int exponent = (int)((bits >> 52) & 0x7ff), is_odd = 0;
  double magnitude;
  if (exponent == 0x7ff) return x - x;
  for (;; exponent--) {
    is_odd = rest >= divisor;
    if (is_odd) rest -= divisor;
    if (exponent == exponent_of_y) break;
    rest <<= 1;
  }
  if (rest == 0) return (bits >> 63) != 0 ? -0.0 : 0.0;
  while ((rest & one) == 0) {
    rest <<= 1;
    exponent--;
  }
  magnitude = ROW_NUMBER((rest - one) | ((ray_ulong)exponent << 52));
  if (2 * magnitude > y || (2 * magnitude == y && is_odd)) magnitude -= y;
  return (bits >> 63) != 0 ? -magnitude : magnitude;
}

/* See normalize(). */
RAY_FUNCTION double row_normalize(double a) {
  if (a >= -ROW_PI && a <= ROW_PI) return a;
  if (fabs(a) < 3.0 * ROW_PI) return a > ROW_PI ? a - 2.0 * ROW_PI : a + 2.0 * ROW_PI;
  return row_remainder(a, 2.0 * ROW_PI);
}

/* ---- geometry/trigonometry.hh ------------------------------------------------------------- */

RAY_FUNCTION double row_sine_kernel(double r, double tail) {
  const double z = r * r;
  const double p = 8.33333333332248946124e-03 +
                   z * (-1.98412698298579493134e-04 +
                        z * (2.75573137070700676789e-06 +
                             z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
  const double v = z * r;
  return r - ((z * (0.5 * tail - v * p) - tail) - v * -1.66666666666666324348e-01);
}

RAY_FUNCTION double row_cosine_kernel(double r, double tail) {
  const double z = r * r;
  const double p =
      z * (4.16666666666666019037e-02 +
           z * (-1.38888888888741095749e-03 +
                z * (2.48015872894767294178e-05 +
                     z * (-2.75573143513906633035e-07 +
                          z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const double half_z = 0.5 * z;
  const double w = 1.0 - half_z;
  return w + (((1.0 - w) - half_z) + (z * p - r * tail));
}

/* Sine and cosine of an angle below 1e6 or NaN. */
RAY_FUNCTION row_turn_t row_turn_within(double angle) {
  double quotient, first, second, rough, rest, r, tail, sine, cosine;
  row_turn_t turn;
  int quadrant;
  quotient = trunc(angle * 6.36619772367581382433e-01 + copysign(0.5, angle));
  turn.sine = turn.cosine = quotient;
  if (row_is_nan(quotient)) return turn;
  first = angle - quotient * 1.57079632673412561417e+00;
  second = quotient * 6.07710050630396597660e-11;
  rough = first - second;
  rest = quotient * 2.02226624879595063154e-21 - ((first - rough) - second);
  r = rough - rest;
  tail = (rough - r) - rest;
  sine = row_sine_kernel(r, tail);
  cosine = row_cosine_kernel(r, tail);
  quadrant = (int)quotient & 3;
  turn.sine = (quadrant & 1) != 0 ? cosine : sine;
  turn.cosine = (quadrant & 1) != 0 ? sine : cosine;
  if ((quadrant & 2) != 0) turn.sine = -turn.sine;
  if (quadrant == 1 || quadrant == 2) turn.cosine = -turn.cosine;
  return turn;
}

RAY_FUNCTION row_turn_t row_turn(double angle) {
  return row_turn_within(fabs(angle) < 1e6 ? angle : row_remainder(angle, 2.0 * ROW_PI));
}

RAY_FUNCTION double row_arc_tangent_of_ratio(double x) {
  double high = 0.0, low = 0.0, t = x, z, w, odd, even;
  if (x >= 2.4375) {
    high = 1.57079632679489655800e+00;
    low = 6.12323399573676603587e-17;
    t = -1.0 / x;
  } else if (x >= 1.1875) {
    high = 9.82793723247329054082e-01;
    low = 1.39033110312309984516e-17;
    t = (x - 1.5) / (1.0 + 1.5 * x);
  } else if (x >= 0.6875) {
    high = 7.85398163397448278999e-01;
    low = 3.06161699786838301793e-17;
    t = (x - 1.0) / (x + 1.0);
  } else if (x >= 0.4375) {
    high = 4.63647609000806093515e-01;
    low = 2.26987774529616870924e-17;
    t = (2.0 * x - 1.0) / (2.0 + x);
  }
  z = t * t;
  w = z * z;
  odd = z * (3.33333333333329318027e-01 +
             w * (1.42857142725034663711e-01 +
                  w * (9.09088713343650656196e-02 +
                       w * (6.66107313738753120669e-02 +
                            w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
  even = w * (-1.99999999998764832476e-01 +
              w * (-1.11111104054623557880e-01 +
                   w * (-7.69187620504482999495e-02 +
                        w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
  return high - ((t * (odd + even) - low) - t);
}

/* See ArcTangent(). */
RAY_FUNCTION double row_arc_tangent(double y, double x) {
  const double ax = fabs(x), ay = fabs(y);
  double angle = ax == 0 && ay == 0 ? 0.0 : row_arc_tangent_of_ratio(ay / ax);
  if (x < 0 || (ay == 0 && (ROW_BITS(x) >> 63) != 0))
    angle = ROW_PI - (angle - 1.22464679914735317720e-16);
  return copysign(angle, y);
}

/* ---- poses -------------------------------------------------------------------------------- */

RAY_FUNCTION int row_is_zero(row_planar_t p) { return p.x == 0 && p.y == 0 && p.a == 0; }
RAY_FUNCTION int row_is_finite_pose(row_planar_t p) {
  return row_is_finite(p.x) && row_is_finite(p.y) && row_is_finite(p.a);
}

/* Moves a place by a pose in its frame, see Placed. */
RAY_FUNCTION void row_add(row_placed_t* at, row_planar_t p) {
  const double x = at->x + p.x * at->turn.cosine - p.y * at->turn.sine;
  const double y = at->y + p.x * at->turn.sine + p.y * at->turn.cosine;
  const double a = row_normalize(at->a + p.a);
  if (ROW_BITS(a) != ROW_BITS(at->a)) at->turn = row_turn_within(a);
  at->x = x;
  at->y = y;
  at->a = a;
}

/* See Pose::operator+(). */
RAY_FUNCTION row_planar_t row_sum(row_planar_t at, row_planar_t p) {
  const row_turn_t turn = row_turn(at.a);
  row_planar_t sum;
  sum.x = at.x + p.x * turn.cosine - p.y * turn.sine;
  sum.y = at.y + p.x * turn.sine + p.y * turn.cosine;
  sum.a = row_normalize(at.a + p.a);
  return sum;
}

/* ---- random numbers: random/random.hh, models/noise.hh ------------------------------------ */

RAY_FUNCTION ray_ulong row_rotated(ray_ulong value, int bits) {
  return (value << bits) | (value >> (64 - bits));
}

RAY_FUNCTION ray_ulong row_next(row_random_t* random) {
  ray_ulong* const s = random->state;
  const ray_ulong result = row_rotated(s[1] * 5, 7) * 9, shifted = s[1] << 17;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= shifted;
  s[3] = row_rotated(s[3], 45);
  return result;
}

RAY_FUNCTION double row_uniform(row_random_t* random) {
  return (double)(row_next(random) >> 11) * (1.0 / 9007199254740992.0);
}

RAY_FUNCTION ray_uint row_choose(row_random_t* random, ray_uint count) {
  return (ray_uint)((row_next(random) >> 32) * count >> 32);
}

RAY_FUNCTION double row_uniform_error(row_random_t* random) {
  const double value = -1.0 + 2.0 * row_uniform(random);
  return value < 1.0 ? value : -1.0;
}

RAY_FUNCTION double row_normal_error(row_random_t* random) {
  double sum = -6.0;
  int i;
  for (i = 0; i < 12; i++) sum += row_uniform(random);
  return sum;
}

#ifndef RAY_IN_OPENCL
}  // namespace Stg
#endif
#endif
