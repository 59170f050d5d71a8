// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/position.hh"

#include <cmath>
#include <limits>

#include "messages/assert.hh"
#include "models/body.hh"
#include "models/deletion_watch.hh"
#include "models/host.hh"
#include "models/noise.hh"
#include "models/placement.hh"
#include "models/power_pack.hh"
#include "models/property_checks.hh"
#include "models/types/built_in_types.hh"
#include "models/warn_about.hh"
#include "motion/drive_table.hh"
#include "motion/odometry.hh"
#include "random/random.hh"

namespace Stg {

namespace {

constexpr double kSecond = 1e6;  // microseconds

constexpr double kUnlimited = std::numeric_limits<double>::infinity();

static_assert(ModelPosition::DRIVE_DIFFERENTIAL == int{motion::kDifferential} &&
              ModelPosition::DRIVE_OMNI == int{motion::kOmni} &&
              ModelPosition::DRIVE_CAR == int{motion::kCar} &&
              ModelPosition::DRIVE_CUSTOM == int{motion::kBuiltInDrives});
static_assert(ModelPosition::CONTROL_ACCELERATION == int{DriveInput::kAcceleration} &&
              ModelPosition::CONTROL_VELOCITY == int{DriveInput::kVelocity} &&
              ModelPosition::CONTROL_POSITION == int{DriveInput::kPosition});

bool AllNumbers(const Pose& p) {
  return !std::isnan(p.x) && !std::isnan(p.y) && !std::isnan(p.z) && !std::isnan(p.a);
}

}  // namespace

// kCallsVelocity, because CB_VELOCITY callbacks need special treatment in GatherPhase.
ModelType PositionType() {
  return ModelTypeOf<ModelPosition>("position")
      .Moves(ModelType::kMovesTree)
      .Updates(ModelType::kParallel | ModelType::kCallsVelocity);
}

ModelPosition::ModelPosition(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      control_mode(CONTROL_VELOCITY),
      drive_mode(DRIVE_DIFFERENTIAL),
      localization_mode(LOCALIZATION_GPS),
      wheelbase(1.0),
      steering_limit_(kUnlimited),
      steering_rate_(kUnlimited),
      drive_(&motion::DriveOf(motion::kDifferential)),
      last_update_(0),
      car_warned_(false),
      sensed_at_(0) {
  gui.nose = true;
  for (int i = 0; i < 3; i++) velocity_bounds[i] = acceleration_bounds[i] = Bounds(-1.0, 1.0);
  velocity_bounds[3] = acceleration_bounds[3] = Bounds(-M_PI / 2, M_PI / 2);

  drives_ = true;
  DrawErrors();
}

/// Draws random odometry errors. Errors given in the world file are kept.
void ModelPosition::DrawErrors() {
  const Velocity error = DrawOdomError(&world_base().random());
  if (errors_given_) return;
  integration_error.x = error.x;
  integration_error.y = error.y;
  integration_error.a = error.a;
}

ModelPosition::~ModelPosition() { host().StopMoving(this); }

// ---- commands -----------------------------------------------------------------------------------

void ModelPosition::SetSpeed(double x, double y, double a) { SetSpeed(Velocity(x, y, 0, a)); }

// NOLINTNEXTLINE(performance-unnecessary-value-param): Stage's interface
void ModelPosition::SetSpeed(Velocity vel) {
  if (!AllNumbers(vel)) {
    WarnAbout(*this, "ignored a speed that is not a number");
    return;
  }
  control_mode = CONTROL_VELOCITY;
  goal = vel;
  if (!vel.IsZero()) CheckSubscription();
}

/// A controller may send a command before it subscribes, so the check is made in the next step.
void ModelPosition::CheckSubscription() {
  if (HasSubscribers() || warned_unsubscribed_) return;
  check_subscription_ = true;
  host().command_without_subscriber = true;
}

void ModelPosition::WarnIfNotSubscribed() {
  if (!check_subscription_) return;
  check_subscription_ = false;
  if (HasSubscribers() || warned_unsubscribed_) return;
  warned_unsubscribed_ = true;
  WarnAbout(*this,
            "found a command for a robot without subscribers; it has no effect; Subscribe() to "
            "it, or give it alwayson 1 in the world file");
}

void ModelPosition::SetXSpeed(double x) { SetSpeed(Velocity(x, goal.y, goal.z, goal.a)); }
void ModelPosition::SetYSpeed(double y) { SetSpeed(Velocity(goal.x, y, goal.z, goal.a)); }
void ModelPosition::SetZSpeed(double z) { SetSpeed(Velocity(goal.x, goal.y, z, goal.a)); }
void ModelPosition::SetTurnSpeed(double a) { SetSpeed(Velocity(goal.x, goal.y, goal.z, a)); }
void ModelPosition::Stop() { SetSpeed(0, 0, 0); }

void ModelPosition::GoTo(double x, double y, double a) { GoTo(Pose(x, y, 0, a)); }

// NOLINTNEXTLINE(performance-unnecessary-value-param): Stage's interface
void ModelPosition::GoTo(Pose target) {
  if (!IsFinite(target)) {
    WarnAbout(*this, "ignored a goal that is not finite");
    return;
  }
  control_mode = CONTROL_POSITION;
  goal = target;
  CheckSubscription();
}

void ModelPosition::SetAcceleration(double x, double y, double a) {
  const Pose wanted(x, y, 0, a);
  if (!AllNumbers(wanted)) {
    WarnAbout(*this, "ignored an acceleration that is not a number");
    return;
  }
  control_mode = CONTROL_ACCELERATION;
  goal = wanted;
  CheckSubscription();
}

void ModelPosition::SetVelocity(const Velocity& val) {
  if (!val.IsZero()) CheckSubscription();
  ApplyVelocity(IsOutOfPower() && AllNumbers(val) ? Velocity() : val);
}

/// Sets the velocity and calls the callbacks, which may delete the model.
void ModelPosition::ApplyVelocity(const Velocity& val) {
  if (!AllNumbers(val)) {
    WarnAbout(*this, "ignored a velocity that is not a number");
    return;
  }
  velocity = val;
  CallCallbacks(CB_VELOCITY);
}

// ---- updating -----------------------------------------------------------------------------------

void ModelPosition::Startup() {
  last_update_ = world_base().SimTimeNow();
  StoreSensedPose();
  host().StartMoving(this);
  Model::Startup();
}

void ModelPosition::Shutdown() {
  goal = Pose();
  velocity = Velocity();
  is_hindered_ = false;
  host().StopMoving(this);
  Model::Shutdown();
}

double ModelPosition::SecondsSinceUpdate() {
  const usec_t now = world_base().SimTimeNow();
  STAGE_ASSERT(now >= last_update_);
  const double seconds = static_cast<double>(now - last_update_) / kSecond;
  last_update_ = now;
  return seconds;
}

void ModelPosition::Update() {
  const DeletionWatch watch(*this);  // a CB_VELOCITY callback may delete the model
  GatherSerially();
  if (!watch.gone()) Model::Update();
}

void ModelPosition::Gather(internal::sensing::FanList*) {
  const double dt = SecondsSinceUpdate();
  if (drive_mode == DRIVE_CAR && control_mode != CONTROL_VELOCITY && !car_warned_) {
    WarnAbout(*this, "a car can only be driven by SetSpeed()");
    car_warned_ = true;
  }
  ApplyVelocity(NextVelocity(dt));
}

Velocity ModelPosition::NextVelocity(double dt) {
  if (IsOutOfPower()) {
    watts = PowerOf(Velocity());
    return Velocity();
  }
  const DriveInput input = InputOfDrive(dt);
  const motion::Driven driven = motion::Drive(drive_->function, input);
  steering_ = driven.steering;
  const double power = motion::PowerOf(driven, mass, limits_acceleration_);
  if (std::isfinite(power)) watts = power;
  return driven.made;
}

DriveInput ModelPosition::InputOfDrive(double dt) const {
  DriveInput input;
  input.mode = static_cast<DriveInput::Mode>(control_mode);
  input.command = goal;
  input.velocity = velocity;
  // With GPS this is the estimate of the previous step, as in Stage 4.3.
  if (control_mode == CONTROL_POSITION || drive_mode == DRIVE_CUSTOM)
    input.estimate = localization_mode == LOCALIZATION_GPS ? est_pose : EstimateNow();
  input.steering = steering_;
  input.dt = dt;
  input.wheelbase = wheelbase;
  input.steering_limit = steering_limit_;
  input.steering_rate = steering_rate_;
  input.commands_turn = commands_turn_;
  input.limits_acceleration = limits_acceleration_;
  input.velocity_bounds = velocity_bounds;
  input.acceleration_bounds = acceleration_bounds;
  return input;
}

double ModelPosition::PowerOf(const Velocity& vel) const { return motion::PowerAt(mass, vel); }

bool ModelPosition::IsOutOfPower() const {
  if (!stops_when_empty_) return false;
  const PowerPack* const pack = FindPowerPack();
  return pack && pack->GetStored() == 0;
}

// ---- moving -------------------------------------------------------------------------------------

double ModelPosition::StepSeconds() const {
  return static_cast<double>(world_base().sim_interval) / kSecond;
}

Pose ModelPosition::MotionOfStep(const Velocity& v) const {
  const double dt = StepSeconds();
  return Pose(v.x * dt, v.y * dt, v.z * dt, normalize(v.a * dt));
}

bool ModelPosition::GetWantedMove(WantedMove* move) {
  is_hindered_ = false;
  if (StaysStill()) return false;
  STAGE_ASSERT(IsFinite(pose) && HasSubscribers());
  // Translates along the old heading, then turns.
  *move = {pose + MotionOfStep(velocity), velocity.a * StepSeconds(), velocity};
  if (IsFinite(move->pose)) return true;
  stall = true;  // an infinite speed without bounds
  return false;
}

void ModelPosition::EndMove(const Velocity& made) {
  if (made.IsZero() && StaysStill())
    is_hindered_ = false;
  else
    NoteMotion(made);
}

}  // namespace Stg
