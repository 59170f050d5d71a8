// SPDX-License-Identifier: GPL-2.0-or-later
//
// Checks whether robots start inside other bodies.

#include <algorithm>
#include <limits>

#include "geometry/trigonometry.hh"
#include "messages/report.hh"
#include "models/body.hh"
#include "world/load_checks.hh"
#include "worldfile/worldfile.hh"

namespace Stg {

namespace {

constexpr size_t kMaxNamedStarts = 10;  // number of robots that are named

/// Centre of a robot's own body, and the height range including all that it carries.
struct Spot {
  const ModelPosition* robot;
  point_t middle;
  Bounds z;
  int winding = 0;  // winding number of the current obstacle's outlines around the centre
};

void WidenHeights(const Model& model, Bounds* z) {
  const double lift = model.GetGlobalPose().z + model.GetGeom().pose.z;
  for (const auto& block : model.body().blocks()) {
    z->min = std::min(z->min, block->z_range().min + lift);
    z->max = std::max(z->max, block->z_range().max + lift);
  }
  for (const Model* child : model.GetChildren()) WidenHeights(*child, z);
}

Spot SpotOf(const ModelPosition& robot) {
  const double far = std::numeric_limits<double>::infinity();
  Spot spot{&robot, robot.LocalToGlobal(point_t(0, 0)), Bounds(far, -far)};
  WidenHeights(robot, &spot.z);
  return spot;
}

/// Updates the winding numbers of the spots to the left of an edge. `spots` are sorted by y.
void AddWinding(const point_t& from, const point_t& to, const Bounds& z, std::vector<Spot>* spots) {
  const double low = std::min(from.y, to.y), high = std::max(from.y, to.y);
  const auto below = [](const Spot& spot, double y) { return spot.middle.y < y; };
  auto spot = std::lower_bound(spots->begin(), spots->end(), low, below);
  for (; spot != spots->end() && spot->middle.y < high; ++spot) {
    const double x = from.x + (spot->middle.y - from.y) / (to.y - from.y) * (to.x - from.x);
    if (x > spot->middle.x && z.min < spot->z.max && spot->z.min < z.max)
      spot->winding += to.y > from.y ? 1 : -1;
  }
}

}  // namespace

void World::LoadChecks::CheckStarts() {
  std::vector<const ModelPosition*> free;
  CheckCollisions(&free);
  CheckInsides(std::move(free));
  if (starts_ > kMaxNamedStarts)
    wf_.Warn(0, "",
             "found " + std::to_string(starts_ - kMaxNamedStarts) +
                 " more robots that start inside other bodies");
}

void World::LoadChecks::WarnBlockedStart(const Model& robot, const Model& obstacle) {
  if (++starts_ > kMaxNamedStarts) return;
  WarnLikelyMistake(
      robot.wf_entity, "pose",
      "found robot " + messages::Quoted(robot.TokenStr()) + " where " +
          (&obstacle == world_.GetGround() ? "the floor" : messages::Quoted(obstacle.TokenStr())) +
          " is, expected free space; it may not be able to move");
}

/// Checks the outlines in the grid, which stop robots. `free` receives the robots that touch
/// nothing, or only other robots: programs often load robots in one place and move them later.
void World::LoadChecks::CheckCollisions(std::vector<const ModelPosition*>* free) {
  for (Model* model : engine_.models) {
    auto* const robot = dynamic_cast<ModelPosition*>(model);
    if (!robot || robot->parent || robot->wf_entity <= 0 || !robot->vis.obstacle_return) continue;
    engine_.placement.Propose(*robot, true);
    const Model* const obstacle = engine_.placement.Collision(world_.GetGround());
    if (obstacle && !dynamic_cast<const ModelPosition*>(obstacle->root))
      WarnBlockedStart(*robot, *obstacle);
    else
      free->push_back(robot);
  }
}

/// Finds robots inside obstacles. They touch nothing, because only outlines are rasterized.
void World::LoadChecks::CheckInsides(std::vector<const ModelPosition*> robots) {
  std::vector<Spot> spots;
  for (const ModelPosition* robot : robots) spots.push_back(SpotOf(*robot));
  std::ranges::stable_sort(spots, {}, [](const Spot& spot) { return spot.middle.y; });
  for (const Model* model : engine_.models) {
    if (dynamic_cast<const ModelPosition*>(model->root) || !model->vis.obstacle_return) continue;
    const double lift = model->GetGlobalPose().z + model->geom.pose.z;
    for (const auto& block : model->body().blocks()) {
      const Bounds z(block->z_range().min + lift, block->z_range().max + lift);
      std::vector<point_t> corners;
      for (const point_t& corner : block->points()) corners.push_back(model->LocalToGlobal(corner));
      for (size_t i = 0; i < corners.size(); i++)
        AddWinding(corners[i], corners[(i + 1) % corners.size()], z, &spots);
    }
    if (model->body().empty()) continue;
    for (Spot& spot : spots) {
      if (spot.winding != 0) WarnBlockedStart(*spot.robot, *model);
      spot.winding = 0;
    }
  }
}

}  // namespace Stg
