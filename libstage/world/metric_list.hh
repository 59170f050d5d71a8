// SPDX-License-Identifier: GPL-2.0-or-later
//
// The metrics of a world.

#ifndef STAGE_WORLD_METRIC_LIST_HH
#define STAGE_WORLD_METRIC_LIST_HH

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "models/model.hh"
#include "world/metric.hh"

namespace Stg {

class MetricList {
 public:
  /// Those that the file asks for, in place of all that there were. `made`: the model of each
  /// entity, or null. Throws LoadError.
  void Load(World* world, Worldfile* file, const std::vector<Model*>& made);
  void Clear();
  /// Forgets what was set, too.
  void Start(World& world);
  void Step(World& world) {
    for (const Entry& entry : entries_) entry.metric->Step(world);
  }
  /// Of somebody's own counting, such as a controller's.
  void Set(const std::string& name, double value) { set_[name] = value; }
  /// Those of the file in its order, then those that were set, by name.
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
