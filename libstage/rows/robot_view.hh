// SPDX-License-Identifier: GPL-2.0-or-later
//
// Reads the state of a robot from a row. The functions are named after those of ModelPosition and
// return the same values.

#ifndef STAGE_ROWS_ROBOT_VIEW_HH
#define STAGE_ROWS_ROBOT_VIEW_HH

#include <cstddef>

#include "models/position.hh"
#include "motion/odometry.hh"
#include "rows/rows.hh"

namespace Stg::rows {

class RobotView {
 public:
  /// `mover` is a robot.
  RobotView(const Rows& rows, size_t world, size_t mover)
      : rows_(rows),
        c_(rows.columns),
        mover_(rows.scene().movers[mover]),
        world_(world),
        index_(world * rows.scene().movers.size() + mover) {}

  Pose GetGlobalPose() const { return PoseOf(c_.pose[index_], mover_.z); }
  Velocity GetVelocity() const { return VelocityOf(c_.velocity[index_]); }
  Velocity GetActualVelocity() const;
  Velocity GetEstimatedVelocity() const;
  Pose GetEstimate() const;  ///< ModelPosition::est_pose
  PoseCovariance GetOdomCovariance() const;
  PoseCovariance GetOdomVelocityCovariance() const;
  Pose GetSensedPose() const;
  usec_t GetSensedTime() const;
  bool Stalled() const { return c_.stalled[index_]; }
  /// Joules in its power pack; NaN: it has none.
  double GetStored() const;

 private:
  bool IsRunning() const { return mover_.runs; }
  bool HasNoisyOdometry() const {
    return mover_.has_noisy_odometry && mover_.has_odometry &&
           !c_.noisy_odometry[index_].noise().IsZero();
  }
  double WheelSlip() const {
    return rows_.PropertiesOf(world_, index_ % rows_.scene().movers.size()).wheel_slip;
  }
  Velocity WheelVelocity() const;

  const Rows& rows_;
  const Columns& c_;
  const Mover& mover_;
  const size_t world_, index_;
};

}  // namespace Stg::rows

#endif
