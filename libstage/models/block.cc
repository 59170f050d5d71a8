// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/block.hh"

#include <utility>

namespace Stg {

Block::Block(std::vector<point_t> points, Bounds z_range)
    : source_points_(std::move(points)), points_(source_points_), source_z_(z_range), z_(z_range) {}

Block::~Block() = default;

namespace {

/// True for headings in (0, pi].
bool HeadsUp(const point_t& edge) { return edge.y > 0 || (edge.y == 0 && edge.x < 0); }

/// Vector between two points; an edge without length counts as one along x.
point_t Edge(const point_t& from, const point_t& to) {
  const point_t edge(to.x - from.x, to.y - from.y);
  return edge.x == 0 && edge.y == 0 ? point_t(1, 0) : edge;
}

}  // namespace

/// The turns at all corners add up to a whole number of full turns: the number of times that the
/// heading crosses the negative x axis counter-clockwise minus clockwise. Counting needs only
/// comparisons; a sum of angles would have rounding errors, and its sign would be arbitrary for
/// figures of eight. U-turns cross nothing.
void OrientPolygon(std::vector<point_t>* points) {
  const size_t n = points->size();
  int full_turns = 0;
  for (size_t i = 0; i < n; i++) {
    const point_t &a = (*points)[i], &b = (*points)[(i + 1) % n], &c = (*points)[(i + 2) % n];
    const point_t in = Edge(a, b), out = Edge(b, c);
    if (HeadsUp(in) && !HeadsUp(out) && in.x * out.y > in.y * out.x) full_turns++;
    if (!HeadsUp(in) && HeadsUp(out) && in.x * out.y < in.y * out.x) full_turns--;
  }
  if (full_turns <= 0) std::reverse(points->begin(), points->end());
}

}  // namespace Stg
