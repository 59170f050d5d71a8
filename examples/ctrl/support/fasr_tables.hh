// SPDX-License-Identifier: GPL-2.0-or-later
//
// Navigation tables for the world of `fasr`, 16 m by 16 m about the origin: a heading for each of 4
// by 4 squares and each errand.

#ifndef EXAMPLES_CTRL_SUPPORT_FASR_TABLES_HH
#define EXAMPLES_CTRL_SUPPORT_FASR_TABLES_HH

#include "stage.hh"

namespace ctrl {

enum class Errand { kDeliver, kFetch, kRefuel };

/// Index 0..3 of the square that contains a coordinate; points outside belong to the nearest one.
inline size_t SquareOf(double coordinate) {
  return static_cast<size_t>(Stg::constrain((coordinate + 8.0) / 4.0, 0.0, 3.0));
}

/// Returns the heading for a robot at (x, y), radians.
inline double HeadingFor(Errand errand, double x, double y) {
  // Degrees. Rows run from south to north, columns from west to east.
  static const double kDegrees[3][4][4] = {
      {{90, 180, 180, 180}, {90, -90, 180, 90}, {90, 90, 180, 90}, {0, 45, 0, 0}},
      {{-120, -180, 180, 180}, {-90, -120, 180, 90}, {-90, -90, 180, 180}, {-90, -180, -90, -90}},
      {{0, 0, 45, 120}, {0, -90, -60, -160}, {-90, -90, 180, 180}, {-90, -180, -90, -90}}};
  return Stg::dtor(kDegrees[static_cast<size_t>(errand)][SquareOf(y)][SquareOf(x)]);
}

}  // namespace ctrl

#endif
