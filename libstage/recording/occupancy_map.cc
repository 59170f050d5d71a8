// SPDX-License-Identifier: GPL-2.0-or-later

#include "recording/occupancy_map.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <compare>
#include <map>
#include <set>
#include <utility>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/position.hh"

namespace Stg::recording {

namespace {

constexpr double kMaxCells = 4e6;
constexpr int8_t kOccupied = 100;
// Corners this near to an edge of cells (in cells) are put on it, since they are meant to be there.
constexpr double kSnap = 1e-3;
// Shorter parts of outlines in a cell (in cells) come from rounding.
constexpr double kTouch = 1e-9;

bool IsScenery(const Model& model, bool at_height) {
  const Visibility& vis = model.vis;
  return (vis.ranger_return >= 0 || (!at_height && vis.obstacle_return)) && !vis.gripper_return;
}

/// Returns the roots of all trees that contain a robot or something that can be pushed.
std::set<const Model*> RootsThatMove(const std::vector<Model*>& models) {
  std::set<const Model*> roots;
  for (const Model* model : models)
    if (dynamic_cast<const ModelPosition*>(model) || model->IsPushable())
      roots.insert(model->Root());
  return roots;
}

/// Calls f(x) for each crossing of an outline with the horizontal line at `y`.
template <typename F>
void ForEachCrossing(const std::vector<point_t>& outline, double y, F f) {
  for (size_t i = 0; i < outline.size(); i++) {
    const point_t &a = outline[i], &b = outline[i + 1 < outline.size() ? i + 1 : 0];
    if ((a.y <= y) != (b.y <= y)) f(a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x));
  }
}

bool Contains(const std::vector<point_t>& outline, const point_t& point) {
  bool inside = false;
  ForEachCrossing(outline, point.y, [&](double x) { inside ^= x > point.x; });
  return inside;
}

/// Marks cells of a map by outlines, whose coordinates are in cells.
class Brush {
 public:
  explicit Brush(OccupancyMap* map) : map_(*map) {}

  /// Marks the cells around whose centre the outlines turn, in all, other than 0 times. Blocks turn
  /// counter-clockwise, outer outlines of pictures clockwise and their holes counter-clockwise.
  void Fill(const std::vector<std::vector<point_t>>& outlines) {
    crossings_.clear();
    for (const auto& outline : outlines)
      for (size_t i = 0; i < outline.size(); i++)
        AddCrossings(outline[i], outline[i + 1 < outline.size() ? i + 1 : 0]);
    std::ranges::sort(crossings_);
    int turns = 0;
    for (size_t i = 0; i + 1 < crossings_.size(); i++) {
      turns += crossings_[i].turn;
      if (turns != 0)
        MarkCells(crossings_[i].row, crossings_[i].x - 0.5, crossings_[i + 1].x - 0.5);
    }
  }

  /// Marks the cells through whose inside the closed outline goes, moved by `shift` along x and y.
  void Trace(const std::vector<point_t>& outline, double shift) {
    for (size_t i = 0; i < outline.size(); i++) {
      const point_t &a = outline[i], &b = outline[i + 1 < outline.size() ? i + 1 : 0];
      MarkEdge({a.x + shift, a.y + shift}, {b.x + shift, b.y + shift});
    }
  }

  bool has_marked() const { return has_marked_; }

 private:
  /// An edge meets the line through the centres of a row.
  struct Crossing {
    int64_t row;
    double x;
    int turn;
    auto operator<=>(const Crossing&) const = default;
  };

  /// Returns the smallest whole number that is at least `value`, at least 0 and at most `most`.
  static int64_t Ceil(double value, int64_t most) {
    return static_cast<int64_t>(std::clamp(std::ceil(value), 0.0, static_cast<double>(most)));
  }

  /// Adds the crossings of an edge with the lines through the centres of rows.
  void AddCrossings(const point_t& a, const point_t& b) {
    const double slope = (b.x - a.x) / (b.y - a.y);  // not used if the edge is horizontal
    const int64_t end = Ceil(std::max(a.y, b.y) - 0.5, map_.height);
    for (int64_t row = Ceil(std::min(a.y, b.y) - 0.5, map_.height); row < end; row++)
      crossings_.push_back(
          {row, a.x + (static_cast<double>(row) + 0.5 - a.y) * slope, a.y < b.y ? 1 : -1});
  }

  void MarkEdge(const point_t& from, const point_t& to) {
    const auto& [a, b] = from.y <= to.y ? std::pair(from, to) : std::pair(to, from);
    const int64_t end = Ceil(b.y - kTouch, map_.height);
    const int64_t begin = Ceil(std::floor(a.y + kTouch), map_.height);
    for (int64_t row = begin; row < end; row++) {
      const double bottom = static_cast<double>(row);
      const double x0 = XAt(a, b, bottom), x1 = XAt(a, b, bottom + 1);
      MarkCells(row, std::floor(std::min(x0, x1) + kTouch), std::max(x0, x1) - kTouch);
    }
  }

  /// Returns x at the point of an edge (`a` is the lower end) at `y`, or at the end next to `y`.
  static double XAt(const point_t& a, const point_t& b, double y) {
    return y <= a.y ? a.x : y >= b.y ? b.x : a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
  }

  /// Marks the columns from `begin` to before `end`, both rounded up.
  void MarkCells(int64_t row, double begin, double end) {
    const int64_t first = Ceil(begin, map_.width), last = Ceil(end, map_.width);
    has_marked_ |= begin < end;  // elsewhere, if the map ends before
    if (first >= last) return;
    int8_t* const cells = map_.cells.data() + row * map_.width;
    std::fill(cells + first, cells + last, kOccupied);
  }

