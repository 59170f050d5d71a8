// SPDX-License-Identifier: GPL-2.0-or-later
//
// A tree of bounding boxes: finds the items that a ray may meet or that may be near a point.
// Callers test the items themselves, so the tree affects speed only.

#ifndef STAGE_BENCHMARKS_TRUTH_BOX_TREE_HH
#define STAGE_BENCHMARKS_TRUTH_BOX_TREE_HH

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace truth {

/// Wider than a double on most machines, so that the truth has the smaller error.
using Real = long double;

struct Point {
  Real x = 0, y = 0;
};

struct Box {
  Point low, high;
};

/// The smallest box that contains both.
inline Box Joined(const Box& a, const Box& b) {
  return {{std::min(a.low.x, b.low.x), std::min(a.low.y, b.low.y)},
          {std::max(a.high.x, b.high.x), std::max(a.high.y, b.high.y)}};
}

struct Ray {
  Point origin;
  Point direction;  ///< unit vector
};

class BoxTree {
 public:
  /// Item i is in boxes[i].
  void Build(const std::vector<Box>& boxes);

  /// Calls look(item) for all items that the ray may meet within *limit, which look() may lower.
  template <typename F>
  void AlongRay(const Ray& ray, const Real* limit, F look) const {
    Visit([&](const Node& node) { return Entry(node, ray); }, limit, look);
  }

  /// Calls look(item) for all items that may be within *limit of the point.
  template <typename F>
  void NearPoint(const Point& point, const Real* limit, F look) const {
    Visit([&](const Node& node) { return Gap(node, point); }, limit, look);
  }

 private:
  struct Node {
    Point centre, half;  // bounds of the items, slightly enlarged
    uint32_t first = 0;  // item, or the first of two child nodes
    uint32_t items = 0;  // 0: has children
  };

  /// Lower bound of the distance along the ray to the box; infinite if the ray misses it.
  static Real Entry(const Node& node, const Ray& ray) {
    const Point m{node.centre.x - ray.origin.x, node.centre.y - ray.origin.y};
    const Real c = std::fabs(ray.direction.x), s = std::fabs(ray.direction.y);
    const Real aside = std::fabs(ray.direction.x * m.y - ray.direction.y * m.x);
    if (aside > node.half.x * s + node.half.y * c) return HUGE_VALL;
    const Real along = ray.direction.x * m.x + ray.direction.y * m.y;
    const Real reach = node.half.x * c + node.half.y * s;
    return along + reach < 0 ? HUGE_VALL : std::max<Real>(0, along - reach);
  }

  static Real Gap(const Node& node, const Point& point) {
    const Real x = std::fabs(point.x - node.centre.x) - node.half.x;
    const Real y = std::fabs(point.y - node.centre.y) - node.half.y;
    return std::hypot(std::max<Real>(0, x), std::max<Real>(0, y));
  }

  /// `distance` of a node is a lower bound for its items; the nearer child goes first.
  template <typename D, typename F>
  void Visit(D distance, const Real* limit, F look) const {
    if (nodes_.empty()) return;
    struct Pending {
      uint32_t node;
      Real distance;
    };
    Pending stack[64];  // deeper than repeated halving can get
    int depth = 0;
    stack[depth++] = {0, distance(nodes_[0])};
    while (depth > 0) {
      const Pending next = stack[--depth];
      if (std::isinf(next.distance) || next.distance > *limit) continue;
      const Node& node = nodes_[next.node];
      for (uint32_t i = 0; i < node.items; i++) look(items_[node.first + i]);
      if (node.items > 0) continue;
      Pending near{node.first, distance(nodes_[node.first])};
      Pending far{node.first + 1, distance(nodes_[node.first + 1])};
      if (far.distance < near.distance) std::swap(near, far);
      stack[depth++] = far;
      stack[depth++] = near;
    }
  }

  void Split(uint32_t node, uint32_t begin, uint32_t end, const std::vector<Box>& boxes);

  std::vector<Node> nodes_;
  std::vector<uint32_t> items_;
};

}  // namespace truth

#endif
