// SPDX-License-Identifier: GPL-2.0-or-later

#include "rows/robot_view.hh"

#include <algorithm>
#include <limits>

#include "models/power_pack.hh"

namespace Stg::rows {

Velocity RobotView::GetActualVelocity() const {
  if (!IsRunning()) return Velocity();
  if (!c_.hindered.empty() && c_.hindered[index_]) return VelocityOf(c_.made[index_]);
  return Stalled() ? Velocity() : GetVelocity();
}

Velocity RobotView::WheelVelocity() const {
  const Velocity made = GetActualVelocity();
  return IsRunning() ? motion::WheelVelocity(made, GetVelocity(), WheelSlip()) : made;
}

Velocity RobotView::GetEstimatedVelocity() const {
  if (!mover_.has_odometry) return GetActualVelocity();
  const Velocity wheels = WheelVelocity();
  Velocity v = motion::WithOdomError(wheels, VelocityOf(c_.error[index_]));
  if (!HasNoisyOdometry() || wheels.IsZero()) return v;
  const Velocity& error = c_.noisy_odometry[index_].twist_error();
  return Velocity(v.x + error.x, v.y + error.y, 0, v.a + error.a);
}

Pose RobotView::GetEstimate() const {
  if (mover_.has_odometry) return PoseOf(c_.estimate[index_], mover_.robot->est_pose.z);
  return IsRunning() ? GetSensedPose() : mover_.robot->est_pose;
}

PoseCovariance RobotView::GetOdomCovariance() const {
  if (!HasNoisyOdometry()) return PoseCovariance();
  return c_.noisy_odometry[index_].covariance();
}

PoseCovariance RobotView::GetOdomVelocityCovariance() const {
  if (!HasNoisyOdometry()) return PoseCovariance();
  const double seconds = static_cast<double>(rows_.scene().step) / 1e6;
  return c_.noisy_odometry[index_].CovarianceOf(
      motion::WithOdomError(WheelVelocity(), VelocityOf(c_.error[index_])), seconds);
}

Pose RobotView::GetSensedPose() const {
  return IsRunning() ? PoseOf(c_.sensed[index_], mover_.z) : GetGlobalPose();
}

usec_t RobotView::GetSensedTime() const {
  return IsRunning() ? rows_.SensedAt(world_, index_ % rows_.scene().movers.size())
                     : mover_.robot->GetSensedTime();
}

double RobotView::GetStored() const {
  const PowerPack* const pack = mover_.robot->FindPowerPack();
  const std::vector<Pack>& packs = rows_.scene().packs;
  for (size_t k = 0; k < packs.size(); k++)
    if (packs[k].pack == pack) return c_.stored[world_ * packs.size() + k];
  return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace Stg::rows
