// SPDX-License-Identifier: GPL-2.0-or-later
//
// Vectors in the plane, and minimum and maximum with a fixed treatment of signed zeros.

#ifndef STAGE_MOTION_VECTOR_HH
#define STAGE_MOTION_VECTOR_HH

#include <cmath>

#include "geometry/arithmetic.hh"

namespace Stg::motion {

struct Vector {
  double x = 0.0, y = 0.0;
};

inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y}; }
inline Vector operator-(Vector a) { return {-a.x, -a.y}; }
inline Vector operator*(double k, Vector a) { return {k * a.x, k * a.y}; }
inline double Dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }
inline double Cross(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }
inline double Length(Vector a) { return std::sqrt(Dot(a, a)); }
/// The vector turned by a quarter to the left.
inline Vector Left(Vector a) { return {-a.y, a.x}; }
/// A vector given in a frame that is turned by the angle with this sine and cosine.
inline Vector Rotate(Vector a, double sine, double cosine) {
  return {cosine * a.x - sine * a.y, sine * a.x + cosine * a.y};
}

inline double Least(double a, double b) { return b < a ? b : a; }
inline double Most(double a, double b) { return a < b ? b : a; }
inline double Clamp(double a, double low, double high) { return Least(Most(a, low), high); }

}  // namespace Stg::motion

#endif
