// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/window/picking.hh"

#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/trigonometry.hh"
#include "models/body.hh"
#include "models/model.hh"
#include "world/world.hh"

namespace Stg::internal::window {

namespace {

constexpr double kMiss = std::numeric_limits<double>::infinity();

/// A line of sight: start + t * way for t in 0..1.
struct Line {
  point3_t start, way;
};

bool IsInside(const std::vector<point_t>& polygon, double x, double y) {
  bool inside = false;
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    const point_t &a = polygon[i], &b = polygon[j];
    if ((a.y > y) != (b.y > y) && x < (b.x - a.x) * (y - a.y) / (b.y - a.y) + a.x) inside = !inside;
  }
  return inside;
}

/// Returns the minimum t at which the line enters the polygon at height z, or kMiss.
double IntersectPlate(const Line& line, const std::vector<point_t>& polygon, double z) {
  if (line.way.z == 0) return kMiss;
  const double t = (z - line.start.z) / line.way.z;
  if (t < 0 || t > 1) return kMiss;
  const double x = line.start.x + t * line.way.x, y = line.start.y + t * line.way.y;
  return IsInside(polygon, x, y) ? t : kMiss;
}

double MeetWall(const Line& line, const point_t& a, const point_t& b, const Bounds& z) {
  const double ex = b.x - a.x, ey = b.y - a.y;
  const double cross = line.way.x * ey - line.way.y * ex;
  if (cross == 0) return kMiss;
  const double dx = a.x - line.start.x, dy = a.y - line.start.y;
  const double t = (dx * ey - dy * ex) / cross;
  const double along = (dx * line.way.y - dy * line.way.x) / cross;
  if (t < 0 || t > 1 || along < 0 || along > 1) return kMiss;
  const double height = line.start.z + t * line.way.z;
  return height >= z.min && height <= z.max ? t : kMiss;
}

double MeetBlock(const Line& line, const Block& block) {
  const std::vector<point_t>& polygon = block.points();
  if (polygon.empty()) return kMiss;
  double t = std::min(IntersectPlate(line, polygon, block.z_range().max),
                      IntersectPlate(line, polygon, block.z_range().min));
  for (size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++)
    t = std::min(t, MeetWall(line, polygon[j], polygon[i], block.z_range()));
  return t;
}

/// True if the line passes the circle about the origin in plan view.
bool PassesCircle(const Line& line, double radius) {
  const double length2 = line.way.x * line.way.x + line.way.y * line.way.y;
  double t = 0;
  if (length2 > 0)
    t = constrain(-(line.start.x * line.way.x + line.start.y * line.way.y) / length2, 0, 1);
  const double x = line.start.x + t * line.way.x, y = line.start.y + t * line.way.y;
  return x * x + y * y <= radius * radius;
}

/// Transforms the line of sight into a frame.
Line InFrame(const view::Projection::LineOfSight& sight, const Pose& frame) {
  const SineCosine turn = SinCos(frame.a);
  const auto place = [&](double x, double y, double z) {
    return point3_t(x * turn.cosine + y * turn.sine, y * turn.cosine - x * turn.sine, z);
  };
  const point3_t &a = sight.from, &b = sight.to;
  return {place(a.x - frame.x, a.y - frame.y, a.z - frame.z),
          place(b.x - a.x, b.y - a.y, b.z - a.z)};
}

/// Returns the minimum t at which the line of sight meets the model or a descendant, or kMiss.
double IntersectTree(const view::Projection::LineOfSight& sight, const Model& model,
                     const Pose& global) {
  double t = kMiss;
  if (const BlockGroup& body = model.body(); !body.empty()) {
    Pose frame = global + model.GetGeom().pose;
    frame.z = global.z + model.GetGeom().pose.z;
    const Line line = InFrame(sight, frame);
    if (PassesCircle(line, body.radius()))
      for (const auto& block : body.blocks()) t = std::min(t, MeetBlock(line, *block));
  }
  for (const Model* child : model.GetChildren())
    t = std::min(t, IntersectTree(sight, *child, model.ChildGlobalPose(global, *child)));
  return t;
}

}  // namespace

Model* PickModel(const World& world, const view::Projection::LineOfSight& sight) {
  Model* picked = nullptr;
  double nearest = kMiss;
  for (Model* model : world.GetChildren()) {
    if (!model->IsMovable()) continue;
    const double t = IntersectTree(sight, *model, model->GetPose());
    if (t < nearest) {
      nearest = t;
      picked = model;
    }
  }
  return picked;
}

Model* PickSmallModel(const World& world, const view::Projection& projection, double x, double y) {
  constexpr double kMaxRadius = 4, kMaxDistance = 4;  // pixels: maximum radius, maximum distance
  Model* picked = nullptr;
  double nearest = kMaxDistance;
  for (Model* model : world.GetChildren()) {
    const Pose pose = model->GetPose();
    const point3_t place(pose.x, pose.y, pose.z);
    const auto pixels = projection.ToPixels(place);
    if (!model->IsMovable() || !pixels) continue;
    const double distance = std::hypot(pixels->x - x, projection.height() - pixels->y - y);
    if (distance >= nearest || model->body().radius() > kMaxRadius * projection.PixelAt(place))
      continue;
    nearest = distance;
    picked = model;
  }
  return picked;
}

bool Selection::Contains(const Model* model) const {
  return std::find(models_.begin(), models_.end(), model) != models_.end();
}

void Selection::SelectOnly(Model* model) {
  models_.assign(1, model);
  last_ = model;
}

void Selection::Toggle(Model* model) {
  if (Contains(model))
    std::erase(models_, model);
  else
    models_.push_back(model);
  last_ = model;
}

void Selection::Forget(const Model* model) {
  std::erase(models_, model);
  if (last_ == model) last_ = nullptr;
}

}  // namespace Stg::internal::window
