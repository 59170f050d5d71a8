// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/actuator.hh"

#include <algorithm>
#include <cmath>

#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/host.hh"
#include "models/placement.hh"
#include "models/property_checks.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "models/types/built_in_types.hh"
#include "models/warn_about.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {
constexpr double kWatts = 2.0;
constexpr double kSecond = 1e6;  // microseconds

ReadingShape ShapeOfJoint(const ModelActuator&) { return ReadingShape(); }

bool CopyPosition(const ModelActuator& actuator, size_t, double* to) {
  *to = actuator.GetPosition();
  return true;
}

bool CopyVelocity(const ModelActuator& actuator, size_t, double* to) {
  *to = actuator.GetVelocity();
  return true;
}
}  // namespace

ModelType ActuatorType() {
  return ModelTypeOf<ModelActuator>("actuator")
      .Updates(ModelType::kParallel)
      .Reads(MakeReading("position", "m or rad",
                         "Displacement from the pose in the world file, at the end of the step.",
                         ShapeOfJoint, CopyPosition))
      .Reads(MakeReading("velocity", "m/s or rad/s", "The velocity of the step.", ShapeOfJoint,
                         CopyVelocity));
}

ModelActuator::ModelActuator(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      control_mode_(CONTROL_VELOCITY),
      type_of_joint_(TYPE_LINEAR),
      axis_(1, 0, 0),
      goal_(0),
      velocity_(0),
      max_speed_(1),
      max_position_(1),
      min_position_(0),
      has_reference_(false),
      turned_(0) {
  watts = kWatts;
}

ModelActuator::~ModelActuator() { host().StopMoving(this); }

// ---- commands and state -------------------------------------------------------------------------

void ModelActuator::SetGoal(ControlMode mode, double goal) {
  if (std::isnan(goal)) {
    WarnAbout(*this, "ignored a goal that is not a number");
    return;
  }
  control_mode_ = mode;
  goal_ = goal;
}

void ModelActuator::SetSpeed(double speed) { SetGoal(CONTROL_VELOCITY, speed); }
void ModelActuator::GoTo(double pose_) { SetGoal(CONTROL_POSITION, pose_); }

double ModelActuator::GetPosition() const {
  if (!has_reference_) return 0.0;
  if (type_of_joint_ == TYPE_ROTATIONAL)
    return turned_ + normalize(pose.a - reference_.a - turned_);
  const point_t moved =
      Rotated(point_t(pose.x - reference_.x, pose.y - reference_.y), SinCos(-reference_.a));
  return axis_.x * moved.x + axis_.y * moved.y + axis_.z * (pose.z - reference_.z);
}

/// Displacement in the actuator's own frame.
Pose ModelActuator::Displacement(double distance) const {
  if (type_of_joint_ == TYPE_ROTATIONAL) return Pose(0, 0, 0, distance);
  return Pose(axis_.x * distance, axis_.y * distance, axis_.z * distance, 0);
}

// ---- loading ------------------------------------------------------------------------------------

void ModelActuator::Load() {
  if (!wf) return;
  const DeletionWatch watch(*this);
  if (has_reference_) SetPose(reference_);  // when it is loaded again
  if (watch.gone() || !LoadCommon()) return;
  LoadJoint();
  reference_ = pose;
  has_reference_ = true;
  const double start = wf->ReadFloat(wf_entity, "start_position", 0);
  if (start < min_position_ || start > max_position_)
    wf->Warn(
        wf_entity, "start_position",
        "found a start_position outside the actuator's range, expected one from min_position to "
        "max_position");
  turned_ = start;
  if (start != 0) SetPose(pose + Displacement(start));
  if (!watch.gone()) StoreSensedPose();
}

void ModelActuator::Save() {
  if (!SaveCommon() || !wf->PropertyExists(wf_entity, "start_position")) return;
  // The start position is added to the pose in loading, so they are saved separately.
  const double position = GetPosition();
  Pose without = pose + Displacement(-position);
  without.Save(wf, wf_entity, "pose");
  wf->WriteFloat(wf_entity, "start_position", position);
}

void ModelActuator::LoadJoint() {
  const std::string joint = wf->ReadString(wf_entity, "type", "linear");
  if (joint != "linear" && joint != "rotational")
    wf->Warn(wf_entity, "type",
             "found type " + messages::Quoted(joint) +
                 ", expected \"linear\" or \"rotational\"; using linear");
  type_of_joint_ = joint == "rotational" ? TYPE_ROTATIONAL : TYPE_LINEAR;
  LoadAxis();
  max_speed_ = wf->ReadFloat(wf_entity, "max_speed", max_speed_);
  if (max_speed_ < 0)
    wf->Fail(wf_entity, "max_speed", "found a negative speed, expected 0 or more");
  max_position_ = wf->ReadFloat(wf_entity, "max_position", max_position_);
  min_position_ = wf->ReadFloat(wf_entity, "min_position", min_position_);
  if (min_position_ > max_position_)
    wf->Fail(wf_entity, "min_position", "found a smallest position above max_position");
  if (wf->PropertyExists(wf_entity, "min_position"))
    WarnIfEqual(wf, wf_entity, "max_position", min_position_, max_position_, "it cannot move");
}

void ModelActuator::LoadAxis() {
  double x = 1, y = 0, z = 0;
  wf->ReadTuple(wf_entity, "axis", 0, 3, "fff", &x, &y, &z);
  if (type_of_joint_ == TYPE_ROTATIONAL) {
    axis_ = point3_t();
    return;
  }
  const double length = std::sqrt(x * x + y * y + z * z);
  if (length > 0 && std::isfinite(length)) {
    axis_ = point3_t(x / length, y / length, z / length);
    return;
  }
  wf->Warn(wf_entity, "axis", "found an axis without direction; using 1 0 0");
  axis_ = point3_t(1, 0, 0);
}

void ModelActuator::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  StateChoice control(&control_mode_, CONTROL_POSITION);
  StateChoice joint(&type_of_joint_, TYPE_ROTATIONAL);
  exchange(control, joint, axis_, goal_, velocity_, max_speed_, max_position_, min_position_,
           reference_, has_reference_, turned_);
  if (!exchange.hashing() && !exchange.omits_readings()) exchange(sensed_pose_);
}

