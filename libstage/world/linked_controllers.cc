// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/linked_controllers.hh"

#include <map>
#include <mutex>

#include "messages/report.hh"

namespace Stg {

namespace {

struct Registry {
  std::mutex mutex;
  std::map<std::string, ControllerInit> controllers;

  Registry() {
    for (const auto& [name, init] : BuiltInControllers()) controllers.emplace(name, init);
  }
};

/// Made on first use, because programs may register controllers in static initializers.
Registry& TheRegistry() {
  static Registry registry;
  return registry;
}

}  // namespace

bool RegisterController(const std::string& name, ControllerInit init) {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  if (registry.controllers.emplace(name, init).second) return true;
  messages::Report(LogLevel::kError, "stage: the controller " + messages::Quoted(name) +
                                         " is registered already; the first one stays");
  return false;
}

ControllerInit FindLinkedController(const std::string& name) {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  const auto found = registry.controllers.find(name);
  return found == registry.controllers.end() ? nullptr : found->second;
}

std::vector<std::string> LinkedControllerNames() {
  Registry& registry = TheRegistry();
  const std::lock_guard lock(registry.mutex);
  std::vector<std::string> names;
  for (const auto& [name, init] : registry.controllers) names.push_back(name);
  return names;
}

}  // namespace Stg
