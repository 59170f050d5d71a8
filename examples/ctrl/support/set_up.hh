// SPDX-License-Identifier: GPL-2.0-or-later
//
// What the Init() functions of these controllers share: finding devices, and giving up.

#ifndef EXAMPLES_CTRL_SUPPORT_SET_UP_HH
#define EXAMPLES_CTRL_SUPPORT_SET_UP_HH

#include <memory>
#include <stdexcept>
#include <string>

#include "stage.hh"

namespace ctrl {

/// What a controller commands in one update: metres and radians per second.
struct Drive {
  double forward = 0, turn = 0;
};

/// Makes the loading of the world fail: a robot without its controller would make the whole run
/// worthless. To be called within Init().
[[noreturn]] inline void GiveUp(const std::string& controller, const Stg::Model& model,
                                const std::string& reason) {
  throw std::runtime_error(controller + ": " + Stg::Printable(model.TokenStr(), 30) + ": " +
                           reason);
}

/// The child of that name, without the one of its parent; null if there is none. Model::GetChild()
/// warns then, but a controller may look for several.
inline Stg::Model* FindChild(const Stg::Model& model, const std::string& name) {
  for (Stg::Model* child : model.GetChildren())
    if (child->TokenStr() == model.TokenStr() + "." + name) return child;
  return nullptr;
}

/// The model as a position model. Gives up if it is another one.
inline Stg::ModelPosition* RequirePosition(const std::string& controller, Stg::Model* model) {
  if (auto* position = dynamic_cast<Stg::ModelPosition*>(model)) return position;
  GiveUp(controller, *model,
         // NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage): the model is never null.
         "found a model of type " + model->GetModelType() +
             ", expected a position: this controller drives robots");
}

/// The model's first ranger that no controller has taken yet. Gives up if there is none.
inline Stg::ModelRanger* RequireUnusedRanger(const std::string& controller, Stg::Model* model) {
  Stg::Model* found = model->GetUnusedModelOfType("ranger");
  if (auto* ranger = dynamic_cast<Stg::ModelRanger*>(found)) return ranger;
  GiveUp(controller, *model, "found no ranger that is not in use, expected one on the robot");
}

/// A callback that stays registered and hands its second argument on with its type. A wrapper
/// instead of the customary cast of the function pointer, which is undefined behaviour.
template <class Robot, void (*kUpdate)(Robot*)>
int CallUpdate(Stg::Model*, void* user) {
  kUpdate(static_cast<Robot*>(user));
  return 0;
}

template <class Robot, void (*kUpdate)(Robot*)>
void CallOnUpdate(Stg::Model* sensor, Robot* robot) {
  sensor->AddCallback(Stg::Model::CB_UPDATE, CallUpdate<Robot, kUpdate>, robot);
}

/// The same, of a controller that keeps to its own robot: see Model::AddParallelCallback().
template <class Robot, void (*kUpdate)(Robot*)>
void CallOnUpdateInParallel(Stg::Model* sensor, Robot* robot) {
  sensor->AddParallelCallback(Stg::Model::CB_UPDATE, CallUpdate<Robot, kUpdate>, robot);
}

/// Chooses one of so many, counted from 0, by the model's own random numbers.
inline auto DrawFrom(Stg::Model* model) {
  return [model](unsigned choices) { return model->random().Choose(choices); };
}

/// Has something to remember from one step to the next.
template <class Robot>
concept Remembers = requires(Robot robot, Stg::StateExchange& exchange) {
  robot.ExchangeState(exchange);
};

template <class Robot>
struct KeptRobot : Stg::StateKeeper {
  Robot robot;

  void ExchangeState(Stg::StateExchange& exchange) override {
    if constexpr (Remembers<Robot>) robot.ExchangeState(exchange);
  }
};

/// What a controller knows of one more robot; it lives as long as the model. What it remembers,
/// which its ExchangeState() lists, is part of the model's state.
template <class Robot>
Robot* NewRobot(const std::string& controller, Stg::Model* model) {
  const auto kept = std::make_shared<KeptRobot<Robot>>();
  model->Adopt(kept);
  if constexpr (Remembers<Robot>)
    model->KeepState(controller, kept.get());
  else
    model->KeepsNoState(controller);
  return &kept->robot;
}

/// What all controllers of a kind share in a world; made by the first one, gone with what was
/// loaded. `name` is that of a property of the world's ground.
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
