// SPDX-License-Identifier: GPL-2.0-or-later
//
// Metrics: numbers that summarize a run. In a world file, the section
//
//   metric ( name "driven" kind "distance" model "robot" )
//
// asks for one; World::Metrics() returns the values. docs/sweeps.md lists the kinds. A loaded
// library, such as a controller's, registers more kinds with
//
//   static const bool registered = Stg::RegisterMetric("loops", MakeLoops);
//
// Part of <stage.hh>; C++11.

#ifndef STAGE_WORLD_METRIC_HH
#define STAGE_WORLD_METRIC_HH

#include <stdint.h>

#include <memory>
#include <string>
#include <vector>

namespace Stg {

class Model;
class World;
class Worldfile;

/// A measurement of one run.
class Metric {
 public:
  virtual ~Metric() {}
  /// Called when the world has been loaded, reset or restored from a snapshot.
  virtual void Start(World& world) = 0;
  /// Called at the end of each step. May read the world, but not change it.
  virtual void Step(World& world) = 0;
  /// The value so far; NaN if there is none yet.
  virtual double Value() const = 0;
};

/// The request that a section makes.
struct MetricOrder {
  World* world;
  Worldfile* file;
  int entity;                    ///< the section; the metric may read further properties there
  std::vector<uint32_t> models;  ///< ids, see World::FindModel(); models may be deleted later
};

struct NamedMetric {
  std::string name;
  double value;  ///< NaN: no value
};

/// Creates a metric. May throw LoadError: see Worldfile::Fail().
typedef std::unique_ptr<Metric> (*MetricMaker)(const MetricOrder& order);

/// Registers a kind, replacing any earlier one of that name. Returns true.
bool RegisterMetric(const std::string& kind, MetricMaker maker);

}  // namespace Stg

#endif
