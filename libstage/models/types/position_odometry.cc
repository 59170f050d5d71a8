// SPDX-License-Identifier: GPL-2.0-or-later
//
// Localization of position models: odometry, and velocities in other frames.

#include <cmath>

#include "geometry/trigonometry.hh"
#include "models/host.hh"
#include "models/position.hh"
#include "models/property_checks.hh"
#include "models/warn_about.hh"

namespace Stg {

namespace {

/// Rotates (x, y) by an angle in radians.
point_t Turned(double x, double y, double angle) {
  const SineCosine turn = SinCos(angle);
  return point_t(x * turn.cosine - y * turn.sine, x * turn.sine + y * turn.cosine);
}

}  // namespace

// NOLINTNEXTLINE(performance-unnecessary-value-param): Stage's interface
void ModelPosition::SetOdom(Pose odom) {
  if (!IsFinite(odom)) {
    WarnAbout(*this, "refused an estimate that is not finite");
    return;
  }
  est_pose = odom;
  driven_ = Pose();
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
  const point_t seen = Turned(global.x - est_origin.x, global.y - est_origin.y, -est_origin.a);
  est_pose = Pose(seen.x, seen.y, 0, normalize(global.a - est_origin.a));
  driven_ = Pose();
  StoreSensedPose();
}

void ModelPosition::StoreSensedPose() {
  sensed_pose_ = GetGlobalPose();
  sensed_at_ = world_base().SimTimeNow();
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
  if (!HasSubscribers()) return pose;
  return parent ? parent->LocalPoseOf(sensed_pose_, parent->GetSensedPose()) : sensed_pose_;
}

/// Adds this step's motion, scaled by the odometry errors, to the distance driven.
void ModelPosition::CountMotion() {
  if (localization_mode == LOCALIZATION_GPS) return;
  const Pose next = driven_ + MotionOfStep(GetEstimatedVelocity());
  if (IsFinite(next)) driven_ = next;
}

Velocity ModelPosition::GetActualVelocity() const {
  return stall || disabled || !HasSubscribers() ? Velocity() : velocity;
}

Velocity ModelPosition::GetEstimatedVelocity() const {
  const Velocity v = GetActualVelocity(), &error = integration_error;
  if (localization_mode == LOCALIZATION_GPS) return v;
  return Velocity(v.x * (1.0 + error.x), v.y * (1.0 + error.y), 0, v.a * (1.0 + error.a));
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
