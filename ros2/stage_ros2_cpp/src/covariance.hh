// SPDX-License-Identifier: GPL-2.0-or-later
//
// Covariances of odometry. In ROS, a matrix of zeros means that the covariance is unknown, so none
// is published: exact values have kExact on the diagonal, those that are not measured kUnknown.

#ifndef STAGE_ROS2_CPP_COVARIANCE_HH
#define STAGE_ROS2_CPP_COVARIANCE_HH

#include <array>
#include <stage.hh>

namespace stage_ros2_cpp {

constexpr double kExact = 1e-9, kUnknown = 1e6;
using Covariance = std::array<double, 36>;  ///< x, y, z, roll, pitch, yaw, row by row
using Planar3 = std::array<std::array<double, 3>, 3>;

/// Converts a covariance of x, y and heading to six dimensions.
Covariance InSpace(const Planar3& planar);

/// Propagates a robot's odometry errors to the covariance of its estimated pose.
///
/// Odometry scales each motion forwards, to the left and turning by 1 + e, where e is the property
/// `odom_error`. To first order, the error of an estimate is J e, where each motion updates the
/// Jacobian J. The covariance is J diag(e^2) J^T, plus that of the random errors of `odom_noise`.
class OdometryErrors {
 public:
  /// `share`: e forwards, to the left and turning, as fractions of the motion.
  explicit OdometryErrors(const Stg::Velocity& share);

  /// Starts anew at an estimated pose.
  void Begin(const Stg::Pose& estimate);
  /// Adds a step, after which the estimated pose is `estimate`.
  void Move(const Stg::Pose& estimate);
  Covariance OfPose(const Stg::PoseCovariance& random) const;
  /// Covariance of velocities forwards, to the left and turning.
  Covariance OfTwist(const Stg::Velocity& velocity, const Stg::PoseCovariance& random) const;

 private:
  std::array<double, 3> variances_;
  Planar3 jacobian_{};
  Stg::Pose before_;
};

}  // namespace stage_ros2_cpp

#endif
