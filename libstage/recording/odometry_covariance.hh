// SPDX-License-Identifier: GPL-2.0-or-later
//
// Covariances of odometry messages: how far an estimate may be off.

#ifndef STAGE_RECORDING_ODOMETRY_COVARIANCE_HH
#define STAGE_RECORDING_ODOMETRY_COVARIANCE_HH

#include <array>
#include <cstddef>

#include "geometry/geometry.hh"

namespace Stg::recording {

/// Follows how the errors of a robot's odometry grow into errors of its estimated pose.
///
/// Odometry adds a share of each motion forwards, to the left and turning, the property
/// `odom_error`. To first order an estimate is off by J e, where e are the three shares and J is
/// the derivative of the pose by them, which each motion changes. The covariance is J diag(e^2)
/// J^T.
///
/// ROS takes a matrix of zeros for one that is not known, so none is written. What is known exactly
/// has kExact on the diagonal, and what is not measured (z, roll and pitch) kUnknown.
class OdometryCovariance {
 public:
  static constexpr double kExact = 1e-9, kUnknown = 1e6;
  static constexpr size_t kSize = 36;
  using Matrix = std::array<double, kSize>;  ///< 6 rows: x, y, z, roll, pitch, yaw

  /// To be called with each estimate in turn.
  void Move(const Pose& estimate);
  /// Covariance of the last estimate. `error`: shares of the motion.
  Matrix OfPose(const Velocity& error) const;
  static Matrix OfTwist(const Velocity& velocity, const Velocity& error);

 private:
  bool has_moved_ = false;
  Pose before_;
  double jacobian_[3][3] = {};  // x, y and heading by the shares
};

}  // namespace Stg::recording

#endif
