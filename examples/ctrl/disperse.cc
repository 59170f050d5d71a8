// SPDX-License-Identifier: GPL-2.0-or-later
//
// disperse: drives each robot to where it is emptiest, so that a crowd spreads. See
// support/disperse_rule.hh.
//
//   ctrl "disperse [speed=0.4] [gain=1.0] [turn=1.5] [margin=0.1] [horizon=5.0]"
//
// speed and turn are maximum speeds (m/s, rad/s). gain is the turn speed per radian of bearing to
// the goal. margin is the distance to keep from everything (m). horizon is the maximum range of
// readings that count (m). Uses all sensors of all rangers of the robot that no other controller
// uses, and runs when the first ranger has new data. Rejects models that are not positions, robots
// without such a ranger, and invalid arguments.

#include "support/disperse_rule.hh"
#include "support/set_up.hh"

namespace {

/// A sensor and its mount on the robot.
struct MountedSensor {
  Stg::ModelRanger* ranger = nullptr;
  size_t sensor = 0;
  Stg::Pose pose;  ///< in the robot's frame
  double fov = 0;  ///< the field of view of `table`
  const ctrl::RayTable* table = nullptr;
};

struct Robot {
  Stg::ModelPosition* position = nullptr;
  ctrl::DisperseRule rule;
  double radius = 0;  ///< radius of the disc that must stay free, m
  std::vector<MountedSensor> mounted_sensors;
  bool backing = false;

  void ExchangeState(Stg::StateExchange& exchange) { exchange(backing); }
};

/// Adds the readings of one sensor.
void AddReadingsOf(const Robot& robot, MountedSensor* mounted, ctrl::Surroundings* seen) {
  if (mounted->sensor >= mounted->ranger->GetSensors().size()) return;
  const Stg::ModelRanger::Sensor& sensor = mounted->ranger->GetSensors()[mounted->sensor];
  const size_t count = sensor.ranges.size();
  if (count == 0 || sensor.bearings.size() != count) return;
  if (!mounted->table || mounted->table->size() != count || mounted->fov != sensor.fov) {
    mounted->table = ctrl::FindRayTable(mounted->pose.a, sensor.fov, sensor.bearings);
    mounted->fov = sensor.fov;
  }
  const double cap = std::min(sensor.range.max, robot.rule.horizon);
  ctrl::AddReadings(*mounted->table, sensor.ranges.data(), cap, seen);
  ctrl::LimitFreePath(*mounted->table, sensor.ranges.data(),
                      {mounted->pose.x, mounted->pose.y, robot.radius}, seen);
}

/// Backs a stalled robot slightly every other update, since it may have stalled while turning.
bool BackOff(Robot* robot) {
  robot->backing = robot->position->Stalled() && !robot->backing;
  if (robot->backing) robot->position->SetSpeed(-robot->rule.speed / 4, 0, 0);
  return robot->backing;
}

void Update(Robot* robot) {
  if (BackOff(robot)) return;
  ctrl::Surroundings seen;
  for (MountedSensor& mounted : robot->mounted_sensors) AddReadingsOf(*robot, &mounted, &seen);
  const ctrl::Drive drive = ctrl::Disperse(seen, robot->radius, robot->rule);
  robot->position->SetSpeed(drive.forward, 0, drive.turn);
}

/// Frame of the ranger's sensors on the robot. It is computed from local poses, which are bitwise
/// equal for all robots of a kind, so that they share tables.
Stg::Pose FrameOnRobot(const Stg::ModelRanger& ranger, const Stg::Model& robot) {
  Stg::Pose frame = ranger.GetPose() + ranger.GetGeom().pose;
  for (const Stg::Model* above = ranger.Parent(); above && above != &robot; above = above->Parent())
    frame = above->GetPose() + frame;
  return frame;
}

/// Radius of a disc about the model's origin that contains its body and the margin.
double RadiusOf(const Stg::Geom& geom, double margin) {
  return Stg::Hypotenuse(geom.pose.x, geom.pose.y) + Stg::Hypotenuse(geom.size.x, geom.size.y) / 2 +
         margin;
}

/// Subscribes to a ranger and uses all its sensors.
void Use(Stg::ModelRanger* ranger, const Stg::Model& model, Robot* robot) {
  const Stg::Pose frame = FrameOnRobot(*ranger, model);
  const auto& sensors = ranger->GetSensors();
  for (size_t i = 0; i < sensors.size(); i++)
    robot->mounted_sensors.push_back({ranger, i, frame + sensors[i].pose, 0, nullptr});
  ranger->Subscribe();
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("disperse", model);
  ctrl::DisperseRule& rule = robot->rule;
  ctrl::RequireArguments("disperse", *model, args->worldfile,
                         {{"speed", &rule.speed, 0, 1000},
                          {"gain", &rule.gain, 0, 1000},
                          {"turn", &rule.max_turn, 0, 1000},
                          {"margin", &rule.margin, 0, 1000},
                          {"horizon", &rule.horizon, 0, 1000}});
  robot->position = ctrl::RequirePosition("disperse", model);
  robot->radius = RadiusOf(model->GetGeom(), rule.margin);
  Stg::ModelRanger* first = ctrl::RequireUnusedRanger("disperse", model);
  ctrl::CallOnUpdateInParallel<Robot, Update>(first, robot);
  Use(first, *model, robot);
  while (Stg::Model* other = model->GetUnsubscribedModelOfType("ranger"))
    Use(static_cast<Stg::ModelRanger*>(other), *model, robot);
  robot->position->Subscribe();
  return 0;
}
