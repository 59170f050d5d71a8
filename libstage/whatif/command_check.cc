// SPDX-License-Identifier: GPL-2.0-or-later

#include "whatif/command_check.hh"

#include <algorithm>
#include <cmath>

#include "messages/report.hh"
#include "models/model.hh"
#include "models/position.hh"
#include "models/property_checks.hh"
#include "whatif/command_values.hh"
#include "world/world.hh"

namespace Stg {

namespace {

std::string Refusal(const Command& command, const Model* model, const std::string& why) {
  const std::string to =
      model ? messages::Quoted(model->TokenStr()) : "model " + std::to_string(command.model);
  return "the command before step " + std::to_string(command.step) + " to " + to +
         " is refused: " + why;
}

using whatif::ValueOf;

const ModelPosition* RobotOf(const Command& command, const World& world) {
  return dynamic_cast<const ModelPosition*>(world.FindModel(command.model));
}

bool WantsToStand(const Command& command) {
  return command.kind == Command::kStop ||
         (command.kind == Command::kSetSpeed && command.x == 0 && command.y == 0 && command.a == 0);
}

/// Why the numbers of a command make no sense, or "".
std::string WhyNotNumbers(const Command& command) {
  const Pose value = ValueOf(command);
  if (command.kind == Command::kGoTo && !IsFinite(value)) return "the goal is not finite";
  if (std::isnan(value.x) || std::isnan(value.y) || std::isnan(value.a))
    return "a number is missing (NaN)";
  return "";
}

/// Greatest number of steps from one update of a model of the tree to the next.
uint64_t StepsOfInterval(const Model& model, usec_t step) {
  uint64_t steps = (model.GetUpdateInterval() + step - 1) / step;
  for (const Model* child : model.GetChildren())
    steps = std::max(steps, StepsOfInterval(*child, step));
  return std::max<uint64_t>(1, steps);
}

}  // namespace

ModelPosition::ControlMode CommandCheck::CommandOf(const ModelPosition& robot, Pose* numbers) {
  *numbers = robot.goal;
  return robot.control_mode;
}

void CommandCheck::Check(const Command& command, const Model* model) {
  const auto refuse = [&](const std::string& why) {
    throw CommandRefused{Refusal(command, model, why)};
  };
  if (!model) refuse("there is no such model; take its number from Model::GetId()");
  const auto* const robot = dynamic_cast<const ModelPosition*>(model);
  if (!robot) refuse("it is a " + model->GetModelType() + ", expected a position");
  if (const std::string why = WhyNotNumbers(command); !why.empty()) refuse(why);
  if (robot->drive_mode == ModelPosition::DRIVE_CAR && command.kind != Command::kSetSpeed &&
      command.kind != Command::kStop)
    refuse("it is a car, which obeys kSetSpeed and kStop only");
  if (model->batch_controllers_ > 0)
    refuse(
        "its controller replaces each command; take it out of `ctrl` in the world file of the "
        "branches");
}

void CommandCheck::CheckMotion(const Command& command, const Model& robot, bool runs) {
  if (WantsToStand(command) || (runs && robot.IsEnabled())) return;
  const char* const why =
      runs ? "it stands because it is disabled; Enable() it before World::Take()"
           : "it stands because it has no subscribers; Subscribe() to it before World::Take(), or "
             "give it alwayson 1 in the world file";
  throw CommandRefused{Refusal(command, &robot, why)};
}

std::string CommandCheck::TooLate(const Command& command, uint64_t steps) {
  return "the command before step " + std::to_string(command.step) + " to model " +
         std::to_string(command.model) + " is refused: " + std::to_string(steps) +
         " steps have been made already";
}

/// True if the robot's command is the given one.
bool CommandCheck::IsInForce(const Command& command, const World& world) {
  const ModelPosition* const robot = RobotOf(command, world);
  return robot && int{robot->control_mode} == int{whatif::ModeOf(command.kind)} &&
         robot->goal == ValueOf(command);
}

void CommandCheck::Note(const Command& command, const World& world) {
  std::erase_if(given_, [&](const Given& given) { return given.command.model == command.model; });
  const Model& robot = *RobotOf(command, world);
  given_.push_back({command, command.step + StepsOfInterval(robot, world.sim_interval), false});
}

void CommandCheck::CheckReplaced(const World& world) const {
  for (const Given& given : given_)
    if (given.is_replaced)
      throw CommandRefused{Refusal(given.command, world.FindModel(given.command.model),
                                   "a controller has replaced it; take that out of `ctrl` in the "
                                   "world file of the branches, or tell it what to do in "
                                   "Scenario::BeforeStep() or Judge::Begin()")};
}

void CommandCheck::BeginStep(const World& world, uint64_t step) {
  std::erase_if(given_, [&](const Given& given) {
    return step >= given.end || !IsInForce(given.command, world);
  });
  for (Given& given : given_) {
    const ModelPosition& robot = *RobotOf(given.command, world);
    if (given.command.step == step) CheckMotion(given.command, robot, robot.HasSubscribers());
  }
}

void CommandCheck::EndStep(const World& world) {
  for (Given& given : given_)
    given.is_replaced =
        RobotOf(given.command, world) != nullptr && !IsInForce(given.command, world);
}

}  // namespace Stg
