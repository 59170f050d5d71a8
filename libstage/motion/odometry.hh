// SPDX-License-Identifier: GPL-2.0-or-later
//
// Random errors of wheel odometry, and the covariance of the estimate that results.

#ifndef STAGE_MOTION_ODOMETRY_HH
#define STAGE_MOTION_ODOMETRY_HH

#include "geometry/geometry.hh"
#include "geometry/trigonometry.hh"
#include "motion/pose_covariance.hh"
#include "motion/vector.hh"

namespace Stg {

namespace motion {

/// Covariance of the pose `before + motion`, where the errors of both are independent. To first
/// order, with the Jacobians of the composition of poses: R. Smith, M. Self, P. Cheeseman,
/// "Estimating Uncertain Spatial Relationships in Robotics", 1990, section 2.3.
PoseCovariance Compose(const Pose& before, const PoseCovariance& of_before, const Pose& motion,
                       const PoseCovariance& of_motion);

/// Velocity of the wheels of a robot that moves at `made` while its command is `command`. `slip`:
/// the share of what hindered the robot that the wheels turned through.
inline Velocity WheelVelocity(const Velocity& made, const Velocity& command, double slip) {
  if (slip == 0) return made;
  return Velocity(made.x + slip * (command.x - made.x), made.y + slip * (command.y - made.y),
                  made.z, made.a + slip * (command.a - made.a));
}

/// The velocity that leads from one pose to another in `seconds`, in the frame of the first.
inline Velocity VelocityBetween(const Pose& before, const Pose& now, double seconds) {
  if (now == before) return Velocity();
  const SineCosine turn = SinCos(-before.a);
  const Vector moved = Rotate({now.x - before.x, now.y - before.y}, turn.sine, turn.cosine);
  return Velocity(moved.x / seconds, moved.y / seconds, (now.z - before.z) / seconds,
                  normalize(now.a - before.a) / seconds);
}

/// A velocity as odometry with constant relative errors measures it.
inline Velocity WithOdomError(const Velocity& v, const Velocity& error) {
  return Velocity(v.x * (1.0 + error.x), v.y * (1.0 + error.y), 0, v.a * (1.0 + error.a));
}

}  // namespace motion

/// Odometry of one robot with random errors that are independent from step to step. Variances grow
/// with the way and with the angle turned: R. Siegwart, I. Nourbakhsh, D. Scaramuzza, "Introduction
/// to Autonomous Mobile Robots", 2nd edition, 2011, section 5.2.4. They do not depend on the length
/// of a step.
class NoisyOdometry {
 public:
  /// Standard deviations after 1 m of way and after a turn of 1 rad. The translation's error is in
  /// the direction of motion, or forwards if the robot turns on the spot.
  struct Noise {
    double translation_per_metre = 0, translation_per_radian = 0;  // m
    double heading_per_radian = 0, heading_per_metre = 0;          // rad
    /// The number at this place, 0 to 3, of the property odom_noise.
    double* Find(size_t element) {
      double* const places[] = {&translation_per_metre, &translation_per_radian,
                                &heading_per_radian, &heading_per_metre};
      return places[element];
    }
    bool IsZero() const {
      return translation_per_metre == 0 && translation_per_radian == 0 && heading_per_radian == 0 &&
             heading_per_metre == 0;
    }
  };

  NoisyOdometry() = default;
  explicit NoisyOdometry(const Noise& noise) : noise_(noise) {}

  /// Adds the errors of a step of `dt` seconds to the velocity that the wheels had, and its
  /// covariance to that of the way driven. `normal`: two independent numbers with mean 0 and
  /// variance 1, for translation and heading. `driven`: motion since the last Refresh().
  Velocity Measure(const Velocity& twist, double dt, const double (&normal)[2], const Pose& driven);
  /// Adds the way driven to the covariance of the estimate, which `estimate` was before.
  void Refresh(const Pose& estimate, const Pose& driven);
  /// The estimate is exact from now on.
  void Restart();

  const Noise& noise() const { return noise_; }
  /// Covariance of the estimate at the last Refresh().
  const PoseCovariance& covariance() const { return covariance_; }
  /// Covariance of a measured velocity.
  PoseCovariance CovarianceOf(const Velocity& twist, double dt) const;
  /// The errors of the last measured velocity.
  const Velocity& twist_error() const { return twist_error_; }

  template <class Exchange>
  void ExchangeState(Exchange& exchange) {
    exchange(noise_.translation_per_metre, noise_.translation_per_radian, noise_.heading_per_radian,
             noise_.heading_per_metre, covariance_, driven_covariance_, twist_error_);
  }

 private:
  /// The random part of a step's motion: standard deviations, and the direction of the translation.
  struct Spread {
    double translation, heading, x, y;
  };
  Spread SpreadOf(const Velocity& twist, double dt) const;
  static PoseCovariance CovarianceOf(const Spread& spread);

  Noise noise_;
  PoseCovariance covariance_, driven_covariance_;
  Velocity twist_error_;
};

}  // namespace Stg

#endif
