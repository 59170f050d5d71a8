// SPDX-License-Identifier: GPL-2.0-or-later

#include "covariance.hh"

#include <cmath>

#include "places.hh"

namespace stage_ros2_cpp {

namespace {

constexpr size_t kPlane[3] = {0, 1, 5};  // indices of x, y and yaw

void Add(const Stg::PoseCovariance& random, Planar3* to) {
  for (int i = 0; i < 3; i++)
    for (int k = 0; k < 3; k++) (*to)[i][k] += random.At(i, k);
}

}  // namespace

Covariance InSpace(const Planar3& planar) {
  Covariance whole{};
  for (size_t i = 0; i < 3; i++)
    for (size_t k = 0; k < 3; k++) whole[6 * kPlane[i] + kPlane[k]] = planar[i][k];
  for (const size_t axis : kPlane) whole[7 * axis] += kExact;
  for (const size_t axis : {2, 3, 4}) whole[7 * axis] = kUnknown;
  return whole;
}

OdometryErrors::OdometryErrors(const Stg::Velocity& share)
    : variances_{share.x * share.x, share.y * share.y, share.a * share.a} {}

void OdometryErrors::Begin(const Stg::Pose& estimate) {
  jacobian_ = {};
  before_ = estimate;
}

void OdometryErrors::Move(const Stg::Pose& estimate) {
  const double dx = estimate.x - before_.x, dy = estimate.y - before_.y;
  const double c = std::cos(before_.a), s = std::sin(before_.a);
  const double ahead = c * dx + s * dy, left = c * dy - s * dx;
  Planar3& j = jacobian_;
  // An error of the heading rotates the motion.
  for (size_t i = 0; i < 3; i++) {
    j[0][i] -= dy * j[2][i];
    j[1][i] += dx * j[2][i];
  }
  j[0][0] += c * ahead;
  j[0][1] -= s * left;
  j[1][0] += s * ahead;
  j[1][1] += c * left;
  j[2][2] += Normalized(estimate.a - before_.a);
  before_ = estimate;
}

Covariance OdometryErrors::OfPose(const Stg::PoseCovariance& random) const {
  Planar3 planar{};
  for (size_t i = 0; i < 3; i++)
    for (size_t k = 0; k < 3; k++)
      for (size_t n = 0; n < 3; n++)
        planar[i][k] += jacobian_[i][n] * variances_[n] * jacobian_[k][n];
  Planar3 symmetric{};
  for (size_t i = 0; i < 3; i++)
    for (size_t k = 0; k < 3; k++) symmetric[i][k] = (planar[i][k] + planar[k][i]) / 2;
  Add(random, &symmetric);
  return InSpace(symmetric);
}

Covariance OdometryErrors::OfTwist(const Stg::Velocity& velocity,
                                   const Stg::PoseCovariance& random) const {
  const double speeds[3] = {velocity.x, velocity.y, velocity.a};
  Planar3 planar{};
  for (size_t i = 0; i < 3; i++) planar[i][i] = variances_[i] * (speeds[i] * speeds[i]);
  Add(random, &planar);
  return InSpace(planar);
}

}  // namespace stage_ros2_cpp
