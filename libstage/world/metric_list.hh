// SPDX-License-Identifier: GPL-2.0-or-later
//
// The metrics of a world: those that its file asks for, and values set by clients.

#ifndef STAGE_WORLD_METRIC_LIST_HH
#define STAGE_WORLD_METRIC_LIST_HH

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/model.hh"
#include "world/metric.hh"

namespace Stg {

/// The kinds of this library.
std::map<std::string, MetricMaker> BuiltInMetrics();

class MetricList {
 public:
  /// Replaces all metrics by those that the file asks for. `made` has the model of each entity, or
  /// null. Throws LoadError.
  void Load(World* world, Worldfile* file, const std::vector<Model*>& made);
  void Clear();
  /// Starts all metrics anew and drops the values that were set.
  void Start(World& world);
  void Step(World& world) {
    for (const Entry& entry : entries_) entry.metric->Step(world);
  }
  /// Sets a value that a client, such as a controller, computed itself.
  void Set(const std::string& name, double value) { set_[name] = value; }
  /// The file's metrics in its order, then the set values by name.
  std::vector<NamedMetric> Values() const;

 private:
  struct Entry {
    std::string name;
    std::unique_ptr<Metric> metric;
  };
  std::vector<Entry> entries_;
  std::map<std::string, double> set_;
};

}  // namespace Stg

#endif
