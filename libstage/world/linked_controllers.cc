// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/linked_controllers.hh"

#include <map>
#include <mutex>

#include "control/stock_controllers.hh"
#include "messages/report.hh"

namespace Stg {

namespace {

struct Registry {
  std::mutex mutex;
  std::map<std::string, ControllerCode> controllers;

  Registry() {
    for (const auto& [name, init] : BuiltInControllers())
      controllers.emplace(name, ControllerCode{init, nullptr});
    for (const auto& [name, batch] : control::StockControllers())
      controllers.emplace(name, ControllerCode{nullptr, batch});
  }
};

/// Made on first use, because programs may register controllers in static initializers.
Registry& TheRegistry() {
  static Registry registry;
  return registry;
}

bool Register(const std::string& name, const ControllerCode& code) {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  if (registry.controllers.emplace(name, code).second) return true;
  messages::Report(LogLevel::kError, "stage: the controller " + messages::Quoted(name) +
                                         " is registered already; the first one stays");
  return false;
}

}  // namespace

bool RegisterController(const std::string& name, ControllerInit init) {
  return Register(name, {init, nullptr});
}

bool RegisterBatchController(const std::string& name, const BatchController* controller) {
  return Register(name, {nullptr, controller});
}

ControllerCode FindLinkedController(const std::string& name) {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  const auto found = registry.controllers.find(name);
  return found == registry.controllers.end() ? ControllerCode() : found->second;
}

std::vector<std::string> LinkedControllerNames() {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  std::vector<std::string> names;
  for (const auto& [name, code] : registry.controllers) names.push_back(name);
  return names;
}

}  // namespace Stg
