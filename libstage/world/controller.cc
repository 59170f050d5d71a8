// SPDX-License-Identifier: GPL-2.0-or-later
//
// Controllers: plug-ins, or linked code, that control models.

#include <memory>
#include <vector>

#include "control/stock_controllers.hh"
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

/// The names of the built-in controllers, if the name looks like one of them.
std::string BuiltInNames(const std::string& name) {
  if (!name.starts_with("stage/")) return "";
  std::string names;
  for (const auto& [known, controller] : control::StockControllers())
    names += (names.empty() ? "; built-in controllers are " : ", ") + known;
  return names;
}

/// A CB_INIT callback that is called once.
int AttachBatchController(Model* model, void* user) {
  const auto& arguments = *static_cast<const BatchArguments*>(user);
  arguments.engine->batch_controls.Attach(model, arguments);
  return 1;
}

/// The reason that an exception of BatchController::Prepare() gives. Call it in the handler.
std::string ReasonOfException() {
  try {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return "it has thrown " + DescribeException();
  }
}

}  // namespace

/// Kept short because the line also names the place, the controller and the model.
constexpr size_t kMaxReasonBytes = 140;

std::string WorldEngine::DescribeInitFailure(const std::string& model_name,
                                             const void* arguments) const {
  for (const auto& known : batch_arguments)
    if (known.get() == arguments)
      return "controller " + messages::Quoted(known->name) + " of the model " +
             messages::Quoted(model_name) + ": " +
             messages::Shortened(ReasonOfException(), kMaxReasonBytes);
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
  ControllerCode code = FindLinkedController(name);
  if (!code) code = FindPluginController(name, &error);
  if (!code)
    throw LoadError("controller " + messages::Quoted(name) + " " + error + BuiltInNames(name), 255);
  if (code.batch) {
    batch_arguments.push_back(
        std::make_unique<BatchArguments>(BatchArguments{this, code.batch, name, text}));
    model->AddCallback(Model::CB_INIT, AttachBatchController, batch_arguments.back().get());
    return;
  }
  controller_arguments.push_back(std::make_unique<CtrlArgs>(text, World::ctrlargs));
  model->AddCallback(Model::CB_INIT, reinterpret_cast<model_callback_t>(code.init),
                     controller_arguments.back().get());
}

}  // namespace Stg
