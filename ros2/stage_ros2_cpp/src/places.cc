// SPDX-License-Identifier: GPL-2.0-or-later

#include "places.hh"

#include <cmath>

namespace stage_ros2_cpp {

using Stg::Pose;

Transform Planar(const Pose& pose) {
  return {pose.x, pose.y, 0, 0, 0, std::sin(pose.a / 2), std::cos(pose.a / 2)};
}

Transform Spatial(const Pose& pose, double pan, double tilt) {
  const double half = (pose.a + pan) / 2, down = tilt / 2;
  return {pose.x,
          pose.y,
          pose.z,
          -std::sin(half) * std::sin(down),
          std::cos(half) * std::sin(down),
          std::sin(half) * std::cos(down),
          std::cos(half) * std::cos(down)};
}

Pose Composed(const Pose& place, const Pose& inner) {
  const double c = std::cos(place.a), s = std::sin(place.a);
  return Pose(place.x + inner.x * c - inner.y * s, place.y + inner.x * s + inner.y * c,
              place.z + inner.z, place.a + inner.a);
}

Pose Relative(const Pose& pose, const Pose& frame) {
  const double x = pose.x - frame.x, y = pose.y - frame.y;
  const double c = std::cos(frame.a), s = std::sin(frame.a);
  return Pose(c * x + s * y, c * y - s * x, pose.z - frame.z, pose.a - frame.a);
}

double Normalized(double angle) {
  double rest = std::fmod(angle + M_PI, 2 * M_PI);
  if (rest < 0) rest += 2 * M_PI;
  return rest - M_PI;
}

Pose FrameBetween(const Pose& outer, const Pose& inner) {
  // Exactly 0 if the headings are equal.
  const double a = outer.a == inner.a ? 0.0 : Normalized(outer.a - inner.a);
  const double c = std::cos(a), s = std::sin(a);
  return Pose(outer.x - c * inner.x + s * inner.y, outer.y - s * inner.x - c * inner.y, 0, a);
}

double HeadingOf(double x, double y, double z, double w) {
  return std::atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z);
}

Pose PoseInTree(const Stg::Model& model, bool sensed) {
  Pose pose;
  const Stg::Model* root = &model;
  for (; root->Parent(); root = root->Parent())
    pose = (sensed ? root->GetSensedLocalPose() : root->GetPose()) + pose;
  pose.z = sensed ? model.GetSensedPose().z - root->GetSensedPose().z
                  : model.GetGlobalPose().z - root->GetGlobalPose().z;
  return pose;
}

}  // namespace stage_ros2_cpp
