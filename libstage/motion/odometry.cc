// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/odometry.hh"

#include <cmath>

#include "geometry/trigonometry.hh"

namespace Stg {

namespace motion {

PoseCovariance Compose(const Pose& before, const PoseCovariance& of_before, const Pose& motion,
                       const PoseCovariance& of_motion) {
  const SineCosine turn = SinCos(before.a);
  const double s = turn.sine, c = turn.cosine;
  const PoseCovariance &p = of_before, &q = of_motion;
  // The motion in the outer frame. An error of the heading shifts its end by (-dy, dx) per radian.
  const double dx = c * motion.x - s * motion.y, dy = s * motion.x + c * motion.y;
  PoseCovariance sum;
  sum.xx = p.xx - 2 * dy * p.xa + dy * dy * p.aa + c * c * q.xx - 2 * c * s * q.xy + s * s * q.yy;
  sum.yy = p.yy + 2 * dx * p.ya + dx * dx * p.aa + s * s * q.xx + 2 * c * s * q.xy + c * c * q.yy;
  sum.xy = p.xy + dx * p.xa - dy * p.ya - dx * dy * p.aa + c * s * (q.xx - q.yy) +
           (c * c - s * s) * q.xy;
  sum.xa = p.xa - dy * p.aa + c * q.xa - s * q.ya;
  sum.ya = p.ya + dx * p.aa + s * q.xa + c * q.ya;
  sum.aa = p.aa + q.aa;
  return sum;
}

}  // namespace motion

NoisyOdometry::Spread NoisyOdometry::SpreadOf(const Velocity& twist, double dt) const {
  const double speed = std::sqrt(twist.x * twist.x + twist.y * twist.y);
  const double way = speed * dt, angle = std::fabs(twist.a) * dt;
  const auto deviation = [&](double per_metre, double per_radian) {
    return std::sqrt(per_metre * per_metre * way + per_radian * per_radian * angle);
  };
  const bool moves = speed > 0;
  return {deviation(noise_.translation_per_metre, noise_.translation_per_radian),
          deviation(noise_.heading_per_metre, noise_.heading_per_radian),
          moves ? twist.x / speed : 1.0, moves ? twist.y / speed : 0.0};
}

PoseCovariance NoisyOdometry::CovarianceOf(const Spread& spread) {
  const double variance = spread.translation * spread.translation;
  PoseCovariance covariance;
  covariance.xx = variance * spread.x * spread.x;
  covariance.xy = variance * spread.x * spread.y;
  covariance.yy = variance * spread.y * spread.y;
  covariance.aa = spread.heading * spread.heading;
  return covariance;
}

PoseCovariance NoisyOdometry::CovarianceOf(const Velocity& twist, double dt) const {
  if (!(dt > 0)) return PoseCovariance();
  Spread spread = SpreadOf(twist, dt);
  spread.translation /= dt;
  spread.heading /= dt;
  return CovarianceOf(spread);
}

Velocity NoisyOdometry::Measure(const Velocity& twist, double dt, const double (&normal)[2],
                                const Pose& driven) {
  const Spread spread = SpreadOf(twist, dt);
  const double translation = spread.translation * normal[0], heading = spread.heading * normal[1];
  twist_error_ =
      Velocity(translation * spread.x / dt, translation * spread.y / dt, 0, heading / dt);
  const Velocity measured(twist.x + twist_error_.x, twist.y + twist_error_.y, twist.z,
                          twist.a + twist_error_.a);
  driven_covariance_ = motion::Compose(driven, driven_covariance_,
                                       Pose(measured.x * dt, measured.y * dt, 0, measured.a * dt),
                                       CovarianceOf(spread));
  return measured;
}

void NoisyOdometry::Refresh(const Pose& estimate, const Pose& driven) {
  covariance_ = motion::Compose(estimate, covariance_, driven, driven_covariance_);
  driven_covariance_ = PoseCovariance();
}

void NoisyOdometry::Restart() {
  covariance_ = driven_covariance_ = PoseCovariance();
  twist_error_ = Velocity();
}

}  // namespace Stg
