// SPDX-License-Identifier: GPL-2.0-or-later
//
// Finds commands that nobody obeys. A future with them would be that of a robot that stands, or
// that goes on as its controller wants, and others would look safe.

#ifndef STAGE_WHATIF_COMMAND_CHECK_HH
#define STAGE_WHATIF_COMMAND_CHECK_HH

#include <cstdint>
#include <string>
#include <vector>

#include "models/position.hh"
#include "whatif/branches.hh"

namespace Stg {

class Model;

/// Thrown in a step of a branch that must fail because of a command.
struct CommandRefused {
  std::string why;  ///< one line
};

/// The commands of a branch with a World that a controller may still replace.
class CommandCheck {
 public:
  /// The kind of a robot's present command. `numbers`: its speeds, accelerations or goal.
  static ModelPosition::ControlMode CommandOf(const ModelPosition& robot, Pose* numbers);
  /// Throws CommandRefused if nobody obeys the command. `model` is the one with its number, in the
  /// branch or in the prototype of a scene; null if there is none.
  static void Check(const Command& command, const Model* model);
  /// Throws CommandRefused if the robot has to move but cannot. `runs`: it has subscribers.
  static void CheckMotion(const Command& command, const Model& robot, bool runs);
  /// Why a command is refused that came after its step.
  static std::string TooLate(const Command& command, uint64_t steps);

  /// Notes that a robot has been given a command.
  void Note(const Command& command, const World& world);
  /// Called before a step, after the commands were given: throws CommandRefused if a controller has
  /// replaced a command in the last step, and there is no newer one.
  void CheckReplaced(const World& world) const;
  /// Called immediately before a step: throws CommandRefused if a robot that was just given a
  /// command cannot move.
  void BeginStep(const World& world, uint64_t step);
  /// Called immediately after a step.
  void EndStep(const World& world);
  void Clear() { given_.clear(); }

 private:
  /// A command that is in force before the present step.
  struct Given {
    Command command;
    uint64_t end;      ///< from this step on, a controller may replace it
    bool is_replaced;  ///< a controller has replaced it in the last step
  };

  static bool IsInForce(const Command& command, const World& world);

  std::vector<Given> given_;  // at most one for each robot
};

}  // namespace Stg

#endif
