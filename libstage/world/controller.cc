// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/controller.hh"

#include <memory>
#include <vector>

#include "geometry/load_error.hh"
#include "messages/report.hh"
#include "models/model.hh"
#include "world/plugin.hh"
#include "world/world.hh"

namespace Stg {

void LoadController(Model* model, const std::string& text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string::npos) throw LoadError("found an empty controller name", 255);
  const std::string name = text.substr(begin, text.find_first_of(" \t", begin) - begin);

  std::string error;
  void* library = OpenPlugin(name, &error);
  void* init = library ? FindSymbol(library, "Init", &error) : nullptr;
  if (!init)
    throw LoadError("controller " + messages::Quoted(name) + " can't be " +
                        (library ? "used" : "loaded") + ": " +
                        messages::Shortened(error, messages::kLongestDetail) +
                        (library ? "" : "; STAGEPATH names further folders to look in"),
                    255);

  // Controllers may keep the pointer for as long as they like, and libraries are never closed.
  static std::vector<std::unique_ptr<CtrlArgs>> all_arguments;
  all_arguments.push_back(std::make_unique<CtrlArgs>(text, World::ctrlargs));
  model->AddCallback(Model::CB_INIT, reinterpret_cast<model_callback_t>(init),
                     all_arguments.back().get());
}

}  // namespace Stg
