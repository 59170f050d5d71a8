// SPDX-License-Identifier: GPL-2.0-or-later
//
// Covariance of a pose or velocity in the plane. Part of <stage.hh>; C++11.

#ifndef STAGE_MOTION_POSE_COVARIANCE_HH
#define STAGE_MOTION_POSE_COVARIANCE_HH

namespace Stg {

/// A symmetric matrix over x (m), y (m) and heading (rad), or over their rates.
struct PoseCovariance {
  double xx, xy, yy, xa, ya, aa;

  PoseCovariance() : xx(0), xy(0), yy(0), xa(0), ya(0), aa(0) {}
  /// Element of the matrix; 0: x, 1: y, 2: heading.
  double At(int row, int column) const {
    const double elements[3][3] = {{xx, xy, xa}, {xy, yy, ya}, {xa, ya, aa}};
    return elements[row][column];
  }
  template <class Exchange>
  void ExchangeState(Exchange& exchange) {
    exchange(xx, xy, yy, xa, ya, aa);
  }
};

}  // namespace Stg

#endif
