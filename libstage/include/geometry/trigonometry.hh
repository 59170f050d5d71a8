// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sine, cosine, arc tangent and hypotenuse with bit-equal results on every processor.
//
// C libraries select variants of sin() and the like by processor (with or without fused
// multiply-add). These differ in the last bit, and so would trajectories on different machines. The
// functions here use only operations that IEEE 754 rounds correctly: addition, multiplication,
// division and square root. Method of sine and cosine: Cody-Waite reduction by pi/2 in three parts
// and the minimax polynomials of Sun's fdlibm (K. C. Ng, 1993), with an error below one unit in the
// last place for |angle| up to about 1e6.

#ifndef STAGE_GEOMETRY_TRIGONOMETRY_HH
#define STAGE_GEOMETRY_TRIGONOMETRY_HH

#include <cmath>

#include "geometry/arithmetic.hh"

namespace Stg {

struct SineCosine {
  double sine, cosine;
};

namespace trigonometry {

/// sin(r + tail) for |r| <= pi/4.
inline double SineKernel(double r, double tail) {
  const double z = r * r;
  const double p = 8.33333333332248946124e-03 +
                   z * (-1.98412698298579493134e-04 +
                        z * (2.75573137070700676789e-06 +
                             z * (-2.50507602534068634195e-08 + z * 1.58969099521155010221e-10)));
  const double v = z * r;
  return r - ((z * (0.5 * tail - v * p) - tail) - v * -1.66666666666666324348e-01);
}

/// cos(r + tail) for |r| <= pi/4.
inline double CosineKernel(double r, double tail) {
  const double z = r * r;
  const double p =
      z * (4.16666666666666019037e-02 +
           z * (-1.38888888888741095749e-03 +
                z * (2.48015872894767294178e-05 +
                     z * (-2.75573143513906633035e-07 +
                          z * (2.08757232129817482790e-09 + z * -1.13596475577881948265e-11)))));
  const double half = 0.5 * z;
  const double w = 1.0 - half;
  return w + (((1.0 - w) - half) + (z * p - r * tail));
}

}  // namespace trigonometry

/// Sine and cosine of an angle in radians. NaN for NaN and infinite angles.
inline SineCosine SinCos(double angle) {
  // For larger angles the reduction below would not be exact; std::remainder() always is.
  if (!(std::fabs(angle) < 1e6)) angle = std::remainder(angle, 2.0 * M_PI);

  // Nearest multiple of pi/2. Ties round away from zero, for symmetry.
  const double quotient =
      std::trunc(angle * 6.36619772367581382433e-01 + std::copysign(0.5, angle));
  const double first = angle - quotient * 1.57079632673412561417e+00;  // exact: 33-bit constant
  const double second = quotient * 6.07710050630396597660e-11;
  const double rough = first - second;
  const double rest = quotient * 2.02226624879595063154e-21 - ((first - rough) - second);
  const double r = rough - rest;
  const double tail = (rough - r) - rest;

  const double sine = trigonometry::SineKernel(r, tail);
  const double cosine = trigonometry::CosineKernel(r, tail);
  // Tested before the switch, because NaN cannot be converted to an integer.
  if (std::isnan(quotient)) return {quotient, quotient};
  switch (static_cast<long>(quotient) & 3) {
    case 0:
      return {sine, cosine};
    case 1:
      return {cosine, -sine};
    case 2:
      return {-sine, -cosine};
    default:
      return {-cosine, sine};
  }
}

namespace trigonometry {

/// atan(x) for x >= 0, with fdlibm's polynomial. Reduces to the angle from the nearest of atan(0),
/// atan(1/2), atan(1), atan(3/2) and atan(infinity), each given in two parts.
inline double ArcTangentOfRatio(double x) {
  double high = 0.0, low = 0.0, t = x;
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
  const double z = t * t, w = z * z;
  const double odd =
      z * (3.33333333333329318027e-01 +
           w * (1.42857142725034663711e-01 +
                w * (9.09088713343650656196e-02 +
                     w * (6.66107313738753120669e-02 +
                          w * (4.97687799461593236017e-02 + w * 1.62858201153657823623e-02)))));
  const double even =
      w * (-1.99999999998764832476e-01 +
           w * (-1.11111104054623557880e-01 +
                w * (-7.69187620504482999495e-02 +
                     w * (-5.83357013379057348645e-02 + w * -3.65315727442169155270e-02))));
  return high - ((t * (odd + even) - low) - t);
}

}  // namespace trigonometry

/// The angle of the point (x, y) in [-pi, pi], as atan2() returns it but bit-equal on every
/// processor. NaN for NaN and if both are infinite.
inline double ArcTangent(double y, double x) {
  const double ax = std::fabs(x), ay = std::fabs(y);
  double angle = ax == 0 && ay == 0 ? 0.0 : trigonometry::ArcTangentOfRatio(ay / ax);
  if (x < 0 || (ay == 0 && std::signbit(x)))
    angle = M_PI - (angle - 1.22464679914735317720e-16);  // pi has more digits than M_PI
  return std::copysign(angle, y);
}

/// The length of (x, y), as hypot() to two units in the last place. Infinity wins over NaN.
inline double Hypotenuse(double x, double y) {
  const double square = x * x + y * y;
  if (square > 1e-280 && square < 1e300) return std::sqrt(square);
  // The squares overflow or underflow, or the sum is 0 or NaN.
  const double ax = std::fabs(x), ay = std::fabs(y), larger = ax > ay ? ax : ay;
  if (std::isinf(ax) || std::isinf(ay)) return HUGE_VAL;
  if (!(larger > 0)) return ax + ay;
  return larger * std::sqrt((ax / larger) * (ax / larger) + (ay / larger) * (ay / larger));
}

}  // namespace Stg

#endif
