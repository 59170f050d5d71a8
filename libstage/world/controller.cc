// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers: plug-ins, or linked code, that control models.

#include <memory>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/exception_origin.hh"
#include "models/model.hh"
#include "world/engine.hh"
#include "world/linked_controllers.hh"
#include "world/plugin.hh"
#include "world/world.hh"

namespace Stg {

namespace {

/// The controller's text in the world file, or "" if `arguments` are not a controller's.
std::string TextOf(const void* arguments, const WorldEngine& engine) {
  for (const auto& known : engine.controller_arguments)
    if (known.get() == arguments) return known->worldfile;
  return "";
}

std::string FirstWord(const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_first_of(" \t", begin) - begin);
}

}  // namespace

/// Kept short because the line also names the place, the controller and the model.
constexpr size_t kMaxReasonBytes = 140;

std::string WorldEngine::DescribeInitFailure(const std::string& model_name,
                                             const void* arguments) const {
  const std::string controller = FirstWord(TextOf(arguments, *this));
  return (controller.empty() ? "a callback of type CB_INIT"
                             : "Init() of the controller " + messages::Quoted(controller)) +
         " of the model " + messages::Quoted(model_name) + " has thrown " +
         messages::Shortened(DescribeException(), kMaxReasonBytes);
}

void WorldEngine::LoadController(Model* model, const std::string& text) {
  const std::string name = FirstWord(text);
  if (name.empty()) throw LoadError("found an empty controller name", 255);

  std::string error;
  ControllerInit init = FindLinkedController(name);
  if (!init) init = FindControllerInit(name, &error);
  if (!init) throw LoadError("controller " + messages::Quoted(name) + " " + error, 255);
  controller_arguments.push_back(std::make_unique<CtrlArgs>(text, World::ctrlargs));
  model->AddCallback(Model::CB_INIT, reinterpret_cast<model_callback_t>(init),
                     controller_arguments.back().get());
}

}  // namespace Stg
