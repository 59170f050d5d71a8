// SPDX-License-Identifier: GPL-2.0-or-later
//
// Plans paths through a map of 32 by 32 cells with A*. Paths are cached for all robots.

#ifndef EXAMPLES_CTRL_SUPPORT_PATH_PLANNER_HH
#define EXAMPLES_CTRL_SUPPORT_PATH_PLANNER_HH

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <map>
#include <optional>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "geometry/trigonometry.hh"
#include "stage.hh"

namespace ctrl {

constexpr int kMapSide = 32;  // cells

struct MapCell {
  int x, y;
  int index() const { return y * kMapSide + x; }
  bool InMap() const { return x >= 0 && y >= 0 && x < kMapSide && y < kMapSide; }
  bool operator==(const MapCell&) const = default;
};

/// Waypoints from the goal back to the start.
using Path = std::vector<Stg::point_t>;

class PathPlanner {
 public:
  /// `occupied`: kMapSide * kMapSide bytes, row 0 in the south. The map is `width` by `height`
  /// metres, centred at the origin.
  PathPlanner(std::vector<uint8_t> occupied, double width, double height)
      : occupied_(std::move(occupied)), width_(width), height_(height) {}

  MapCell CellOf(double x, double y) const { return {CellOf1(x, width_), CellOf1(y, height_)}; }
  Stg::point_t CentreOf(const MapCell& cell) const {
    return {Centre1(cell.x, width_), Centre1(cell.y, height_)};
  }

  /// Returns an empty path if there is no way. Valid as long as the planner.
  const Path* Plan(const Stg::Pose& from, const Stg::Pose& to) {
    const MapCell start = CellOf(from.x, from.y), goal = CellOf(to.x, to.y);
    const auto [entry, is_new] =
        plans_.try_emplace(std::make_tuple(start.x, start.y, goal.x, goal.y));
    if (is_new) entry->second = Search(start, goal);
    return &entry->second;
  }

 private:
  static constexpr int kStepCost = 1, kOccupiedCost = 9;  // of leaving a cell

  static int CellOf1(double metres, double size) {
    const double cell = std::floor((metres + size / 2) * kMapSide / size);
    return static_cast<int>(Stg::constrain(cell, -1, kMapSide));
  }
  static double Centre1(int cell, double size) {
    return cell * size / kMapSide - size / 2 + size / (2 * kMapSide);
  }

  bool Free(const MapCell& cell) const {
    return cell.InMap() && occupied_[static_cast<size_t>(cell.index())] == 0;
  }

  Path Search(const MapCell& start, const MapCell& goal) const {
    Path path;
    // The start may be an occupied cell, since robots can get close to walls.
    if (!start.InMap() || (!Free(goal) && !(goal == start))) return path;
    const std::vector<int> came_from = Explore(start, goal);
    if (came_from[static_cast<size_t>(goal.index())] < 0) return path;
    for (int at = goal.index();; at = came_from[static_cast<size_t>(at)]) {
      path.push_back(CentreOf({at % kMapSide, at / kMapSide}));
      if (at == start.index()) return path;
    }
  }

  /// Returns the predecessor of each reached cell, and -1 for the others.
  std::vector<int> Explore(const MapCell& start, const MapCell& goal) const {
    constexpr int kUnknown = 1 << 30;
    const auto distance = [&](const MapCell& c) {
      return std::abs(c.x - goal.x) + std::abs(c.y - goal.y);
    };
    std::vector<int> came_from(kMapSide * kMapSide, -1), cost(kMapSide * kMapSide, kUnknown);
    using Entry = std::tuple<int, int, int>;  // (estimate, order of discovery, cell)
    std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> open;
    int discovered = 0;
    const auto reach = [&](const MapCell& cell, int from, int new_cost) {
      const size_t i = static_cast<size_t>(cell.index());
      if (new_cost >= cost[i]) return;
      cost[i] = new_cost;
      came_from[i] = from;
      open.emplace(new_cost + distance(cell), discovered++, cell.index());
    };
    reach(start, start.index(), 0);
    while (!open.empty()) {
      const int at = std::get<2>(open.top());
      open.pop();
      if (at == goal.index()) break;
      const MapCell cell{at % kMapSide, at / kMapSide};
      const int next_cost =
          cost[static_cast<size_t>(at)] + (Free(cell) ? kStepCost : kOccupiedCost);
      for (const MapCell& next : {MapCell{cell.x - 1, cell.y}, MapCell{cell.x, cell.y - 1},
                                  MapCell{cell.x + 1, cell.y}, MapCell{cell.x, cell.y + 1}})
        if (Free(next)) reach(next, at, next_cost);
    }
    return came_from;
  }

  std::vector<uint8_t> occupied_;
  double width_, height_;
  std::map<std::tuple<int, int, int, int>, Path> plans_;
};

/// Returns the heading to the waypoint nearest to the goal among those within sight (walls are
/// ignored), slightly to its left, which makes two lanes of traffic. Nothing if none is in sight.
inline std::optional<double> DirectionAlong(const Path& path, const Stg::Pose& pose) {
  constexpr double kSight = 5.0;      // m
  constexpr double kLaneBias = 0.25;  // rad
  for (const Stg::point_t& place : path) {
    const double dx = place.x - pose.x, dy = place.y - pose.y;
    if (dx * dx + dy * dy < kSight * kSight)
      return Stg::normalize(Stg::ArcTangent(dy, dx) + kLaneBias);
  }
  return std::nullopt;
}

}  // namespace ctrl

#endif
