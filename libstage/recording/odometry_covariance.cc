// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/odometry_covariance.hh"

#include "geometry/trigonometry.hh"

namespace Stg::recording {

namespace {

constexpr size_t kPlane[3] = {0, 1, 5};  // indices of x, y and yaw in the matrix

/// Expands a matrix of x, y and heading, plus `random`, to the six dimensions of ROS.
OdometryCovariance::Matrix ExpandToSpace(const double (&planar)[3][3],
                                         const PoseCovariance& random) {
  OdometryCovariance::Matrix whole{};
  for (const size_t axis : {2, 3, 4}) whole[7 * axis] = OdometryCovariance::kUnknown;
  for (size_t i = 0; i < 3; i++) {
    for (size_t k = 0; k < 3; k++)
      whole[6 * kPlane[i] + kPlane[k]] =
          planar[i][k] + random.At(static_cast<int>(i), static_cast<int>(k));
    whole[7 * kPlane[i]] += OdometryCovariance::kExact;
  }
  return whole;
}

}  // namespace

void OdometryCovariance::Move(const Pose& estimate) {
  if (has_moved_) {
    const double dx = estimate.x - before_.x, dy = estimate.y - before_.y;
    const SineCosine turn = SinCos(before_.a);
    const double ahead = turn.cosine * dx + turn.sine * dy;
    const double left = turn.cosine * dy - turn.sine * dx;
    // A heading error rotates later motion.
    for (size_t i = 0; i < 3; i++) {
      jacobian_[0][i] -= dy * jacobian_[2][i];
      jacobian_[1][i] += dx * jacobian_[2][i];
    }
    jacobian_[0][0] += turn.cosine * ahead;
    jacobian_[0][1] -= turn.sine * left;
    jacobian_[1][0] += turn.sine * ahead;
    jacobian_[1][1] += turn.cosine * left;
    jacobian_[2][2] += normalize(estimate.a - before_.a);
  }
  has_moved_ = true;
  before_ = estimate;
}

OdometryCovariance::Matrix OdometryCovariance::OfPose(const Velocity& error,
                                                      const PoseCovariance& random) const {
  const double variances[3] = {error.x * error.x, error.y * error.y, error.a * error.a};
  double planar[3][3] = {};
  for (size_t i = 0; i < 3; i++)
    for (size_t k = 0; k < 3; k++)
      for (size_t share = 0; share < 3; share++)
        planar[i][k] += jacobian_[i][share] * variances[share] * jacobian_[k][share];
  return ExpandToSpace(planar, random);
}

OdometryCovariance::Matrix OdometryCovariance::OfTwist(const Velocity& velocity,
                                                       const Velocity& error,
                                                       const PoseCovariance& random) {
  const double deviations[3] = {velocity.x * error.x, velocity.y * error.y, velocity.a * error.a};
  double planar[3][3] = {};
  for (size_t i = 0; i < 3; i++) planar[i][i] = deviations[i] * deviations[i];
  return ExpandToSpace(planar, random);
}

}  // namespace Stg::recording
