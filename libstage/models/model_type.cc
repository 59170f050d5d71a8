// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/model_type.hh"

#include <atomic>
#include <mutex>
#include <shared_mutex>

#include "messages/report.hh"
#include "models/model_type_list.hh"
#include "models/model_type_names.hh"

namespace Stg {

namespace {

// Types are never removed, so lookups need no lock.
struct Node {
  ModelType type;
  std::atomic<Node*> next{nullptr};
};
std::atomic<Node*> oldest{nullptr};

// Guards names_are_kept, Model::name_map and the adding of types. Threads that create models only
// take it shared.
std::shared_mutex mutex;
bool names_are_kept = false;  // Model::name_map has been filled

/// Calls f(type) for each type in the order of registration until it returns false.
template <typename F>
void ForEachType(F f) {
  const Node* node = oldest.load(std::memory_order_acquire);
  while (node && f(node->type)) node = node->next.load(std::memory_order_acquire);
}

/// Returns the first registered type for which `fits` is true, or null.
template <typename F>
const ModelType* FindType(F fits) {
  const ModelType* found = nullptr;
  ForEachType([&](const ModelType& type) {
    if (fits(type)) found = &type;
    return !found;
  });
  return found;
}

void Append(const ModelType& type) {
  std::atomic<Node*>* end = &oldest;
  while (Node* node = end->load(std::memory_order_relaxed)) end = &node->next;
  end->store(new Node{type}, std::memory_order_release);
}

/// Registers the built-in types before all others. Static initializers would not do: a linker omits
/// files of a static library that only have these. Call it with the mutex held.
void AppendBuiltInTypes() {
  if (oldest.load(std::memory_order_relaxed)) return;
  for (const ModelType& type : BuiltInModelTypes()) Append(type);
}

}  // namespace

bool RegisterModelType(const ModelType& type) {
  const std::lock_guard lock(mutex);
  AppendBuiltInTypes();
  if (FindType([&](const ModelType& known) { return known.name == type.name; })) {
    messages::Report(LogLevel::kError, "stage: the model type " + messages::Quoted(type.name) +
                                           " is registered already; the first one stays");
    return false;
  }
  Append(type);
  if (names_are_kept) Model::name_map[type.name] = type.create;
  return true;
}

const ModelType* FindModelType(const Model& model) {
  // Cached, as it is needed for each model in each step. All threads compute the same value.
  const std::atomic_ref<const ModelType*> known(model.known_type_);
  if (const ModelType* const type = known.load(std::memory_order_relaxed)) return type;
  const std::type_info& of = typeid(model);
  const ModelType* const found = FindType([&](const ModelType& type) { return *type.of == of; });
  known.store(found, std::memory_order_relaxed);
  return found;
}

const ModelType* FindNearestModelType(const Model& model) {
  const ModelType* nearest = FindModelType(model);
  if (nearest) return nearest;
  // Derived types are registered after their bases.
  ForEachType([&](const ModelType& type) {
    if (*type.of != typeid(Model) && type.is(model)) nearest = &type;
    return true;
  });
  return nearest;
}

const ModelType* FindSensorType(const Model& model) {
  const ModelType* nearest = nullptr;
  for (const ModelType* type : SensorTypes())
    if (type->is(model)) nearest = type;
  return nearest;
}

std::vector<const ModelType*> SensorTypes() {
  std::vector<const ModelType*> types;
  ForEachType([&](const ModelType& type) {
    if (!type.readings.empty()) types.push_back(&type);
    return true;
  });
  return types;
}

creator_t FindCreator(const std::string& type) {
  const std::shared_lock lock(mutex);
  const auto found = Model::name_map.find(type);
  return found == Model::name_map.end() ? nullptr : found->second;
}

std::vector<std::string> ModelTypeNames() {
  const std::shared_lock lock(mutex);
  std::vector<std::string> names;
  for (const auto& [name, creator] : Model::name_map) names.push_back(name);
  return names;
}

void NameModelTypes() {
  const std::lock_guard lock(mutex);
  AppendBuiltInTypes();
  ForEachType([](const ModelType& type) {
    Model::name_map[type.name] = type.create;
    return true;
  });
  names_are_kept = true;
}

}  // namespace Stg
