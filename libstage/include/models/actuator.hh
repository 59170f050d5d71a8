// SPDX-License-Identifier: GPL-2.0-or-later
//
// ModelActuator: a linear or rotational joint that moves its children. Part of <stage.hh>.

#ifndef STAGE_MODELS_ACTUATOR_HH
#define STAGE_MODELS_ACTUATOR_HH

#include "models/model.hh"

namespace Stg {

/// Positions are displacements from the pose in the world file: metres if linear, radians including
/// whole turns if rotational.
class ModelActuator : public Model {
 public:
  typedef enum { CONTROL_VELOCITY, CONTROL_POSITION } ControlMode;
  typedef enum { TYPE_LINEAR, TYPE_ROTATIONAL } ActuatorType;

  ModelActuator(World* world, Model* parent, const std::string& type);
  ~ModelActuator();

  // Commands take effect at the next update, clipped to the limits. NaN is ignored with a message.

  /// Metres or radians per second.
  void SetSpeed(double speed);
  void GoTo(double pose);

  /// The goal: a speed or a position, depending on the control mode.
  double GetSpeed() const { return goal_; }
  double GetPosition() const;
  /// Current velocity, in metres or radians per second.
  double GetVelocity() const { return velocity_; }
  double GetMaxPosition() const { return max_position_; }
  double GetMinPosition() const { return min_position_; }
  /// In metres or radians per second.
  double GetMaxSpeed() const { return max_speed_; }
  ActuatorType GetType() const { return type_of_joint_; }
  /// Axis of a linear actuator in its own frame; a unit vector.
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
  /// Moves by one step, or not if that would end in an obstacle.
  void Move() override;
  bool StaysStill() const override { return velocity_ == 0 || disabled; }
  void StoreSensedPose() override { sensed_pose_ = pose; }
  void DropReadings() override;

 private:
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
  Pose reference_;      // pose at position 0, in the parent's frame
  bool has_reference_;  // false: reference_ is set at startup
  double turned_;       // unwraps a rotational position to count turns
  Pose sensed_pose_;    // in the parent's frame
};

}  // namespace Stg

#endif
