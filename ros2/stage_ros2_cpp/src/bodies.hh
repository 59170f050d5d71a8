// SPDX-License-Identifier: GPL-2.0-or-later
//
// Poses, velocities and covariances of robots as messages have them.

#ifndef STAGE_ROS2_CPP_BODIES_HH
#define STAGE_ROS2_CPP_BODIES_HH

#include <vector>

#include "covariance.hh"
#include "simulation.hh"

namespace stage_ros2_cpp {

/// A step senses first and then moves. All values belong to the beginning of the last step in which
/// the robot or one of its sensors updated, like the readings with the same stamp. Arguments are
/// numbers of robots that exist.
class Bodies {
 public:
  explicit Bodies(const Simulation& simulation);

  /// Call after loading and after a reset.
  void Begin();
  /// Call after each step.
  void Step();
  /// Call when a client has moved robots: true poses are those of now until the next step.
  void MarkMoved() { moved_ = true; }

  bool Exists(size_t robot) const { return simulation_.Robot(robot) != nullptr; }
  /// Time stamp of poses and estimates, microseconds; -1: the robot is gone.
  int64_t Time(size_t robot) const;
  Stg::Pose Estimate(size_t robot) const { return simulation_.Robot(robot)->est_pose; }
  Stg::Pose Truth(size_t robot) const;
  /// Forwards, to the left and turning.
  Stg::Velocity EstimatedVelocity(size_t robot) const;
  Stg::Velocity ActualVelocity(size_t robot) const;
  Covariance OfPose(size_t robot) const;
  Covariance OfTwist(size_t robot) const;

 private:
  const Simulation& simulation_;
  std::vector<OdometryErrors> errors_;
  bool moved_ = false;
};

}  // namespace stage_ros2_cpp

#endif
