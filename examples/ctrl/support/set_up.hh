// SPDX-License-Identifier: GPL-2.0-or-later
//
// Shared by the Init() functions of these controllers: finding devices, and giving up.

#ifndef EXAMPLES_CTRL_SUPPORT_SET_UP_HH
#define EXAMPLES_CTRL_SUPPORT_SET_UP_HH

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "arguments.hh"
#include "stage.hh"

namespace ctrl {

/// A command: metres per second and radians per second.
struct Drive {
  double forward = 0, turn = 0;
};

/// Makes loading the world fail, since a robot without its controller would make the run worthless.
/// Call within Init().
[[noreturn]] inline void GiveUp(const std::string& controller, const Stg::Model& model,
                                const std::string& reason) {
  throw std::runtime_error(controller + ": " + Stg::Printable(model.TokenStr(), 30) + ": " +
                           reason);
}

/// Returns the child of that name, without its parent's prefix, or null. Unlike Model::GetChild()
/// it does not warn, because a controller may try several names.
inline Stg::Model* FindChild(const Stg::Model& model, const std::string& name) {
  for (Stg::Model* child : model.GetChildren())
    if (child->TokenStr() == model.TokenStr() + "." + name) return child;
  return nullptr;
}

/// Returns the first child of this type for which fits(child) is true, or null.
template <class Type, class Fits>
Type* FindChildOfType(const Stg::Model& model, Fits fits) {
  for (Stg::Model* child : model.GetChildren())
    if (auto* const found = dynamic_cast<Type*>(child); found && fits(*found)) return found;
  return nullptr;
}

/// Returns the first child of this type, which is called `name` in messages. Gives up if there is
/// none.
template <class Type>
Type* RequireChild(const std::string& controller, const Stg::Model& model,
                   const std::string& name) {
  if (auto* const found = FindChildOfType<Type>(model, [](const Type&) { return true; }))
    return found;
  GiveUp(controller, model, "found no " + name + ", expected one on the robot");
}

/// Reads the arguments after the first word of a `ctrl` string. Gives up if one is wrong.
inline void RequireArguments(const std::string& controller, const Stg::Model& model,
                             const std::string& ctrl_string,
                             const std::vector<NumberArgument>& arguments) {
  const std::string mistake = ReadArguments(ctrl_string, arguments);
  if (!mistake.empty()) GiveUp(controller, model, mistake);
}

/// Returns the model as a position. Gives up if it is another type.
inline Stg::ModelPosition* RequirePosition(const std::string& controller, Stg::Model* model) {
  if (auto* position = dynamic_cast<Stg::ModelPosition*>(model)) return position;
  GiveUp(controller, *model,
         // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): the model is never null.
         "found a model of type " + model->GetModelType() +
             ", expected a position: this controller drives robots");
}

/// Returns the model's first ranger that no controller uses yet. Gives up if there is none.
inline Stg::ModelRanger* RequireUnusedRanger(const std::string& controller, Stg::Model* model) {
  Stg::Model* found = model->GetUnusedModelOfType("ranger");
  if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(found)) return ranger;
  GiveUp(controller, *model, "found no ranger that is not in use, expected one on the robot");
}

/// A callback that passes on its second argument with its type and stays registered. The customary
/// cast of the function pointer would be undefined behaviour.
template <class Robot, void (*kUpdate)(Robot*)>
int CallUpdate(Stg::Model*, void* user) {
  kUpdate(static_cast<Robot*>(user));
  return 0;
}

template <class Robot, void (*kUpdate)(Robot*)>
void CallOnUpdate(Stg::Model* sensor, Robot* robot) {
  sensor->AddCallback(Stg::Model::CB_UPDATE, CallUpdate<Robot, kUpdate>, robot);
}

/// Like CallOnUpdate(), but with Model::AddParallelCallback(): kUpdate may only access its robot.
template <class Robot, void (*kUpdate)(Robot*)>
void CallOnUpdateInParallel(Stg::Model* sensor, Robot* robot) {
  sensor->AddParallelCallback(Stg::Model::CB_UPDATE, CallUpdate<Robot, kUpdate>, robot);
}

/// Returns a function that draws an index below `choices` from the model's random numbers.
inline auto DrawFrom(Stg::Model* model) {
  return [model](unsigned choices) { return model->random().Choose(choices); };
}

/// True for types that carry state from one step to the next.
template <class Robot>
concept Remembers = requires(Robot robot, Stg::StateExchange& exchange) {
  robot.ExchangeState(exchange);
};

/// A robot whose ExchangeState() calls StateExchange::Fail() has a member kMayNotFit.
template <class Robot>
struct KeptRobot : Stg::StateKeeper {
  Robot robot;

  void ExchangeState(Stg::StateExchange& exchange) override {
    if constexpr (Remembers<Robot>) robot.ExchangeState(exchange);
  }
  bool FitsAlways() const override {
    return !requires { Robot::kMayNotFit; };
  }
};

/// Creates a controller's state for a robot. It lives as long as the model, and what its
/// ExchangeState() lists is part of the model's state.
template <class Robot>
Robot* NewRobot(const std::string& controller, Stg::Model* model) {
  const auto kept = std::make_shared<KeptRobot<Robot>>();
  model->Adopt(kept);
  if constexpr (Remembers<Robot>)
    model->KeepState(controller, kept.get());
  else
    model->DeclareNoState(controller);
  return &kept->robot;
}

/// Returns the state that all controllers of a kind share in a world. The first caller creates it;
/// it lives as long as the loaded world. `name` is a property of the world's ground.
template <class T, class Make>
T* SharedInWorld(Stg::World* world, const char* name, Make make) {
  Stg::Model* const ground = world->GetGround();
  if (void* found = ground->GetProperty(name)) return static_cast<T*>(found);
  const auto made = std::make_shared<T>(make());
  ground->Adopt(made);
  ground->SetProperty(name, made.get());
  return made.get();
}

}  // namespace ctrl

#endif
