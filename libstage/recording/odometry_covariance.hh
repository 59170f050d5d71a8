// SPDX-License-Identifier: GPL-2.0-or-later
//
// Covariances for odometry messages.

#ifndef STAGE_RECORDING_ODOMETRY_COVARIANCE_HH
#define STAGE_RECORDING_ODOMETRY_COVARIANCE_HH

#include <array>
#include <cstddef>

#include "geometry/geometry.hh"
#include "motion/pose_covariance.hh"

namespace Stg::recording {

/// Propagates a robot's odometry errors to the covariance of its estimated pose.
///
/// Odometry adds a fraction of each motion forwards, to the left and in turning: the property
/// `odom_error`. To first order, the error of an estimate is J e. Here e holds the three fractions,
/// and J is the derivative of the pose with respect to them, updated with each motion. The
/// covariance is J diag(e^2) J^T, plus that of the random errors of `odom_noise`.
///
/// ROS interprets an all-zero matrix as unknown, so exact values get kExact on the diagonal and
/// unmeasured ones (z, roll, pitch) kUnknown.
class OdometryCovariance {
 public:
  static constexpr double kExact = 1e-9, kUnknown = 1e6;
  static constexpr size_t kSize = 36;
  using Matrix = std::array<double, kSize>;  ///< 6 rows: x, y, z, roll, pitch, yaw

  /// Call with each estimate in turn.
  void Move(const Pose& estimate);
  /// Covariance of the last estimate. `error`: fractions of the motion; `random`: covariance of
  /// random errors.
  Matrix OfPose(const Velocity& error, const PoseCovariance& random = {}) const;
  static Matrix OfTwist(const Velocity& velocity, const Velocity& error,
                        const PoseCovariance& random = {});

 private:
  bool has_moved_ = false;
  Pose before_;
  double jacobian_[3][3] = {};  // derivative of (x, y, heading) with respect to the fractions
};

}  // namespace Stg::recording

#endif
