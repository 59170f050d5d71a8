// SPDX-License-Identifier: GPL-2.0-or-later

#include "world/metric_list.hh"

#include <algorithm>
#include <mutex>
#include <set>
#include <utility>

#include "messages/report.hh"
#include "models/position.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

struct Kinds {
  std::mutex mutex;
  std::map<std::string, MetricMaker> makers = BuiltInMetrics();
};

/// Never destroyed: plug-ins may register kinds, and worlds end, at any time.
Kinds& AllKinds() {
  static Kinds& kinds = *new Kinds;
  return kinds;
}

MetricMaker FindMaker(const Worldfile& file, int entity, const std::string& kind) {
  Kinds& kinds = AllKinds();
  const std::lock_guard<std::mutex> lock(kinds.mutex);
  const auto found = kinds.makers.find(kind);
  if (found != kinds.makers.end()) return found->second;
  std::string known;
  for (const auto& [name, maker] : kinds.makers) known += (known.empty() ? "" : ", ") + name;
  file.Fail(entity, "kind", "found " + messages::Quoted(kind) + ", expected one of " + known);
}

bool IsMember(const Worldfile& file, const std::string& population, int entity) {
  return std::ranges::any_of(file.populations(), [&](const Population& other) {
    return other.name == population && std::ranges::count(other.members, entity) > 0;
  });
}

/// Models that the section's `model` selects by type, name or population. Without it, all position
/// models.
std::vector<uint32_t> ModelsOf(Worldfile* file, int entity, const std::vector<Model*>& made) {
  const std::string selector = file->ReadString(entity, "model", "");
  std::vector<uint32_t> models;
  const auto is_meant = [&](int other, Model* model) {
    if (selector.empty()) return dynamic_cast<ModelPosition*>(model) != nullptr;
    return file->IsCalled(other, selector) || IsMember(*file, selector, other);
  };
  for (size_t other = 1; other < made.size(); other++)
    if (made[other] && is_meant(static_cast<int>(other), made[other]))
      models.push_back(made[other]->GetId());
  if (models.empty() && !selector.empty())
    file->Fail(entity, "model",
               "found no model that is called " + messages::Quoted(selector) +
                   ", expected a type, or the name of a model or of a population");
  return models;
}

}  // namespace

bool RegisterMetric(const std::string& kind, MetricMaker maker) {
  Kinds& kinds = AllKinds();
  const std::lock_guard<std::mutex> lock(kinds.mutex);
  kinds.makers[kind] = maker;
  return true;
}

void MetricList::Load(World* world, Worldfile* file, const std::vector<Model*>& made) {
  Clear();
  std::set<std::string> names;
  for (int entity = 1; entity < file->GetEntityCount(); entity++) {
    if (file->GetEntityType(entity) != std::string("metric")) continue;
    const std::string kind = file->ReadString(entity, "kind", "");
    const std::string name = file->ReadString(entity, "name", kind);
    const MetricMaker make = FindMaker(*file, entity, kind);
    if (!names.insert(name).second)
      file->Fail(entity, "name",
                 "found a second metric " + messages::Quoted(name) + ", expected another name");
    entries_.push_back({name, make({world, file, entity, ModelsOf(file, entity, made)})});
  }
  Start(*world);
}

void MetricList::Clear() {
  entries_.clear();
  set_.clear();
}

void MetricList::Start(World& world) {
  set_.clear();
  for (const Entry& entry : entries_) entry.metric->Start(world);
}

std::vector<NamedMetric> MetricList::Values() const {
  std::vector<NamedMetric> values;
  for (const Entry& entry : entries_) values.push_back({entry.name, entry.metric->Value()});
  for (const auto& [name, value] : set_) values.push_back({name, value});
  return values;
}

}  // namespace Stg
