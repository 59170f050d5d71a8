// SPDX-License-Identifier: GPL-2.0-or-later
//
// The properties of position models.

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

#include "messages/report.hh"
#include "models/position.hh"
#include "models/property_checks.hh"
#include "motion/drive_table.hh"
#include "motion/odometry.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

double ReadShare(Worldfile* wf, int entity, const char* name, double share) {
  share = wf->ReadFloat(entity, name, share);
  if (!(share >= 0 && share <= 1))
    wf->Fail(
        entity, name,
        std::string("property \"") + name + "\": found a share outside of 0 to 1, expected 0 to 1");
  return share;
}

}  // namespace

void ModelPosition::Load() {
  if (!LoadCommon()) return;
  velocity.Load(wf, wf_entity, "velocity");
  LoadModes();
  LoadLimits();
  if (wf->PropertyExists(wf_entity, "odom")) {
    wf->ReadString(wf_entity, "odom", "");
    wf->TupleLength(wf_entity, "odom");
    wf->Warn(wf_entity, "odom", "\"odom\" has no effect any more; use \"localization_origin\"");
  }
  LoadOdomError();
  errors_given_ = wf->PropertyExists(wf_entity, "odom_error");
  LoadOdomNoise();
  wheel_slip_ = ReadShare(wf, wf_entity, "wheel_slip", wheel_slip_);

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

void ModelPosition::LoadDrive() {
  const std::string name = wf->ReadString(wf_entity, "drive", "");
  if (!wf->PropertyExists(wf_entity, "drive")) return;
  const RegisteredDrive* const drive = motion::FindDrive(name);
  if (!drive)
    return wf->Warn(wf_entity, "drive",
                    "found drive " + messages::Quoted(name) + ", expected " + motion::DriveNames() +
                        "; using \"diff\"");
  drive_ = drive;
  drive_mode = DRIVE_CUSTOM;
  for (const DriveMode mode : {DRIVE_DIFFERENTIAL, DRIVE_OMNI, DRIVE_CAR})
    if (drive == &motion::DriveOf(static_cast<motion::BuiltInDrive>(mode))) drive_mode = mode;
}

void ModelPosition::LoadLimits() {
  const auto read_flag = [this](const char* name, bool* flag) {
    *flag = wf->ReadInt(wf_entity, name, *flag) != 0;
  };
  read_flag("limit_acceleration", &limits_acceleration_);
  read_flag("stops_when_empty", &stops_when_empty_);

  wheelbase = wf->ReadLength(wf_entity, "wheelbase", wheelbase);
  if (!(wheelbase > 0)) wf->Fail(wf_entity, "wheelbase", "found a wheelbase that is not positive");
  const auto read_angle = [this](const char* name, double* angle) {
    if (wf->PropertyExists(wf_entity, name)) *angle = wf->ReadAngle(wf_entity, name, 0);
    CheckNotNegative(*wf, wf_entity, name, *angle);
  };
  read_angle("steering_limit", &steering_limit_);
  read_angle("steering_rate", &steering_rate_);
  const std::string command = wf->ReadString(wf_entity, "car_command", "");
  if (command == "steering" || command == "turn")
    commands_turn_ = command == "turn";
  else if (wf->PropertyExists(wf_entity, "car_command"))
    wf->Warn(
        wf_entity, "car_command",
        "found car_command " + messages::Quoted(command) + ", expected \"steering\" or \"turn\"");
}

void ModelPosition::LoadOdomNoise() {
  constexpr char kName[] = "odom_noise";
  if (!wf->PropertyExists(wf_entity, kName)) return;
  NoisyOdometry::Noise noise;
  wf->ReadTuple(wf_entity, kName, 0, 4, "llaa", &noise.translation_per_metre,
                &noise.translation_per_radian, &noise.heading_per_radian, &noise.heading_per_metre);
  for (const double deviation : {noise.translation_per_metre, noise.translation_per_radian,
                                 noise.heading_per_radian, noise.heading_per_metre})
    CheckNotNegative(*wf, wf_entity, kName, deviation);
  noisy_odometry_ = noise.IsZero() ? nullptr : std::make_unique<NoisyOdometry>(noise);
}

void ModelPosition::LoadModes() {
  LoadDrive();
  const std::string localization = wf->ReadString(wf_entity, "localization", "");
  if (localization == "gps" || localization == "odom")
    localization_mode = localization == "gps" ? LOCALIZATION_GPS : LOCALIZATION_ODOM;
  else if (wf->PropertyExists(wf_entity, "localization"))
    wf->Warn(
        wf_entity, "localization",
        "found localization " + messages::Quoted(localization) + ", expected \"gps\" or \"odom\"");
}

}  // namespace Stg
