// SPDX-License-Identifier: GPL-2.0-or-later

#include "benchmarks/truth/scene.hh"

#include <algorithm>
#include <cmath>
#include <set>

#include "models/body.hh"

namespace truth {

namespace {

struct Frame {
  Point at;
  Real cosine, sine;
};

Frame MakeFrame(const Stg::Pose& pose) {
  return {{pose.x, pose.y}, std::cos(Real{pose.a}), std::sin(Real{pose.a})};
}

Point ToGlobal(const Frame& frame, Real x, Real y) {
  return {frame.at.x + x * frame.cosine - y * frame.sine,
          frame.at.y + x * frame.sine + y * frame.cosine};
}

/// Converts a frame that is relative to another one.
Frame Chained(const Frame& outer, const Stg::Pose& inner) {
  const Real c = std::cos(Real{inner.a}), s = std::sin(Real{inner.a});
  return {ToGlobal(outer, inner.x, inner.y), outer.cosine * c - outer.sine * s,
          outer.sine * c + outer.cosine * s};
}

Point ToLocal(const Point& at, Real cosine, Real sine, const Point& p) {
  const Real x = p.x - at.x, y = p.y - at.y;
  return {x * cosine + y * sine, y * cosine - x * sine};
}

Box BoxOf(const Point& a, const Point& b) {
  return {{std::min(a.x, b.x), std::min(a.y, b.y)}, {std::max(a.x, b.x), std::max(a.y, b.y)}};
}

/// Distance along the ray to the edge from a to b, including its ends; infinite if they do not
/// meet. The side of an end depends on that end only, so no ray slips between two edges that share
/// it.
Real DistanceAlong(const Ray& ray, const Point& a, const Point& b) {
  const auto along = [&](const Point& p) {
    return ray.direction.x * (p.x - ray.origin.x) + ray.direction.y * (p.y - ray.origin.y);
  };
  const auto side = [&](const Point& p) {
    return ray.direction.x * (p.y - ray.origin.y) - ray.direction.y * (p.x - ray.origin.x);
  };
  const Real side_a = side(a), side_b = side(b), along_a = along(a), along_b = along(b);
  if ((side_a > 0 && side_b > 0) || (side_a < 0 && side_b < 0)) return HUGE_VALL;
  if (side_a == side_b) {  // both 0: the edge lies on the ray's line
    const Real first = std::min(along_a, along_b), last = std::max(along_a, along_b);
    return last < 0 ? HUGE_VALL : std::max<Real>(first, 0);
  }
  const Real distance = along_a + (along_b - along_a) * (side_a / (side_a - side_b));
  return distance < 0 ? HUGE_VALL : distance;
}

Real DistanceBetween(const Point& p, const Point& a, const Point& b) {
  const Real ex = b.x - a.x, ey = b.y - a.y, px = p.x - a.x, py = p.y - a.y;
  const Real length = ex * ex + ey * ey;
  const Real fraction = length > 0 ? std::clamp<Real>((px * ex + py * ey) / length, 0, 1) : 0;
  return std::hypot(px - fraction * ex, py - fraction * ey);
}

Real IncidenceOn(const Ray& ray, const Point& a, const Point& b) {
  const Real ex = b.x - a.x, ey = b.y - a.y;
  const Real across = std::fabs(ray.direction.x * ey - ray.direction.y * ex);
  const Real along = std::fabs(ray.direction.x * ex + ray.direction.y * ey);
  return std::atan2(across, along);
}

}  // namespace

// ---- taking a scene -----------------------------------------------------------------------------

void Scene::Take(const Stg::World& world) {
  bodies_.clear();
  const std::set<Stg::Model*> all = world.GetAllModels();
  std::vector<const Stg::Model*> models(all.begin(), all.end());
  // Does not depend on addresses: where outlines coincide, the order decides which is found.
  std::sort(models.begin(), models.end(),
            [](const auto* a, const auto* b) { return a->GetId() < b->GetId(); });
  for (const Stg::Model* model : models)
    if (!model->body().empty()) Add(*model);
  std::vector<Box> boxes;
  for (const Body& body : bodies_) boxes.push_back(body.box);
  tree_.Build(boxes);
}

bool Scene::IsSame(const Shape& shape, const Stg::Model& model) {
  const auto& blocks = model.body().blocks();
  if (blocks.size() != shape.points.size()) return false;
  for (size_t i = 0; i < blocks.size(); i++) {
    const Stg::Bounds& z = blocks[i]->z_range();
    if (blocks[i]->points() != shape.points[i]) return false;
    if (z.min != shape.heights[i].min || z.max != shape.heights[i].max) return false;
  }
  return true;
}

void Scene::Make(const Stg::Model& model, Shape* shape) {
  *shape = Shape();
  std::vector<Box> boxes;
  for (const auto& block : model.body().blocks()) {
    const auto& points = block->points();
    const uint32_t number = static_cast<uint32_t>(shape->points.size());
    shape->points.push_back(points);
    shape->heights.push_back(block->z_range());
    for (size_t i = 0; i < points.size(); i++) {
      const Stg::point_t &p = points[i], &q = points[(i + 1) % points.size()];
      shape->edges.push_back({{p.x, p.y}, {q.x, q.y}, number});
      boxes.push_back(BoxOf(shape->edges.back().a, shape->edges.back().b));
    }
  }
  for (size_t i = 0; i < boxes.size(); i++)
    shape->box = i == 0 ? boxes[0] : Joined(shape->box, boxes[i]);
  shape->tree.Build(boxes);
}

void Scene::Add(const Stg::Model& model) {
  Shape& shape = shapes_[model.GetId()];
  if (!IsSame(shape, model)) Make(model, &shape);
  if (shape.edges.empty()) return;

  const Stg::Pose global = model.GetGlobalPose();
  const Stg::Pose offset = model.GetGeom().pose;
  const Frame frame = Chained(MakeFrame(global), offset);
  Body body{&model, &shape, frame.at, frame.cosine, frame.sine, global.z + offset.z, {}};
  const Box& b = shape.box;
  const Point corners[] = {b.low, {b.high.x, b.low.y}, b.high, {b.low.x, b.high.y}};
  for (const Point& corner : corners) {
    const Point p = ToGlobal(frame, corner.x, corner.y);
    body.box = &corner == corners ? Box{p, p} : Joined(body.box, {p, p});
  }
  bodies_.push_back(body);
}

// ---- queries ------------------------------------------------------------------------------------

bool Scene::Stops(const Body& body, const Stg::Model& finder) {
  return !body.model->IsRelated(&finder) && !(body.model->vis.ranger_return < 0);
}

/// Heights are compared in double, because equality matters and not precision: a sensor at exactly
/// the height of a body's top sees it.
static bool Contains(const Stg::Bounds& heights, double lift, double z) {
  return !(z < heights.min + lift || z > heights.max + lift);
}

Hit Scene::Cast(const Viewpoint& from, Real bearing, double range) const {
  Hit hit{nullptr, range, 0};
  if (!(range > 0)) return hit;
  const Real heading = from.heading + bearing;
  const Ray ray{from.origin, {std::cos(heading), std::sin(heading)}};
  tree_.AlongRay(ray, &hit.distance, [&](uint32_t b) {
    const Body& body = bodies_[b];
    if (!Stops(body, *from.finder)) return;
    const Shape& shape = *body.shape;
    const Ray local{ToLocal(body.at, body.cosine, body.sine, ray.origin),
                    ToLocal({}, body.cosine, body.sine, ray.direction)};
    shape.tree.AlongRay(local, &hit.distance, [&](uint32_t e) {
      const Edge& edge = shape.edges[e];
      if (!Contains(shape.heights[edge.block], body.lift, from.z)) return;
      const Real distance = DistanceAlong(local, edge.a, edge.b);
      // Not <=: without a hit, the result is the range, and a hit exactly at the range does not
      // count.
      if (distance < hit.distance) hit = {body.model, distance, IncidenceOn(local, edge.a, edge.b)};
    });
  });
  return hit;
}

Real Scene::Clearance(const Viewpoint& from, Real limit) const {
  Real nearest = limit;
  tree_.NearPoint(from.origin, &nearest, [&](uint32_t b) {
    const Body& body = bodies_[b];
    if (!Stops(body, *from.finder)) return;
    const Shape& shape = *body.shape;
    const Point local = ToLocal(body.at, body.cosine, body.sine, from.origin);
    shape.tree.NearPoint(local, &nearest, [&](uint32_t e) {
      const Edge& edge = shape.edges[e];
      if (Contains(shape.heights[edge.block], body.lift, from.z))
        nearest = std::min(nearest, DistanceBetween(local, edge.a, edge.b));
    });
  });
  return nearest;
}

Viewpoint ViewpointOf(const Stg::ModelRanger& ranger, const Stg::ModelRanger::Sensor& sensor) {
  const Stg::Pose global = ranger.GetGlobalPose();
  const Stg::Pose offset = ranger.GetGeom().pose;
  const Frame frame = Chained(MakeFrame(global), offset);
  return {&ranger, ToGlobal(frame, sensor.pose.x, sensor.pose.y),
          global.z + offset.z + sensor.pose.z + sensor.size.z / 2.0,
          Real{global.a} + Real{offset.a} + Real{sensor.pose.a}};
}

}  // namespace truth
