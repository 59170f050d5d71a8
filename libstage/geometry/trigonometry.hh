// SPDX-License-Identifier: GPL-2.0-or-later
//
// Sine and cosine that give the same bits on every processor.
//
// A C library picks variants of sin() and cos() by processor (with or without fused multiply-add),
// and these differ in the last bit; so would trajectories, from one machine to the next. Here only
// IEEE additions and multiplications are used, so that the results depend on the argument alone.
// Method: Cody-Waite reduction by pi/2 in three parts and the minimax polynomials of Sun's fdlibm
// (K. C. Ng, 1993), error below one unit in the last place for |angle| up to about 1e6.

#ifndef STAGE_GEOMETRY_TRIGONOMETRY_HH
#define STAGE_GEOMETRY_TRIGONOMETRY_HH

#include <cmath>

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

/// Both at once. NaN for NaN and for infinite angles.
inline SineCosine SinCos(double angle) {
  // Beyond this the quotient would no longer be exact; remainder() is, by definition.
  if (!(std::fabs(angle) < 1e6)) angle = std::remainder(angle, 2.0 * M_PI);

  // Nearest multiple of pi/2; halves go away from zero on either side, for symmetry.
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
  // NaN falls through the switch's conversion: test it first.
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

}  // namespace Stg

#endif
