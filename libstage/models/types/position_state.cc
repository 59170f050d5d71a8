// SPDX-License-Identifier: GPL-2.0-or-later
//
// The state of position models: everything that decides their future.

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>

#include "models/position.hh"
#include "models/state_choice.hh"
#include "models/state_exchange.hh"
#include "motion/drive_table.hh"
#include "motion/odometry.hh"

namespace Stg {

namespace {

// Groups of values that most robots leave at their defaults. Only the other groups are hashed and
// saved.
constexpr unsigned kHasLimits = 1, kHasSteering = 2, kHasMadeVelocity = 4, kHasNoise = 8,
                   kHasOwnDrive = 16;
constexpr unsigned kEverything = 31;

}  // namespace

void ModelPosition::Waypoint::ExchangeState(StateExchange& exchange) { exchange(pose, color); }

void ModelPosition::ExchangeState(StateExchange& exchange) {
  Model::ExchangeState(exchange);
  StateChoice control(&control_mode, CONTROL_POSITION);
  StateChoice drive(&drive_mode, DRIVE_CUSTOM);
  StateChoice localization(&localization_mode, LOCALIZATION_ODOM);
  exchange(velocity, goal, control, drive, localization, integration_error, wheelbase,
           last_update_);
  exchange(est_pose, est_pose_error, est_origin, velocity_bounds, acceleration_bounds, waypoints);
  if (localization_mode == LOCALIZATION_ODOM) exchange(driven_);
  ExchangeMotion(exchange);
  // The sensed pose does not affect the future.
  if (!exchange.hashing() && !exchange.omits_readings()) exchange(sensed_pose_, sensed_at_);
}

unsigned ModelPosition::MotionState(bool hashing) const {
  unsigned state = 0;
  if (limits_acceleration_ || !stops_when_empty_ || commands_turn_ || wheel_slip_ != 0 ||
      !std::isinf(steering_limit_) || !std::isinf(steering_rate_))
    state |= kHasLimits;
  if (drive_mode == DRIVE_CUSTOM) state |= kHasOwnDrive;
  // A car with this steering computes the angle anew from each command.
  const bool at_once = drive_mode != DRIVE_CUSTOM && !commands_turn_ && std::isinf(steering_rate_);
  if (steering_ != 0 && !(hashing && at_once)) state |= kHasSteering;
  if (is_hindered_) state |= kHasMadeVelocity;
  if (noisy_odometry_) state |= kHasNoise;
  return state;
}

void ModelPosition::ExchangeMotion(StateExchange& exchange) {
  auto state = static_cast<uint8_t>(MotionState(exchange.hashing()));
  if (!exchange.hashing() || state != 0) exchange(state);
  if (exchange.restoring() && !exchange.failed()) RestoreDefaults(state);
  if (state > kEverything) return exchange.Fail("found unknown values of a robot's motion");
  if (state & kHasLimits)
    exchange(limits_acceleration_, stops_when_empty_, commands_turn_, wheel_slip_, steering_limit_,
             steering_rate_);
  if (state & kHasSteering) exchange(steering_);
  if (state & kHasMadeVelocity) exchange(made_);
  if (state & kHasNoise) exchange(*noisy_odometry_);
  if (state & kHasOwnDrive)
    ExchangeOwnDrive(exchange);
  else if (exchange.restoring() && !exchange.failed() && drive_mode != DRIVE_CUSTOM)
    drive_ = &motion::DriveOf(static_cast<motion::BuiltInDrive>(drive_mode));
}

/// Sets the groups that are not in `state` to their defaults.
void ModelPosition::RestoreDefaults(unsigned state) {
  if (!(state & kHasLimits)) {
    limits_acceleration_ = commands_turn_ = false;
    stops_when_empty_ = true;
    wheel_slip_ = 0;
    steering_limit_ = steering_rate_ = std::numeric_limits<double>::infinity();
  }
  if (!(state & kHasSteering)) steering_ = 0;
  is_hindered_ = state & kHasMadeVelocity;
  if (!(state & kHasNoise))
    noisy_odometry_.reset();
  else if (!noisy_odometry_)
    noisy_odometry_ = std::make_unique<NoisyOdometry>();
}

void ModelPosition::ExchangeOwnDrive(StateExchange& exchange) {
  std::string name = drive_->name;
  exchange(name);
  if (!exchange.restoring() || exchange.failed()) return;
  const RegisteredDrive* const drive = motion::FindDrive(name);
  if (!drive || drive_mode != DRIVE_CUSTOM)
    return exchange.Fail("found a drive that is not registered");
  drive_ = drive;
}

}  // namespace Stg
