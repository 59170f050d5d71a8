// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/position.hh"

#include <algorithm>
#include <cmath>

#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
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
#include "random/random.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr double kSecond = 1e6;  // microseconds

// Widths of the uniform distributions, centred on zero, of the default odometry errors.
constexpr double kErrorWidthXY = 0.03, kErrorWidthA = 0.05;

// Parameters of position control, which has a gain of 1/s.
constexpr double kMaxApproach = 0.4;     // m/s
constexpr double kMaxTurn = 1.0;         // rad/s
constexpr double kCloseEnough = 0.02;    // m, per axis
constexpr double kFacing = M_PI / 16.0;  // rad: drive forward only if the goal is within this angle

double Symmetric(double value, double limit) { return constrain(value, -limit, limit); }

bool AllNumbers(const Pose& p) {
  return !std::isnan(p.x) && !std::isnan(p.y) && !std::isnan(p.z) && !std::isnan(p.a);
}

/// Rotates (x, y) by an angle in radians.
point_t Turned(double x, double y, double angle) {
  const SineCosine turn = SinCos(angle);
  return point_t(x * turn.cosine - y * turn.sine, x * turn.sine + y * turn.cosine);
}

}  // namespace

// kCallsVelocity, because CB_VELOCITY callbacks need special treatment in GatherPhase.
ModelType PositionType() {
  return ModelTypeOf<ModelPosition>("position")
      .Updates(ModelType::kParallel | ModelType::kCallsVelocity);
}

ModelPosition::ModelPosition(World* world_, Model* parent_, const std::string& type_)
    : Model(world_, parent_, type_),
      control_mode(CONTROL_VELOCITY),
      drive_mode(DRIVE_DIFFERENTIAL),
      localization_mode(LOCALIZATION_GPS),
      wheelbase(1.0),
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
  RandomStream& random = world_base().random();
  const double x = random.Uniform(-kErrorWidthXY / 2, kErrorWidthXY / 2);
  const double y = random.Uniform(-kErrorWidthXY / 2, kErrorWidthXY / 2);
  const double a = random.Uniform(-kErrorWidthA / 2, kErrorWidthA / 2);
  if (errors_given_) return;
  integration_error.x = x;
  integration_error.y = y;
  integration_error.a = a;
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
  ApplyVelocity(val);
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

Velocity ModelPosition::GetGlobalVelocity() const {
  const point_t v = Turned(velocity.x, velocity.y, GetGlobalPose().a);
  return Velocity(v.x, v.y, 0, velocity.a);
}

void ModelPosition::SetGlobalVelocity(const Velocity& gvel) {
  const point_t v = Turned(gvel.x, gvel.y, -GetGlobalPose().a);
  SetVelocity(Velocity(v.x, v.y, 0, gvel.a));
}

// NOLINTNEXTLINE(performance-unnecessary-value-param): Stage's interface
void ModelPosition::SetOdom(Pose odom) {
  if (!IsFinite(odom)) {
    WarnAbout(*this, "refused an estimate that is not finite");
    return;
  }
  est_pose = odom;
  driven_ = Pose();
  // Computes the frame in which the present pose reads `odom`.
  const Pose g = GetGlobalPose();
  const double da = normalize(g.a - odom.a);
  const point_t offset = Turned(odom.x, odom.y, da);
  est_origin = Pose(g.x - offset.x, g.y - offset.y, est_origin.z, da);
}

void ModelPosition::Waypoint::ExchangeState(StateExchange& exchange) { exchange(pose, color); }

void ModelPosition::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  StateChoice control(&control_mode, CONTROL_POSITION);
  StateChoice drive(&drive_mode, DRIVE_CAR);
  StateChoice localization(&localization_mode, LOCALIZATION_ODOM);
  exchange(velocity, goal, control, drive, localization, integration_error, wheelbase,
           last_update_);
  exchange(est_pose, est_pose_error, est_origin, velocity_bounds, acceleration_bounds, waypoints);
  if (localization_mode == LOCALIZATION_ODOM) exchange(driven_);
  // The sensed pose does not affect the future.
  if (!exchange.hashing() && !exchange.omits_readings()) exchange(sensed_pose_, sensed_at_);
}

void ModelPosition::DropReadings() {
  Model::DropReadings();
  sensed_pose_ = GetGlobalPose();
  sensed_at_ = 0;
}

// ---- loading ------------------------------------------------------------------------------------