  OccupancyMap& map_;
  std::vector<Crossing> crossings_;
  bool has_marked_ = false;
};

double Snapped(double value) {
  const double nearest = std::round(value);
  return std::fabs(value - nearest) < kSnap ? nearest : value;
}

}  // namespace

Scenery::Scenery(const std::vector<Model*>& models, std::optional<double> height)
    : x_(HUGE_VAL, -HUGE_VAL), y_(HUGE_VAL, -HUGE_VAL) {
  const std::set<const Model*> moving = RootsThatMove(models);
  for (const Model* model : models)
    if (dynamic_cast<const ModelPosition*>(model)) {
      const Pose pose = model->GetGlobalPose();
      robots_.emplace_back(pose.x, pose.y);
    }
  for (const Model* model : models) {
    // The floor is not scenery; it has outlines only where it is walled in.
    if (model->GetId() == 0 || moving.contains(model->Root())) continue;
    if (IsScenery(*model, height.has_value())) Add(*model, height);
  }
}

void Scenery::Widen(const point_t& corner) {
  x_ = Bounds(std::min(x_.min, corner.x), std::max(x_.max, corner.x));
  y_ = Bounds(std::min(y_.min, corner.y), std::max(y_.max, corner.y));
}

void Scenery::Add(const Model& model, std::optional<double> height) {
  const Pose global = model.GetGlobalPose(), frame = global + model.GetGeom().pose;
  const double lift = global.z + model.GetGeom().pose.z;
  const SineCosine turn = SinCos(frame.a);
  const auto placed = [&](double x, double y) {
    return point_t(frame.x + x * turn.cosine - y * turn.sine,
                   frame.y + x * turn.sine + y * turn.cosine);
  };
  std::map<std::pair<double, double>, std::vector<Outline>> by_heights;
  for (const auto& block : model.body().blocks()) {
    const double bottom = lift + block->z_range().min, top = lift + block->z_range().max;
    if (height && (*height < bottom || *height > top)) continue;
    Outline& outline = by_heights[{bottom, top}].emplace_back();
    for (const point_t& corner : block->points()) {
      outline.push_back(placed(corner.x, corner.y));
      Widen(outline.back());
    }
  }
  if (model.body().has_frame() && !by_heights.empty()) {
    const double x = std::fabs(model.GetGeom().size.x) / 2,
                 y = std::fabs(model.GetGeom().size.y) / 2;
    for (const auto& [corner_x, corner_y] : {std::pair(-x, -y), {x, -y}, {x, y}, {-x, y}})
      Widen(placed(corner_x, corner_y));
  }
  for (auto& [heights, outlines] : by_heights) {
    const bool is_fence =
        outlines.size() == 1 && std::ranges::any_of(robots_, [&](const point_t& robot) {
          return Contains(outlines[0], robot);
        });
    bodies_.push_back({std::move(outlines), is_fence});
  }
}

void Scenery::Draw(OccupancyMap* map) const {
  const SineCosine turn = SinCos(map->origin.a);
  const auto in_cells = [&](const point_t& at) {
    const double x = at.x - map->origin.x, y = at.y - map->origin.y;
    return point_t(Snapped((x * turn.cosine + y * turn.sine) / map->resolution),
                   Snapped((y * turn.cosine - x * turn.sine) / map->resolution));
  };
  for (const Body& body : bodies_) {
    std::vector<Outline> outlines = body.outlines;
    for (Outline& outline : outlines) std::ranges::transform(outline, outline.begin(), in_cells);
    Brush brush(map);
    if (!body.is_fence) {
      brush.Fill(outlines);
      for (const Outline& outline : outlines) brush.Trace(outline, 0);
    }
    // Outlines without an area, on the edges of cells, are in the cells above and to the right.
    if (!brush.has_marked())
      for (const Outline& outline : outlines) brush.Trace(outline, kSnap);
  }
}

uint64_t Scenery::Fingerprint() const {
  uint64_t hash = 0xcbf29ce484222325;  // FNV-1a, with words instead of bytes
  const auto add = [&hash](uint64_t word) { hash = (hash ^ word) * 0x100000001b3; };
  for (const Body& body : bodies_) {
    add(body.is_fence);
    for (const Outline& outline : body.outlines) {
      add(outline.size());
      for (const point_t& corner : outline) {
        add(std::bit_cast<uint64_t>(corner.x));
        add(std::bit_cast<uint64_t>(corner.y));
      }
    }
  }
  return hash;
}

OccupancyMap MakeOccupancyMap(const std::vector<Model*>& models, double cell) {
  const Scenery scenery(models, std::nullopt);
  const Bounds &x = scenery.x(), &y = scenery.y();
  OccupancyMap map;
  if (!std::isfinite(x.max - x.min) || !std::isfinite(y.max - y.min)) return map;
  while ((x.max - x.min + 2 * cell) * (y.max - y.min + 2 * cell) > kMaxCells * cell * cell)
    cell *= 2;
  map.resolution = cell;
  map.origin = Pose(std::floor(x.min / cell) * cell, std::floor(y.min / cell) * cell, 0, 0);
  map.width = static_cast<uint32_t>(std::floor((x.max - map.origin.x) / cell)) + 1;
  map.height = static_cast<uint32_t>(std::floor((y.max - map.origin.y) / cell)) + 1;
  map.cells.assign(size_t{map.width} * map.height, 0);
  scenery.Draw(&map);
  return map;
}

}  // namespace Stg::recording
