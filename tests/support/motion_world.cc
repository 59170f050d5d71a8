// SPDX-License-Identifier: GPL-2.0-or-later

#include "support/motion_world.hh"

#include <algorithm>
#include <cstring>

namespace test {
namespace {

/// A convex outline in the world.
struct Outline {
  std::vector<Vector> corners;
  double radius;
  double bottom, top;
};

double DistanceToSegment(Vector p, Vector a, Vector b) {
  const double ex = b.x - a.x, ey = b.y - a.y, square = ex * ex + ey * ey;
  double t = square > 0.0 ? ((p.x - a.x) * ex + (p.y - a.y) * ey) / square : 0.0;
  t = std::min(1.0, std::max(0.0, t));
  const double dx = p.x - a.x - t * ex, dy = p.y - a.y - t * ey;
  return std::sqrt(dx * dx + dy * dy);
}

/// How far p is inside of a convex polygon; negative outside.
double DepthInside(const std::vector<Vector>& polygon, Vector p) {
  double depth = 1e9;
  for (size_t i = 0; i < polygon.size(); i++) {
    const Vector a = polygon[i], b = polygon[(i + 1) % polygon.size()];
    const double length = std::sqrt((b.x - a.x) * (b.x - a.x) + (b.y - a.y) * (b.y - a.y));
    depth = std::min(depth, ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) / length);
  }
  return depth;
}

/// Overlap of polygons: the least over all edges of how far the other reaches behind the edge.
double DepthByAxes(const Outline& a, const Outline& b) {
  double depth = 1e9;
  for (const Outline* host : {&a, &b}) {
    const Outline& guest = host == &a ? b : a;
    const size_t n = host->corners.size();
    for (size_t i = 0; i < n && n > 1; i++) {
      const Vector p = host->corners[i], q = host->corners[(i + 1) % n];
      const double length = std::sqrt((q.x - p.x) * (q.x - p.x) + (q.y - p.y) * (q.y - p.y));
      double deepest = -1e9;
      for (const Vector& c : guest.corners)
        deepest =
            std::max(deepest, ((q.x - p.x) * (c.y - p.y) - (q.y - p.y) * (c.x - p.x)) / length);
      depth = std::min(depth, deepest);
    }
  }
  return depth;
}

double Gap(const Outline& a, const Outline& b) {
  double depth = -1e9;
  if (a.corners.size() > 1 && b.corners.size() > 1)
    depth = DepthByAxes(a, b);
  else if (a.corners.size() > 2 || b.corners.size() > 2)
    depth = a.corners.size() > 2 ? DepthInside(a.corners, b.corners[0])
                                 : DepthInside(b.corners, a.corners[0]);
  if (depth > 0.0) return -depth - a.radius - b.radius;
  double least = 1e9;
  for (const Outline* host : {&a, &b})
    for (size_t i = 0; i < host->corners.size(); i++)
      for (const Vector& c : (host == &a ? b : a).corners)
        least = std::min(least, DistanceToSegment(c, host->corners[i],
                                                  host->corners[(i + 1) % host->corners.size()]));
  return least - a.radius - b.radius;
}

std::vector<Outline> OutlinesOf(const MotionWorld& world, size_t body) {
  const Columns& bodies = world.bodies;
  const Shape& shape = world.shapes.shapes[bodies.shape[body]];
  const Vector ahead = UnitVector(bodies.heading[body]);
  std::vector<Outline> outlines;
  for (uint32_t i = 0; i < shape.piece_count; i++) {
    const auto& piece = world.shapes.pieces[shape.first_piece + i];
    Outline outline{{},
                    piece.radius,
                    piece.height.bottom + bodies.elevation[body],
                    piece.height.top + bodies.elevation[body]};
    for (uint32_t k = 0; k < piece.corner_count; k++) {
      const Vector c = world.shapes.corners[piece.first_corner + k];
      outline.corners.push_back({bodies.x[body] + ahead.x * c.x - ahead.y * c.y,
                                 bodies.y[body] + ahead.y * c.x + ahead.x * c.y});
    }
    outlines.push_back(outline);
  }
  return outlines;
}

double LeastGapBetween(const std::vector<Outline>& a, const std::vector<Outline>& b) {
  double least = 1e9;
  for (const Outline& first : a)
    for (const Outline& second : b)
      if (first.bottom < second.top && second.bottom < first.top)
        least = std::min(least, Gap(first, second));
  return least;
}

Outline OutlineOf(const Stg::motion::WallEdge& edge) {
  return {{edge.ends[0], edge.ends[1]}, 0.0, edge.height.bottom, edge.height.top};
}

}  // namespace

double MotionWorld::GapToWall(size_t body, size_t edge) const {
  return LeastGapBetween(OutlinesOf(*this, body), {OutlineOf(walls.edges()[edge])});
}

double MotionWorld::LeastGap(double far) const {
  double least = 1e9;
  std::vector<std::vector<Outline>> outlines;
  for (size_t i = 0; i < bodies.size(); i++) outlines.push_back(OutlinesOf(*this, i));
  for (size_t i = 0; i < bodies.size(); i++) {
    const double bound = shapes.shapes[bodies.shape[i]].bound;
    for (size_t k = 0; k < i; k++) {
      const double dx = bodies.x[i] - bodies.x[k], dy = bodies.y[i] - bodies.y[k];
      const double reach = bound + shapes.shapes[bodies.shape[k]].bound + far;
      if (dx * dx + dy * dy > reach * reach) continue;
      if (bodies.group[i] == bodies.group[k] && bodies.group[i] != Stg::motion::kNoGroup) continue;
      least = std::min(least, LeastGapBetween(outlines[i], outlines[k]));
    }
    for (const auto& edge : walls.edges())
      if (DistanceToSegment(PositionOf(i), edge.ends[0], edge.ends[1]) < bound + far)
        least = std::min(least, LeastGapBetween(outlines[i], {OutlineOf(edge)}));
  }
  return least;
}

uint64_t MotionWorld::Hash() const {
  uint64_t hash = 14695981039346656037u;
  for (size_t i = 0; i < bodies.size(); i++)
    for (const double value : {bodies.x[i], bodies.y[i], bodies.heading[i]}) {
      uint64_t bits;
      std::memcpy(&bits, &value, sizeof bits);
      hash = (hash ^ bits) * 1099511628211u;
      hash ^= hash >> 29;
    }
  return hash;
}

}  // namespace test
