// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks a newly loaded world for likely mistakes in its file: bodies that no sensor sees, sensors
// that look over all robots, stretched pictures, robots that start inside other bodies. Each gives
// a warning with its place.

#ifndef STAGE_WORLD_LOAD_CHECKS_HH
#define STAGE_WORLD_LOAD_CHECKS_HH

#include <array>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "models/model.hh"
#include "models/position.hh"
#include "models/ranger.hh"
#include "world/engine.hh"
#include "world/world.hh"

namespace Stg {

/// Throws LoadError if a ground sensor names no field. `made` has the model of each entity, or
/// null.
void CheckFieldNames(const Host& host, const std::vector<Model*>& made, const Worldfile& wf);

class World::LoadChecks {
 public:
  explicit LoadChecks(World* world) : world_(*world), engine_(*world->engine_), wf_(*world->wf) {}

  /// All bodies must have been rasterized.
  void Run();

 private:
  void CheckSize(const Model& model);
  void CheckHeight(const Model& model);
  void CheckPicture(const Model& model);
  void CheckAcceleration(const Model& model);
  void CheckRangers();
  bool FindSeenRobots();
  void CheckRanger(const ModelRanger& ranger);
  bool SeesRobot(double z, const Model* own_root) const;
  void CheckStarts();
  void CheckCollisions(std::vector<const ModelPosition*>* free);
  void CheckInsides(std::vector<const ModelPosition*> robots);
  void WarnBlockedStart(const Model& robot, const Model& obstacle);

  int FirstBlockOf(int entity);
  /// Keeps the line for --explain. Returns false if it is there already.
  bool Keep(const std::string& line);
  /// Warns once per place and message, and keeps the line for --explain.
  void WarnLikelyMistake(int entity, const char* property, const std::string& message);

  World& world_;
  WorldEngine& engine_;
  Worldfile& wf_;
  std::set<std::string> warned_;
  std::map<int, int> first_blocks_;  // block entities by the entities of their models
  /// Height intervals in which rangers see robots, each with two of the robots.
  std::map<std::pair<double, double>, std::array<const Model*, 2>> seen_robots_;
  size_t starts_ = 0;  // number of robots that start inside other bodies
};

}  // namespace Stg

#endif