void ModelActuator::DropReadings() {
  Model::DropReadings();
  StoreSensedPose();
}

// ---- updating -----------------------------------------------------------------------------------

void ModelActuator::Startup() {
  if (!has_reference_) reference_ = pose;
  has_reference_ = true;
  StoreSensedPose();
  host().StartMoving(this);
  Model::Startup();
}

void ModelActuator::Shutdown() {
  goal_ = velocity_ = 0;
  host().StopMoving(this);
  Model::Shutdown();
}

void ModelActuator::Update() {
  GatherSerially();
  Model::Update();
}

void ModelActuator::Gather(internal::sensing::FanList*) {
  const double position = GetPosition();
  turned_ = position;
  if (control_mode_ == CONTROL_VELOCITY) {
    const bool at_end =
        (position <= min_position_ && goal_ < 0) || (position >= max_position_ && goal_ > 0);
    velocity_ = at_end ? 0.0 : goal_;
  } else {
    goal_ = constrain(goal_, min_position_, max_position_);
    velocity_ = goal_ - position;  // gain of 1/s
  }
  velocity_ = constrain(velocity_, -max_speed_, max_speed_);
}

/// Signed length of this step's motion, limited by the range of positions and by the goal.
double ModelActuator::StepLength(double position) const {
  const double step = velocity_ * (static_cast<double>(world_base().sim_interval) / kSecond);
  const bool to_goal = control_mode_ == CONTROL_POSITION;
  if (step > 0) return constrain((to_goal ? goal_ : max_position_) - position, 0.0, step);
  return constrain((to_goal ? goal_ : min_position_) - position, step, 0.0);
}

void ModelActuator::Move() {
  if (StaysStill()) return;
  const double position = GetPosition();
  const double step = StepLength(position);
  if (step == 0) return;
  host().PrepareMove();
  const Pose old_pose = pose;
  pose = pose + Displacement(step);
  if (!std::isfinite(pose.x + pose.y + pose.z)) {  // the limits may be infinite
    pose = old_pose;
    stall = true;
    return;
  }

  Placement& placement = host().placement;
  placement.Propose(*this, true);
  stall = host().IsBlocked(*this, old_pose, placement);
  if (stall) {
    pose = old_pose;
    return;
  }
  turned_ = position + step;
  placement.Commit();
  NoteOutlineChange();
}

}  // namespace Stg
