// SPDX-License-Identifier: GPL-2.0-or-later
//
// Looks through a world that has just been loaded for what its file says by mistake more often than
// on purpose: bodies that no sensor sees, sensors that look over everybody, pictures that were
// stretched, robots that start inside of something. Each gets a warning with its place.

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

class World::LoadChecks {
 public:
  explicit LoadChecks(World* world) : world_(*world), engine_(*world->engine_), wf_(*world->wf) {}

  /// All bodies have to be drawn.
  void Run();

 private:
  void CheckSize(const Model& model);
  void CheckHeight(const Model& model);
  void CheckPicture(const Model& model);
  void CheckRangers();
  bool FindSeenRobots();
  void CheckRanger(const ModelRanger& ranger);
  bool SeesRobot(double z, const Model* own_root) const;
  void CheckStarts();
  void CheckCollisions(std::vector<const ModelPosition*>* free);
  void CheckInsides(std::vector<const ModelPosition*> robots);
  void TellStart(const Model& robot, const Model& obstacle);

  int FirstBlockOf(int entity);
  /// Warns, once for each place and message, and keeps the line for --explain.
  void Doubt(int entity, const char* property, const std::string& message);

  World& world_;
  WorldEngine& engine_;
  Worldfile& wf_;
  std::set<std::string> told_;
  std::map<int, int> first_blocks_;  // entities of blocks, by those of their models
  /// Heights from and to which rangers see robots, with two of the robots that are seen there.
  std::map<std::pair<double, double>, std::array<const Model*, 2>> seen_robots_;
  size_t starts_ = 0;  // robots that start inside of something
};

}  // namespace Stg

#endif
