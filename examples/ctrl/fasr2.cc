// SPDX-License-Identifier: GPL-2.0-or-later
//
// fasr2: foraging for several kinds of flags in a large world, with planned paths.
//
//   ctrl "fasr2 red green"
//
// Each word is a task: carry flags from the model WORD_source to the model WORD_sink. Robots choose
// tasks at random, find their way through the model "cave", and recharge in the model "fuel_zone".
// A robot needs a power pack, sonars ranger:0, a laser ranger:1 and a fiducial finder that sees
// chargers. Rejects robots that lack one of these.

#include <deque>
#include <optional>

#include "support/arguments.hh"
#include "support/foraging.hh"
#include "support/path_planner.hh"

namespace {

constexpr double kRechargeBelow = 0.2;      // fraction of the power pack's capacity
constexpr double kChanceToGiveUp = 0.0005;  // per update while waiting for a flag
constexpr unsigned kPayload = 1;            // flags
constexpr double kGoalMoved = 0.5;          // m; replan if the goal has moved further
constexpr double kUndockedRange = 0.2;      // m
constexpr double kRearClearance = 0.2;      // m
constexpr size_t kRearSonars[] = {10, 11, 12, 13};
constexpr double kTurnTolerance = 0.05;  // rad
const Stg::Color kDelivered(0, 1, 0);

struct Task {
  Stg::Model *source, *sink;
  int participants;  // only for display
};

/// State shared by all robots of a world. It is a property of the cave and lives as long.
struct Shared {
  std::deque<Task> tasks;
  ctrl::PathPlanner planner;
};

/// A device that is subscribed to only while it is needed.
template <class Device>
struct Switched {
  Device* device = nullptr;
  bool on = false;

  void Switch(bool wanted) {
    if (wanted == on) return;
    on = wanted;
    if (on)
      device->Subscribe();
    else
      device->Unsubscribe();
  }
};

struct Robot {
  enum class Mode { kWork, kDock, kUndock };

  Stg::ModelPosition* position = nullptr;
  Switched<Stg::ModelRanger> laser, sonar;
  Switched<Stg::ModelFiducial> fiducial;
  Stg::PowerPack* power = nullptr;
  Stg::Model* fuel_zone = nullptr;
  Shared* shared = nullptr;

  Mode mode = Mode::kWork;
  Task* task = nullptr;
  Stg::Model* goal = nullptr;
  const ctrl::Path* path = nullptr;
  Stg::Pose path_from, path_to;  // endpoints that the path was planned for
  Stg::Pose planned_goal;
  ctrl::ObstacleState obstacles;
  ctrl::ChargerSight charger;
  double docked_heading = 0;
  bool waiting = false, force_recharge = false;

  enum { kMayNotFit };  // see KeptRobot

  bool Hungry() const { return force_recharge || power->ProportionRemaining() < kRechargeBelow; }
  bool Full() const { return power->ProportionRemaining() > ctrl::kStopChargingAt; }

