// SPDX-License-Identifier: GPL-2.0-or-later
//
// Metrics: numbers that tell how a run went. A section
//
//   metric ( name "driven" kind "distance" model "robot" )
//
// of a world file asks for one; World::Metrics() has what they come to. docs/sweeps.md lists the
// kinds. A library that is loaded into the program, such as a controller's, brings more with
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

/// What is measured of one run.
class Metric {
 public:
  virtual ~Metric() {}
  /// From here on: the world has been loaded, reset, or taken back to a snapshot.
  virtual void Start(World& world) = 0;
  /// At the end of each step. It may look at the world, not change it.
  virtual void Step(World& world) = 0;
  /// So far; not a number if there is nothing to tell yet.
  virtual double Value() const = 0;
};

/// What a section asks for.
struct MetricOrder {
  World* world;
  Worldfile* file;
  int entity;                    ///< the section, for properties of the kind's own
  std::vector<uint32_t> models;  ///< numbers, see World::FindModel(); one may be gone later
};

struct NamedMetric {
  std::string name;
  double value;  ///< may be not a number: there is none
};

/// May throw LoadError: see Worldfile::Fail().
typedef std::unique_ptr<Metric> (*MetricMaker)(const MetricOrder& order);

/// True. The last one of a name counts.
bool RegisterMetric(const std::string& kind, MetricMaker maker);

}  // namespace Stg

#endif
