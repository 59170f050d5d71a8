// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/occupancy_map.hh"

#include <algorithm>
#include <cmath>
#include <set>

#include "grid/outline.hh"
#include "models/body.hh"
#include "models/placement.hh"
#include "models/position.hh"

namespace Stg::recording {

namespace {

constexpr double kMaxCells = 4e6;
constexpr int8_t kOccupied = 100;

using Outline = std::vector<point_t>;  // in global coordinates

bool IsScenery(const Model& model) {
  const Visibility& vis = model.vis;
  return (vis.obstacle_return || vis.ranger_return >= 0) && !vis.gripper_return;
}

/// Returns the roots of all trees that contain a robot.
std::set<const Model*> RootsOfRobots(const std::vector<Model*>& models) {
  std::set<const Model*> roots;
  for (const Model* model : models)
    if (dynamic_cast<const ModelPosition*>(model) || model->IsPushable())
      roots.insert(model->Root());
  return roots;
}

std::vector<Outline> OutlinesOf(const std::vector<Model*>& models) {
  const std::set<const Model*> robots = RootsOfRobots(models);
  std::vector<Outline> outlines;
  for (const Model* model : models) {
    // The floor is not scenery; it has outlines only where it is walled in.
    if (model->GetId() == 0 || robots.contains(model->Root()) || !IsScenery(*model)) continue;
    const Pose frame = model->GetGlobalPose() + model->GetGeom().pose;
    for (const auto& block : model->body().blocks()) {
      Outline& outline = outlines.emplace_back();
      for (const point_t& corner : block->points()) {
        const Pose global = frame + Pose(corner.x, corner.y, 0, 0);
        outline.emplace_back(global.x, global.y);
      }
    }
  }
  return outlines;
}

}  // namespace

OccupancyMap MakeOccupancyMap(const std::vector<Model*>& models, double cell) {
  const std::vector<Outline> outlines = OutlinesOf(models);
  Bounds x(HUGE_VAL, -HUGE_VAL), y(HUGE_VAL, -HUGE_VAL);
  for (const Outline& outline : outlines)
    for (const point_t& corner : outline) {
      x = Bounds(std::min(x.min, corner.x), std::max(x.max, corner.x));
      y = Bounds(std::min(y.min, corner.y), std::max(y.max, corner.y));
    }
  OccupancyMap map;
  if (!std::isfinite(x.max - x.min) || !std::isfinite(y.max - y.min)) return map;
  while ((x.max - x.min + 2 * cell) * (y.max - y.min + 2 * cell) > kMaxCells * cell * cell)
    cell *= 2;
  // Rounding may put a corner on a cell's edge slightly below it.
  const auto index = [cell](double metres, double from) {
    return static_cast<int32_t>(std::max(0.0, std::floor((metres - from) / cell)));
  };
  map.resolution = cell;
  map.origin = Pose(std::floor(x.min / cell) * cell, std::floor(y.min / cell) * cell, 0, 0);
  map.width = static_cast<uint32_t>(index(x.max, map.origin.x)) + 1;
  map.height = static_cast<uint32_t>(index(y.max, map.origin.y)) + 1;
  map.cells.assign(size_t{map.width} * map.height, 0);
  std::vector<point_int_t> corners;
  for (const Outline& outline : outlines) {
    corners.clear();
    for (const point_t& c : outline)
      corners.emplace_back(index(c.x, map.origin.x), index(c.y, map.origin.y));
    internal::grid::ForEachCellOfOutline(
        corners.data(), corners.size(), [&map](int32_t column, int32_t row) {
          map.cells[static_cast<size_t>(row) * map.width + static_cast<size_t>(column)] = kOccupied;
        });
  }
  return map;
}

}  // namespace Stg::recording
