// SPDX-License-Identifier: GPL-2.0-or-later
//
// Poses and transforms.

#ifndef STAGE_ROS2_CPP_PLACES_HH
#define STAGE_ROS2_CPP_PLACES_HH

#include <stage.hh>

namespace stage_ros2_cpp {

/// Position in metres, and a rotation as quaternion.
struct Transform {
  double x, y, z;
  double qx, qy, qz, qw;
};

/// The transform of a pose on the floor: z does not count.
Transform Planar(const Stg::Pose& pose);
/// The transform of a pose that is turned by `pan`, then tilted down by `tilt` (radians).
Transform Spatial(const Stg::Pose& pose, double pan = 0, double tilt = 0);
/// Transforms the pose `inner` from the frame `place` to the parent frame of `place`.
Stg::Pose Composed(const Stg::Pose& place, const Stg::Pose& inner);
/// A pose in the frame of another one; both are in the same frame.
Stg::Pose Relative(const Stg::Pose& pose, const Stg::Pose& frame);
/// The frame (x, y, heading in the world) in which the world pose `outer` is the pose `inner`.
Stg::Pose FrameBetween(const Stg::Pose& outer, const Stg::Pose& inner);
/// The angle plus a multiple of 2 pi that lies in [-pi, pi).
double Normalized(double angle);
/// The rotation about z of a quaternion, radians; 0 if all components are 0.
double HeadingOf(double x, double y, double z, double w);
/// Pose of a model in the frame of the root of its tree, composed of local poses: moving the root
/// changes no bit of it. `sensed`: at the time of the tree's newest readings.
Stg::Pose PoseInTree(const Stg::Model& model, bool sensed);

}  // namespace stage_ros2_cpp

#endif
