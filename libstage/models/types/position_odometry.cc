// SPDX-License-Identifier: GPL-2.0-or-later
//
// Localization of position models: what wheels measure, the estimate that follows, and velocities
// in other frames.

#include <cmath>

#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "models/host.hh"
#include "models/localization.hh"
#include "models/noise.hh"
#include "models/position.hh"
#include "models/property_checks.hh"
#include "models/warn_about.hh"
#include "motion/odometry.hh"
#include "random/random.hh"

namespace Stg {

namespace {

/// Rotates (x, y) by an angle in radians.
point_t Turned(double x, double y, double angle) { return Rotated(point_t(x, y), SinCos(angle)); }

}  // namespace

// NOLINTNEXTLINE(performance-unnecessary-value-param): Stage's interface
void ModelPosition::SetOdom(Pose odom) {
  if (!IsFinite(odom)) {
    WarnAbout(*this, "refused an estimate that is not finite");
    return;
  }
  est_pose = odom;
  driven_ = Pose();
  if (noisy_odometry_) noisy_odometry_->Restart();
  // Computes the frame in which the present pose reads `odom`.
  const Pose g = GetGlobalPose();
  const double da = normalize(g.a - odom.a);
  const point_t offset = Turned(odom.x, odom.y, da);
  est_origin = Pose(g.x - offset.x, g.y - offset.y, est_origin.z, da);
}

void ModelPosition::StartLocalization() {
  est_origin = GetGlobalPose();
  const Pose global = est_origin;
  est_origin.Load(wf, wf_entity, "localization_origin");
  est_pose = EstimateIn(est_origin, global);
  driven_ = Pose();
  if (noisy_odometry_) noisy_odometry_->Restart();
  StoreSensedPose();
}

void ModelPosition::StoreSensedPose() {
  sensed_pose_ = GetGlobalPose();
  sensed_at_ = world_base().SimTimeNow();
  if (noisy_odometry_) noisy_odometry_->Refresh(est_pose, driven_);
  est_pose = EstimateNow();
  driven_ = Pose();
}

/// Estimate of the present pose.
Pose ModelPosition::EstimateNow() const {
  if (localization_mode == LOCALIZATION_GPS) return sensed_pose_;
  const Pose next = est_pose + driven_;
  return IsFinite(next) ? next : est_pose;  // a client may have set a value that is not finite
}

void ModelPosition::DropReadings() {
  Model::DropReadings();
  sensed_pose_ = GetGlobalPose();
  sensed_at_ = 0;
}

// Robots without subscribers neither record poses nor move by themselves.

Pose ModelPosition::GetSensedPose() const {
  return HasSubscribers() ? sensed_pose_ : Model::GetSensedPose();
}

Pose ModelPosition::GetSensedLocalPose() const {
  if (!HasSubscribers()) return Model::GetSensedLocalPose();
  return parent ? parent->LocalPoseOf(sensed_pose_, parent->GetSensedPose()) : sensed_pose_;
}

/// Adds what the wheels measured in this step to the distance driven.
void ModelPosition::NoteMotion(const Velocity& made) {
  is_hindered_ = !(made == velocity) && !(stall && made.IsZero());
  if (is_hindered_) made_ = made;
  if (localization_mode == LOCALIZATION_GPS) return;
  const Velocity wheels = WheelVelocity();
  if (wheels.IsZero()) return;
  Velocity measured = motion::WithOdomError(wheels, integration_error);
  if (noisy_odometry_) {
    RandomStream& stream = this->random();
    const double normal[2] = {NormalError(&stream), NormalError(&stream)};
    measured = noisy_odometry_->Measure(measured, StepSeconds(), normal, driven_);
  }
  const Pose next = driven_ + MotionOfStep(measured);
  if (IsFinite(next)) driven_ = next;
}

Velocity ModelPosition::GetActualVelocity() const {
  if (disabled || !HasSubscribers()) return Velocity();
  if (is_hindered_) return made_;
  return stall ? Velocity() : velocity;
}

Velocity ModelPosition::WheelVelocity() const {
  const Velocity made = GetActualVelocity();
  if (disabled || !HasSubscribers()) return made;
  return motion::WheelVelocity(made, velocity, wheel_slip_);
}

Velocity ModelPosition::GetEstimatedVelocity() const {
  if (localization_mode == LOCALIZATION_GPS) return GetActualVelocity();
  const Velocity wheels = WheelVelocity();
  Velocity v = motion::WithOdomError(wheels, integration_error);
  if (!noisy_odometry_ || wheels.IsZero()) return v;
  const Velocity& error = noisy_odometry_->twist_error();
  return Velocity(v.x + error.x, v.y + error.y, 0, v.a + error.a);
}

PoseCovariance ModelPosition::GetOdomCovariance() const {
  if (!noisy_odometry_ || localization_mode == LOCALIZATION_GPS) return PoseCovariance();
  return noisy_odometry_->covariance();
}

PoseCovariance ModelPosition::GetOdomVelocityCovariance() const {
  if (!noisy_odometry_ || localization_mode == LOCALIZATION_GPS) return PoseCovariance();
  return noisy_odometry_->CovarianceOf(motion::WithOdomError(WheelVelocity(), integration_error),
                                       StepSeconds());
}

Velocity ModelPosition::GetGlobalVelocity() const {
  const point_t v = Turned(velocity.x, velocity.y, GetGlobalPose().a);
  return Velocity(v.x, v.y, 0, velocity.a);
}

void ModelPosition::SetGlobalVelocity(const Velocity& gvel) {
  const point_t v = Turned(gvel.x, gvel.y, -GetGlobalPose().a);
  SetVelocity(Velocity(v.x, v.y, 0, gvel.a));
}

}  // namespace Stg
