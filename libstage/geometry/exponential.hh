// SPDX-License-Identifier: GPL-2.0-or-later
//
// The exponential function with bit-equal results on every processor, like trigonometry.hh.

#ifndef STAGE_GEOMETRY_EXPONENTIAL_HH
#define STAGE_GEOMETRY_EXPONENTIAL_HH

#include <cmath>
#include <limits>

#include "geometry/arithmetic.hh"

namespace Stg {

/// e to the power of x, with a relative error below 1e-15. The argument is reduced by a multiple of
/// ln 2, in two parts as in Sun's fdlibm, and the rest is summed as a Taylor series.
inline double Exponential(double x) {
  if (std::isnan(x)) return x;
  if (x < -745.0) return 0;
  if (x > 709.0) return std::numeric_limits<double>::infinity();
  const double power = std::trunc(x * 1.44269504088896338700e+00 + std::copysign(0.5, x));
  const double rest = (x - power * 6.93147180369123816490e-01) - power * 1.90821492927058770002e-10;
  double sum = 1.0;
  for (int k = 14; k >= 1; k--) sum = 1.0 + sum * rest / k;
  return std::ldexp(sum, static_cast<int>(power));
}

}  // namespace Stg

#endif
