// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelActuator: a joint that slides along a line or turns about z, and takes its children along.
// Part of <stage.hh>.

#ifndef STAGE_MODELS_ACTUATOR_HH
#define STAGE_MODELS_ACTUATOR_HH

#include "models/model.hh"

namespace Stg {

/// Positions are displacements from the pose of the world file: metres if it is linear, radians if
/// it is rotational (they count whole turns).
class ModelActuator : public Model {
 public:
  typedef enum { CONTROL_VELOCITY, CONTROL_POSITION } ControlMode;
  typedef enum { TYPE_LINEAR, TYPE_ROTATIONAL } ActuatorType;

  ModelActuator(World* world, Model* parent, const std::string& type);
  ~ModelActuator();

  // Commands take effect at the next update, within the limits. One that is not a number is
  // ignored, with a message.

  /// Per second.
  void SetSpeed(double speed);
  void GoTo(double pose);

  /// The goal, be it a speed or a position.
  double GetSpeed() const { return goal_; }
  double GetPosition() const;
  /// In force now, per second.
  double GetVelocity() const { return velocity_; }
  double GetMaxPosition() const { return max_position_; }
  double GetMinPosition() const { return min_position_; }
  ActuatorType GetType() const { return type_of_joint_; }
  /// Of a linear one, in its own frame; a unit vector.
  point3_t GetAxis() const { return axis_; }
  Pose GetSensedLocalPose() const override { return HasSubscribers() ? sensed_pose_ : pose; }

  using Model::Load;
  void Load() override;
  void Save() override;
  void ExchangeState(StateExchange& exchange) override;

 protected:
  void Startup() override;
  void Shutdown() override;
  void Update() override;
  void Gather(internal::sensing::FanList*) override;
  /// One step; refused as a whole if it would end in an obstacle.
  void Move() override;
  void NoteSensed() override { sensed_pose_ = pose; }
  void DropReadings() override;

 private:
  friend class MovePhase;
  /// Move() has nothing to do.
  bool StaysStill() const { return velocity_ == 0 || disabled; }

  void LoadJoint();
  void LoadAxis();
  Pose Displacement(double distance) const;
  double StepLength(double position) const;
  void SetGoal(ControlMode mode, double goal);

  ControlMode control_mode_;
  ActuatorType type_of_joint_;
  point3_t axis_;
  double goal_, velocity_;
  double max_speed_, max_position_, min_position_;
  Pose reference_;      // where the position is 0, in the parent's frame
  bool has_reference_;  // else it is where the actuator starts
  double turned_;       // near the position of a rotational one: tells the number of turns
  Pose sensed_pose_;    // in the parent's frame
};

}  // namespace Stg

#endif