  void ExchangeState(Stg::StateExchange& exchange);
};

// ---- goals

void Plan(Robot* robot, const Stg::Pose& target) {
  robot->path_from = robot->position->GetPose();
  robot->path_to = target;
  robot->path = robot->shared->planner.Plan(robot->path_from, robot->path_to);
}

/// Paths are not saved: they are found again from their endpoints.
void Robot::ExchangeState(Stg::StateExchange& exchange) {
  bool has_path = path != nullptr;
  uint32_t task_number = 0;
  while (&shared->tasks[task_number] != task) task_number++;
  int participants = task->participants;
  exchange(laser.on, sonar.on, fiducial.on, mode, task_number, participants, goal, has_path,
           path_from, path_to, planned_goal, obstacles, charger, docked_heading, waiting,
           force_recharge);
  if (!exchange.restoring() || exchange.failed()) return;
  if (task_number >= shared->tasks.size()) return exchange.Fail("found a task that is not there");
  task = &shared->tasks[task_number];
  task->participants = participants;
  path = has_path ? shared->planner.Plan(path_from, path_to) : nullptr;
}

void SetGoal(Robot* robot, Stg::Model* goal) {
  if (goal == robot->goal) return;
  robot->goal = goal;
  Plan(robot, goal->GetPose());
  robot->position->SetColor(goal->GetColor());
}

void ChooseTask(Robot* robot) {
  std::deque<Task>& tasks = robot->shared->tasks;
  robot->task = &tasks[robot->position->random().Choose(static_cast<uint32_t>(tasks.size()))];
  robot->task->participants++;
}

/// Handles the source. Returns false if the robot gives up waiting and will recharge.
bool Load(Robot* robot, bool inside) {
  const unsigned carried = robot->position->GetFlagCount();
  if (inside && carried == 0) robot->waiting = true;
  if (robot->waiting && robot->position->random().Uniform() < kChanceToGiveUp) {
    robot->force_recharge = true;
    robot->task->participants--;
    robot->waiting = false;
    return false;
  }
  if (inside && carried < kPayload) {
    robot->position->PushFlag(robot->task->source->PopFlag());
    if (robot->position->GetFlagCount() == kPayload) {
      robot->waiting = false;
      SetGoal(robot, robot->task->sink);
    }
  }
  return true;
}

void Unload(Robot* robot, bool inside) {
  if (!inside || robot->position->GetFlagCount() == 0) return;
  Stg::Model::Flag* flag = robot->position->PopFlag();
  flag->SetColor(kDelivered);
  robot->task->sink->PushFlag(flag);
  if (robot->position->GetFlagCount() == 0) SetGoal(robot, robot->task->source);
}

/// Returns false if this update is finished.
bool HandleFlags(Robot* robot) {
  const double distance = robot->position->GetPose().Distance(robot->goal->GetPose());
  const bool inside = distance < robot->goal->GetGeom().size.x / 2;
  if (robot->goal == robot->task->source) return Load(robot, inside);
  if (robot->goal == robot->task->sink) Unload(robot, inside);
  return true;
}

void LookForCharger(Robot* robot) {
  robot->charger.seen = false;
  if (!robot->fiducial.on) return;
  const Stg::ModelFiducial::Fiducial* nearest = nullptr;
  for (const auto& fiducial : robot->fiducial.device->GetFiducials())
    if (fiducial.id == ctrl::kChargerId && (!nearest || fiducial.range < nearest->range))
      nearest = &fiducial;
  if (nearest) robot->charger.Remember(*nearest);
}

// ---- driving

bool Avoid(Robot* robot) {
  return ctrl::AvoidObstaclesInTheWay(*robot->laser.device, robot->position, &robot->obstacles);
}

std::optional<double> Direction(const Robot& robot) {
  if (!robot.path) return std::nullopt;
  return ctrl::DirectionAlong(*robot.path, robot.position->GetPose());
}

/// Returns the planned heading, after replanning if necessary; east if there is no plan.
double HeadingToGoal(Robot* robot) {
  const Stg::Pose target = robot->goal->GetPose();
  std::optional<double> direction = Direction(*robot);
  if (!direction || target.Distance(robot->planned_goal) > kGoalMoved) {
    Plan(robot, target);
    robot->planned_goal = target;
    direction = Direction(*robot);
  }
  return direction.value_or(0.0);
}

void Work(Robot* robot) {
  if (Avoid(robot)) return;
  const bool hungry = robot->Hungry();
  if (hungry) SetGoal(robot, robot->fuel_zone);
  const double heading = HeadingToGoal(robot);
  if (hungry) {
    robot->fiducial.Switch(true);
    if (robot->charger.seen) robot->mode = Robot::Mode::kDock;
  }
  robot->position->SetTurnSpeed(Stg::normalize(heading - robot->position->GetPose().a));
  robot->position->SetXSpeed(ctrl::kCruiseSpeed);
}

/// Drives towards the visible charger and onto its axis.
void Approach(Robot* robot) {
  const ctrl::ChargerSight& charger = robot->charger;
  const double off_axis = Stg::normalize(M_PI - (charger.bearing - charger.heading));
  const double turn = Stg::normalize(charger.bearing - 2.0 * off_axis);
  if (charger.range <= ctrl::kDockingRange) {
    if (!ctrl::CreepIn(charger, turn, robot->position)) return;
    robot->docked_heading = robot->position->GetPose().a;
    robot->laser.Switch(false);
  } else if (!Avoid(robot)) {
    robot->position->SetXSpeed(ctrl::kCruiseSpeed);
    robot->position->SetTurnSpeed(turn);
  }
}

void Dock(Robot* robot) {
  if (robot->charger.seen) {
    Approach(robot);
  } else {
    robot->position->Stop();
    robot->fiducial.Switch(false);
    robot->laser.Switch(true);
    robot->mode = Robot::Mode::kWork;
  }
  if (!robot->Full()) return;
  robot->mode = Robot::Mode::kUndock;
  robot->sonar.Switch(true);
  robot->laser.Switch(true);
  robot->fiducial.Switch(true);
  robot->force_recharge = false;
}

bool ClearBehind(const Stg::ModelRanger& sonar) {
  const auto& sensors = sonar.GetSensors();
  for (const size_t i : kRearSonars)
    if (i < sensors.size() && (sensors[i].ranges.empty() || sensors[i].ranges[0] < kRearClearance))
      return false;
  return true;
}

void BackOut(Robot* robot) {
  const bool clear = ClearBehind(*robot->sonar.device);
  robot->position->SetXSpeed(clear ? -0.02 : 0.0);
  robot->position->Say(clear ? "" : "Waiting...");
}

void ReturnToWork(Robot* robot) {
  robot->mode = Robot::Mode::kWork;
  if (robot->position->GetFlagCount() == 0) {
    ChooseTask(robot);
    SetGoal(robot, robot->task->source);
  } else {
    SetGoal(robot, robot->task->sink);
  }
  robot->fiducial.Switch(false);
  robot->sonar.Switch(false);
}

/// Backs out of the charger, turns around and leaves.
void Undock(Robot* robot) {
  if (robot->charger.range < kUndockedRange) return BackOut(robot);
  const double off = Stg::normalize(robot->position->GetPose().a - (robot->docked_heading + M_PI));
  if (std::fabs(off) <= kTurnTolerance) return ReturnToWork(robot);
  robot->position->SetXSpeed(0);
  robot->position->SetTurnSpeed(off > 0 ? -0.3 : 0.3);
}

void Update(Robot* robot) {
  LookForCharger(robot);
  if (!HandleFlags(robot)) return;
  switch (robot->mode) {
    case Robot::Mode::kWork:
      return Work(robot);
    case Robot::Mode::kDock:
      return Dock(robot);
    case Robot::Mode::kUndock:
      return Undock(robot);
  }
}

// ---- set-up

std::deque<Task> MakeTasks(const Stg::Model& model, const std::string& ctrl_string) {
  const std::vector<std::string> words = ctrl::SplitWords(ctrl_string);
  if (words.size() < 2)
    ctrl::GiveUp("fasr2", model, "found no tasks, expected their names, as in \"fasr2 red green\"");
  std::deque<Task> tasks;
  for (size_t i = 1; i < words.size(); i++)
    tasks.push_back({ctrl::RequireModel("fasr2", model, words[i] + "_source"),
                     ctrl::RequireModel("fasr2", model, words[i] + "_sink"), 0});
  return tasks;
}

ctrl::PathPlanner MakePlanner(Stg::Model* cave) {
  const Stg::Size size = cave->GetGeom().size;
  std::vector<uint8_t> cells(ctrl::kMapSide * ctrl::kMapSide, 0);
  cave->Rasterize(cells.data(), ctrl::kMapSide, ctrl::kMapSide, size.x / ctrl::kMapSide,
                  size.y / ctrl::kMapSide);
  return ctrl::PathPlanner(std::move(cells), size.x, size.y);
}

/// Returns the shared state. The first robot's arguments define the tasks of all robots.
Shared* FindShared(const Stg::Model& model, const std::string& ctrl_string) {
  return ctrl::SharedInWorld<Shared>(model.GetWorld(), "fasr2", [&] {
    Stg::Model* cave = ctrl::RequireModel("fasr2", model, "cave");
    return Shared{MakeTasks(model, ctrl_string), MakePlanner(cave)};
  });
}

}  // namespace

extern "C" int Init(Stg::Model* model, Stg::CtrlArgs* args) {
  Robot* robot = ctrl::NewRobot<Robot>("fasr2", model);
  robot->position = ctrl::RequirePosition("fasr2", model);
  robot->power = ctrl::RequirePowerPack("fasr2", *model);
  robot->sonar.device = ctrl::RequireRanger("fasr2", *model, "ranger:0");
  robot->laser.device = ctrl::RequireRanger("fasr2", *model, "ranger:1");
  robot->fiducial.device = ctrl::RequireUnusedFiducial("fasr2", model);
  robot->fuel_zone = ctrl::RequireModel("fasr2", *model, "fuel_zone");
  robot->shared = FindShared(*model, args->worldfile);

  ChooseTask(robot);
  robot->goal = robot->task->source;
  robot->position->SetColor(robot->goal->GetColor());
  ctrl::CallOnUpdate<Robot, Update>(robot->position, robot);
  robot->position->Subscribe();
  robot->laser.Switch(true);
  return 0;
}
