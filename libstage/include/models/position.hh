// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelPosition: a body that drives. Part of <stage.hh>.

#ifndef STAGE_MODELS_POSITION_HH
#define STAGE_MODELS_POSITION_HH

#include <vector>

#include "models/model.hh"

namespace Stg {

class MovePhase;
class Placement;

class ModelPosition : public Model {
 public:
  typedef enum { CONTROL_ACCELERATION, CONTROL_VELOCITY, CONTROL_POSITION } ControlMode;
  typedef enum { LOCALIZATION_GPS, LOCALIZATION_ODOM } LocalizationMode;
  typedef enum { DRIVE_DIFFERENTIAL, DRIVE_OMNI, DRIVE_CAR } DriveMode;

  ModelPosition(World* world, Model* parent, const std::string& type);
  ~ModelPosition();

  // Commands take effect at the next update, clipped to the bounds. One with a component that is
  // not a number is ignored, with a message; so is a goal that is not finite. Infinite speeds are
  // clipped like others. Where there is nothing to clip them, the robot stalls.

  /// Metres per second forwards and to the left (omni only), radians per second; for a car, `a` is
  /// the steering angle.
  void SetSpeed(double x, double y, double a);
  void SetSpeed(Velocity vel);
  void SetXSpeed(double x);
  void SetYSpeed(double y);
  void SetZSpeed(double z);
  void SetTurnSpeed(double a);
  void Stop();
  /// Drives towards a pose in the frame of est_pose.
  void GoTo(double x, double y, double a);
  void GoTo(Pose pose);
  /// Not for cars.
  void SetAcceleration(double x, double y, double a);

  /// In force now, in the body frame. Not reset by a stall.
  Velocity GetVelocity() const { return velocity; }
  /// At once and unclipped; overwritten at the next update.
  void SetVelocity(const Velocity& val);
  Velocity GetGlobalVelocity() const;
  /// The velocity of the last step's motion, in the body frame: zero if the robot was blocked, is
  /// disabled or has no subscribers.
  Velocity GetActualVelocity() const;
  /// The velocity that localization measures: GetActualVelocity() with the errors of the odometry,
  /// or without any in gps mode.
  Velocity GetEstimatedVelocity() const;
  LocalizationMode GetLocalizationMode() const { return localization_mode; }
  void SetGlobalVelocity(const Velocity& gvel);

  /// Relative errors of the odometry along x, y and about z; z is not used.
  Velocity GetOdomError() const { return integration_error; }
  /// Makes the estimate read `odom` here. In gps mode the next step overwrites it. A pose that is
  /// not finite is refused with a message.
  void SetOdom(Pose odom);

  /// The estimate starts anew: in gps mode as the true pose, in odom mode as that pose seen from
  /// the origin that the world file gives.
  void StartLocalization();
  /// Where the robot believes that it is. Refreshed in each step in which the robot, or a model of
  /// its tree, updates, before the moves of the step: it belongs to the same instant as the newest
  /// readings of the robot's sensors, and to GetSensedPose(). In a callback that is one step before
  /// GetPose(). In gps mode it is the true pose in world coordinates. In odom mode it is relative
  /// to est_origin, and goes on by the motion that was made, times the errors of the odometry.
  Pose est_pose;
  Pose est_pose_error;  ///< always zero
  Pose est_origin;      ///< the origin of the odometry's frame
  /// The simulated time of the step that est_pose, GetSensedPose() and the newest readings of the
  /// robot's sensors belong to; 0: that before the first step.
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
    /// Of a library without a window: draws nothing.
    void Draw() const {}
    void ExchangeState(StateExchange& exchange);
  };
  std::vector<Waypoint> waypoints;  ///< to look at; no effect on motion

  void ExchangeState(StateExchange& exchange) override;

 protected:
  friend class World;
  friend class MovePhase;
  friend class WorldEngine;

  /// One step of motion; refused as a whole if it would end in an obstacle.
  void Move() override;
  void NoteSensed() override;
  void DropReadings() override;
  void Startup() override;
  void Shutdown() override;
  void Update() override;
  void Gather(internal::sensing::FanList*) override;
  void Load() override;
  void DrawAtBeginning() override { DrawErrors(); }

 private:
  void DrawErrors();
  void LoadModes();
  void LoadOdomError();
  double PowerOf(const Velocity& vel) const;
  Velocity WantedVelocity(double dt) const;
  Velocity VelocityMode() const;
  Velocity AccelerationMode(double dt) const;
  Velocity PositionMode() const;
  Pose EstimateNow() const;
  double SecondsSinceUpdate();
  /// The displacement of one step, in the body frame.
  Pose MotionOfStep(const Velocity& v) const;
  void CountMotion();

  void TakeVelocity(const Velocity& val);
  void NoteCommand();
  /// Warns, once, if it has been given a command and has no subscriber: then it does not move.
  void TellIfUnheard();
  /// Move() has nothing to do.
  bool StaysStill() const { return velocity.IsZero() || disabled; }

  // The parts of Move(), for several threads at once: each touches this model's tree alone.

  /// Steps to where the velocity leads and plans the bodies there. False if the robot stays.
  bool BeginMove(Placement* placement);
  /// Steps back from a collision. True if there is none: then the plan is to be carried out.
  bool EndMove(const Placement& placement);

  Velocity velocity;
  Pose pose_before_move_;
  Pose goal;  // a velocity, an acceleration or a pose
  ControlMode control_mode;
  DriveMode drive_mode;
  LocalizationMode localization_mode;
  Velocity integration_error;
  bool errors_given_ = false;  // by the world file
  double wheelbase;
  usec_t last_update_;  // simulated time of the last update; that of the subscription at first
  bool car_warned_;
  Pose driven_;       // since est_pose was refreshed, as odometry has it; of no use to gps
  Pose sensed_pose_;  // global; see GetSensedPose()
  usec_t sensed_at_;
  bool maybe_unheard_ = false;  // the last command came while it had no subscriber
  bool told_unheard_ = false;
};

}  // namespace Stg

#endif