void ModelPosition::Load() {
  if (!LoadCommon()) return;
  velocity.Load(wf, wf_entity, "velocity");
  LoadModes();
  wheelbase = wf->ReadLength(wf_entity, "wheelbase", wheelbase);
  if (!(wheelbase > 0)) wf->Fail(wf_entity, "wheelbase", "found a wheelbase that is not positive");
  if (wf->PropertyExists(wf_entity, "odom")) {
    wf->ReadString(wf_entity, "odom", "");
    wf->TupleLength(wf_entity, "odom");
    wf->Warn(wf_entity, "odom", "\"odom\" has no effect any more; use \"localization_origin\"");
  }
  LoadOdomError();
  errors_given_ = wf->PropertyExists(wf_entity, "odom_error");

  const auto read_bounds = [this](const char* name, Bounds* b) {
    wf->ReadTuple(wf_entity, name, 0, 8, "llllllaa", &b[0].min, &b[0].max, &b[1].min, &b[1].max,
                  &b[2].min, &b[2].max, &b[3].min, &b[3].max);
    CheckInOrder(*wf, wf_entity, name, b, 4);
    for (const int axis : {0, 3})  // other axes are often blocked on purpose
      WarnIfEqual(wf, wf_entity, name, b[axis].min, b[axis].max,
                  axis == 0 ? "commands do not change how it drives forwards"
                            : "commands do not change how it turns");
  };
  read_bounds("velocity_bounds", velocity_bounds);
  read_bounds("acceleration_bounds", acceleration_bounds);

  StartLocalization();
}

/// Many world files give six numbers, the diagonal of a covariance matrix: [x y z roll pitch yaw].
void ModelPosition::LoadOdomError() {
  constexpr char kName[] = "odom_error";
  Velocity& error = integration_error;
  if (wf->ReadElement(wf_entity, kName, 5).empty()) {
    error.Load(wf, wf_entity, kName);
  } else {
    wf->ReadTuple(wf_entity, kName, 0, 3, "lll", &error.x, &error.y, &error.z);
    wf->ReadTuple(wf_entity, kName, 5, 1, "a", &error.a);
    wf->Warn(wf_entity, kName,
             "property \"odom_error\": found 6 values, expected 4, [x y z turn]; the sixth is "
             "used for the turn, the fourth and the fifth are not read");
  }
  if (std::max({std::fabs(error.x), std::fabs(error.y), std::fabs(error.a)}) > 1)
    wf->Warn(wf_entity, kName,
             "property \"odom_error\": found an error larger than the motion, expected a "
             "fraction of it, up to 1 (for the turn: 1 rad)");
}

void ModelPosition::StartLocalization() {
  est_origin = GetGlobalPose();
  const Pose global = est_origin;
  est_origin.Load(wf, wf_entity, "localization_origin");
  const point_t seen = Turned(global.x - est_origin.x, global.y - est_origin.y, -est_origin.a);
  est_pose = Pose(seen.x, seen.y, 0, normalize(global.a - est_origin.a));
  driven_ = Pose();
  StoreSensedPose();
}

void ModelPosition::LoadModes() {
  const std::string drive = wf->ReadString(wf_entity, "drive", "");
  if (drive == "diff" || drive == "omni" || drive == "car")
    drive_mode = drive == "diff" ? DRIVE_DIFFERENTIAL : drive == "omni" ? DRIVE_OMNI : DRIVE_CAR;
  else if (wf->PropertyExists(wf_entity, "drive"))
    wf->Warn(wf_entity, "drive",
             "found drive " + messages::Quoted(drive) +
                 ", expected \"diff\", \"omni\" or \"car\"; using \"diff\"");

  const std::string localization = wf->ReadString(wf_entity, "localization", "");
  if (localization == "gps" || localization == "odom")
    localization_mode = localization == "gps" ? LOCALIZATION_GPS : LOCALIZATION_ODOM;
  else if (wf->PropertyExists(wf_entity, "localization"))
    wf->Warn(
        wf_entity, "localization",
        "found localization " + messages::Quoted(localization) + ", expected \"gps\" or \"odom\"");
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
  Velocity vel = WantedVelocity(dt);
  if (!AllNumbers(vel)) vel = Velocity();  // for example a car with an infinite steering angle
  double power = PowerOf(vel);
  vel.x = velocity_bounds[0].Constrain(vel.x);
  vel.y = velocity_bounds[1].Constrain(vel.y);
  vel.z = velocity_bounds[2].Constrain(vel.z);
  vel.a = velocity_bounds[3].Constrain(vel.a);
  // Uses the unbounded velocity, as Stage 4.3 does, unless that is infinite.
  if (!std::isfinite(power)) power = PowerOf(vel);
  if (std::isfinite(power)) watts = power;
  ApplyVelocity(vel);
}

double ModelPosition::PowerOf(const Velocity& vel) const {
  return 1.0 + 10.0 * mass * (std::fabs(vel.x) + std::fabs(vel.y) + std::fabs(vel.a));
}

Velocity ModelPosition::WantedVelocity(double dt) const {
  switch (control_mode) {
    case CONTROL_VELOCITY:
      return VelocityMode();
    case CONTROL_ACCELERATION:
      return AccelerationMode(dt);
    case CONTROL_POSITION:
      return PositionMode();
  }
  return Velocity();
}

Velocity ModelPosition::VelocityMode() const {
  switch (drive_mode) {
    case DRIVE_DIFFERENTIAL:
      return Velocity(goal.x, 0, 0, goal.a);
    case DRIVE_OMNI:
      return Velocity(goal.x, goal.y, 0, goal.a);
    case DRIVE_CAR: {
      const SineCosine steering = SinCos(goal.a);
      return Velocity(goal.x * steering.cosine, 0, 0, goal.x * steering.sine / wheelbase);
    }
  }
  return Velocity();
}

