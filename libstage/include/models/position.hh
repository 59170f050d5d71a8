// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelPosition: a mobile robot base. Part of <stage.hh>.

#ifndef STAGE_MODELS_POSITION_HH
#define STAGE_MODELS_POSITION_HH

#include <memory>
#include <vector>

#include "models/model.hh"
#include "motion/drive.hh"
#include "motion/pose_covariance.hh"

namespace Stg {

class NoisyOdometry;
struct RegisteredDrive;

class ModelPosition : public Model {
 public:
  typedef enum { CONTROL_ACCELERATION, CONTROL_VELOCITY, CONTROL_POSITION } ControlMode;
  typedef enum { LOCALIZATION_GPS, LOCALIZATION_ODOM } LocalizationMode;
  /// DRIVE_CUSTOM: registered with RegisterDrive().
  typedef enum { DRIVE_DIFFERENTIAL, DRIVE_OMNI, DRIVE_CAR, DRIVE_CUSTOM } DriveMode;

  ModelPosition(World* world, Model* parent, const std::string& type);
  ~ModelPosition();

  // Commands take effect at the next update, clipped to the bounds. Commands with NaN are ignored
  // with a message; so are goals that are not finite. Infinite speeds are clipped; without bounds,
  // the robot stalls. While its power pack is empty, the robot stands and commands wait, unless the
  // world file says stops_when_empty 0.

  /// Metres per second forward and to the left (omni only), radians per second. For a car, `a` is
  /// the steering angle, or with car_command "turn" the turn rate.
  void SetSpeed(double x, double y, double a);
  void SetSpeed(Velocity vel);
  void SetXSpeed(double x);
  void SetYSpeed(double y);
  void SetZSpeed(double z);
  void SetTurnSpeed(double a);
  void Stop();
  /// Drives to a pose in the frame of est_pose.
  void GoTo(double x, double y, double a);
  void GoTo(Pose pose);
  /// Not available for cars.
  void SetAcceleration(double x, double y, double a);

  /// The velocity in force, in the body frame. A stall does not reset it.
  Velocity GetVelocity() const { return velocity; }
  /// Takes effect immediately and unclipped; overwritten at the next update.
  void SetVelocity(const Velocity& val);
  Velocity GetGlobalVelocity() const;
  /// Velocity of the last step's motion, in the body frame: zero if the robot was blocked, is
  /// disabled or has no subscribers.
  Velocity GetActualVelocity() const;
  /// Velocity as measured by localization: in gps mode GetActualVelocity(), in odom mode that of
  /// the wheels, which may slip, with odometry errors.
  Velocity GetEstimatedVelocity() const;
  /// Steering angle of a car in radians, positive to the left; the `steering` of a drive of one's
  /// own.
  double GetSteering() const { return steering_; }
  DriveMode GetDriveMode() const { return drive_mode; }
  /// Distance between the axles of a car in metres.
  double GetWheelbase() const { return wheelbase; }
  /// True if the third number of a car's command is a turn rate: car_command "turn".
  bool CommandsTurn() const { return commands_turn_; }
  LocalizationMode GetLocalizationMode() const { return localization_mode; }
  void SetGlobalVelocity(const Velocity& gvel);

  /// Relative odometry errors along x, y and about z; z is not used.
  Velocity GetOdomError() const { return integration_error; }
  /// Covariance of est_pose that comes from the random errors of odom_noise, in the frame of
  /// est_pose; zero without that property and in gps mode. GetOdomError() is not part of it.
  PoseCovariance GetOdomCovariance() const;
  /// That of GetEstimatedVelocity(), in the body frame, m/s and rad/s.
  PoseCovariance GetOdomVelocityCovariance() const;
  /// Sets the estimate of the present pose to `odom`. In gps mode the next step overwrites it.
  /// Refused with a message if not finite.
  void SetOdom(Pose odom);

  /// Restarts the estimate: in gps mode at the true pose, in odom mode at the true pose relative to
  /// the origin given in the world file.
  void StartLocalization();
  /// The robot's estimate of its pose. Refreshed before the moves of each step in which a model of
  /// its tree updates, so it belongs to the same instant as the newest readings and
  /// GetSensedPose(). In a callback that is one step before GetPose(). In gps mode it is the true
  /// global pose. In odom mode it is relative to est_origin and integrates the actual motion,
  /// scaled by the odometry errors.
  Pose est_pose;
  Pose est_pose_error;  ///< always zero
  Pose est_origin;      ///< origin of the odometry frame
  /// Simulated time of the step to which est_pose, GetSensedPose() and the newest readings of the
  /// robot's sensors belong; 0 before the first step.
  usec_t GetSensedTime() const { return sensed_at_; }
  Pose GetSensedPose() const override;
  Pose GetSensedLocalPose() const override;

