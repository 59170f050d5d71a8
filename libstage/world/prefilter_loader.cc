// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/prefilter_loader.hh"

#include "sensing/prefilter.hh"
#include "world/plugin.hh"

namespace Stg {

namespace {

template <typename Function>
Function FromPlugin(const char* symbol, std::string* message) {
  std::string error;
  void* plugin = OpenPlugin("stage_cl", &error);
  void* address = plugin ? FindSymbol(plugin, symbol, &error) : nullptr;
  if (!address) *message = "the OpenCL plug-in can't be loaded: " + error;
  return reinterpret_cast<Function>(address);
}

}  // namespace

std::unique_ptr<sensing::Prefilter> LoadPrefilter(const std::string& choice, std::string* message) {
  const auto make = FromPlugin<sensing::MakePrefilter>("stage_make_prefilter", message);
  if (!make) return nullptr;
  return std::unique_ptr<sensing::Prefilter>(make(choice.c_str(), message));
}

std::string ListDevices() {
  std::string text;
  const auto list = FromPlugin<sensing::ListDevices>("stage_list_devices", &text);
  if (!list) return text + "\n";
  list(&text);
  return text;
}

}  // namespace Stg