Velocity ModelPosition::AccelerationMode(double dt) const {
  Velocity vel = velocity;
  if (drive_mode == DRIVE_CAR) return vel;
  const auto bounded = [this](int axis, double value) {
    const Bounds& b = acceleration_bounds[axis];
    return std::max(b.min, std::min(b.max, value));  // upper bound first, then lower
  };
  vel.x += bounded(0, goal.x) * dt;
  vel.y = drive_mode == DRIVE_OMNI ? vel.y + bounded(1, goal.y) * dt : 0.0;
  vel.a += bounded(3, goal.a) * dt;
  return vel;
}

Velocity ModelPosition::PositionMode() const {
  // With GPS this is the estimate of the previous step, as in Stage 4.3.
  const Pose here = localization_mode == LOCALIZATION_GPS ? est_pose : EstimateNow();
  const double ex = goal.x - here.x, ey = goal.y - here.y;
  const double ea = normalize(goal.a - here.a);
  if (drive_mode == DRIVE_OMNI) {
    const point_t error = Turned(ex, ey, -here.a);
    return Velocity(Symmetric(error.x, kMaxApproach), Symmetric(error.y, kMaxApproach), 0,
                    Symmetric(ea, kMaxTurn));
  }
  if (drive_mode == DRIVE_CAR) return Velocity();

  if (std::fabs(ex) < kCloseEnough && std::fabs(ey) < kCloseEnough)
    return Velocity(0, 0, 0, Symmetric(ea, kMaxTurn));
  const double off_course = normalize(ArcTangent(ey, ex) - here.a);
  const double distance = std::sqrt(ex * ex + ey * ey);
  const double speed = std::fabs(off_course) < kFacing ? std::min(distance, kMaxApproach) : 0.0;
  return Velocity(speed, 0, 0, Symmetric(off_course, kMaxTurn));
}

// ---- localization -------------------------------------------------------------------------------

void ModelPosition::StoreSensedPose() {
  sensed_pose_ = GetGlobalPose();
  sensed_at_ = world_base().SimTimeNow();
  est_pose = EstimateNow();
  driven_ = Pose();
}

/// Estimate of the present pose.
Pose ModelPosition::EstimateNow() const {
  if (localization_mode == LOCALIZATION_GPS) return sensed_pose_;
  const Pose next = est_pose + driven_;
  return IsFinite(next) ? next : est_pose;  // a client may have set a value that is not finite
}

// Robots without subscribers neither record poses nor move by themselves.

Pose ModelPosition::GetSensedPose() const {
  return HasSubscribers() ? sensed_pose_ : Model::GetSensedPose();
}

Pose ModelPosition::GetSensedLocalPose() const {
  if (!HasSubscribers()) return pose;
  return parent ? parent->LocalPoseOf(sensed_pose_, parent->GetSensedPose()) : sensed_pose_;
}

/// Adds this step's motion, scaled by the odometry errors, to the distance driven.
void ModelPosition::CountMotion() {
  if (localization_mode == LOCALIZATION_GPS) return;
  const Pose next = driven_ + MotionOfStep(GetEstimatedVelocity());
  if (IsFinite(next)) driven_ = next;
}

Velocity ModelPosition::GetActualVelocity() const {
  return stall || disabled || !HasSubscribers() ? Velocity() : velocity;
}

Velocity ModelPosition::GetEstimatedVelocity() const {
  const Velocity v = GetActualVelocity(), &error = integration_error;
  if (localization_mode == LOCALIZATION_GPS) return v;
  return Velocity(v.x * (1.0 + error.x), v.y * (1.0 + error.y), 0, v.a * (1.0 + error.a));
}

// ---- moving -------------------------------------------------------------------------------------

Pose ModelPosition::MotionOfStep(const Velocity& v) const {
  const double dt = static_cast<double>(world_base().sim_interval) / kSecond;
  return Pose(v.x * dt, v.y * dt, v.z * dt, normalize(v.a * dt));
}

void ModelPosition::Move() {
  Placement& placement = host().placement;
  if (BeginMove(&placement) && EndMove(placement)) placement.Commit();
}

bool ModelPosition::BeginMove(Placement* placement) {
  if (StaysStill()) return false;
  STAGE_ASSERT(IsFinite(pose) && HasSubscribers());
  pose_before_move_ = pose;
  // Translates along the old heading, then turns.
  pose = pose + MotionOfStep(velocity);

  if (!IsFinite(pose)) {  // an infinite speed without bounds
    pose = pose_before_move_;
    stall = true;
    return false;
  }
  placement->Propose(*this, true);
  return true;
}

bool ModelPosition::EndMove(const Placement& placement) {
  stall = placement.Collision(world_base().GetGround()) != nullptr;
  if (stall)
    pose = pose_before_move_;
  else
    CountMotion();
  return !stall;
}

}  // namespace Stg