  Bounds velocity_bounds[4];      ///< x, y, z, a
  Bounds acceleration_bounds[4];  ///< x, y, z, a

  class Waypoint {
   public:
    Pose pose;
    Color color;

    Waypoint(const Pose& p, Color c) : pose(p), color(c) {}
    Waypoint(meters_t x, meters_t y, meters_t z, radians_t a, Color c)
        : pose(x, y, z, a), color(c) {}
    Waypoint() {}
    /// The library has no window, so this draws nothing.
    void Draw() const {}
    void ExchangeState(StateExchange& exchange);
  };
  std::vector<Waypoint> waypoints;  ///< only displayed; no effect on motion

  void ExchangeState(StateExchange& exchange) override;

 protected:
  friend class World;
  friend class BatchControls;
  friend class CommandCheck;
  friend class RowBridge;
  friend class StepCostMeter;
  friend class WorldEngine;

  /// Moves by one step, or not if that would end in an obstacle.
  void Move() override { MoveTree(); }
  bool GetWantedMove(WantedMove* move) override;
  void EndMove(const Velocity& made) override;
  bool StaysStill() const override { return velocity.IsZero() || disabled; }
  void StoreSensedPose() override;
  void DropReadings() override;
  void Startup() override;
  void Shutdown() override;
  void Update() override;
  void Gather(internal::sensing::FanList*) override;
  void Load() override;
  void DrawInitialRandomNumbers() override { DrawErrors(); }

 private:
  void DrawErrors();
  void LoadModes();
  void LoadOdomError();
  void LoadDrive();
  void LoadLimits();
  void LoadOdomNoise();
  double PowerOf(const Velocity& vel) const;
  /// True if the robot stands because its power pack is empty.
  bool IsOutOfPower() const;
  /// The velocity that the drive and the bounds give for the present command; sets the power drawn.
  Velocity NextVelocity(double dt);
  DriveInput InputOfDrive(double dt) const;
  void ExchangeMotion(StateExchange& exchange);
  unsigned MotionState(bool hashing) const;
  void RestoreDefaults(unsigned state);
  void ExchangeOwnDrive(StateExchange& exchange);
  Pose EstimateNow() const;
  double SecondsSinceUpdate();
  /// Displacement of one step in the body frame.
  Pose MotionOfStep(const Velocity& v) const;
  /// Call once after each move. `made`: the body-frame velocity with which the robot moved in this
  /// step, equal to GetVelocity() if nothing hindered it, zero if it was blocked. Odometry and
  /// GetActualVelocity() follow.
  void NoteMotion(const Velocity& made);
  /// Velocity of the wheels in the last step: that of the robot, and a share of what hindered it.
  Velocity WheelVelocity() const;
  double StepSeconds() const;

  void ApplyVelocity(const Velocity& val);
  void CheckSubscription();
  /// Warns once if the robot got a command but has no subscriber, and so does not move.
  void WarnIfNotSubscribed();
  Velocity velocity;
  Pose goal;  // a velocity, an acceleration or a pose
  ControlMode control_mode;
  DriveMode drive_mode;
  LocalizationMode localization_mode;
  Velocity integration_error;
  bool errors_given_ = false;  // in the world file
  bool limits_acceleration_ = false, stops_when_empty_ = true, commands_turn_ = false;
  bool is_hindered_ = false;  // made_ differs from what velocity and stall tell
  double wheelbase;
  double steering_ = 0;
  double steering_limit_, steering_rate_;  // rad, rad/s; infinite: none
  double wheel_slip_ = 0;
  Velocity made_;  // of the last move, if is_hindered_
  const RegisteredDrive* drive_;
  std::unique_ptr<NoisyOdometry> noisy_odometry_;  // null without odom_noise
  usec_t last_update_;  // simulated time of the last update or subscription
  bool car_warned_;
  Pose driven_;       // odometry since est_pose was refreshed; not used with gps
  Pose sensed_pose_;  // global; see GetSensedPose()
  usec_t sensed_at_;
  bool check_subscription_ = false;  // the last command came while there was no subscriber
  bool warned_unsubscribed_ = false;
};

}  // namespace Stg

#endif
