// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/line_in_bodies.hh"

#include <algorithm>

#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "messages/assert.hh"
#include "models/body.hh"
#include "models/model.hh"

namespace Stg {

void LineInBodies::Begin(const point3_t& from, const point3_t& to) {
  from_ = from;
  to_ = to;
  insides_.clear();
}

/// Part of the line with heights in the closed interval; min > max if empty.
Bounds LineInBodies::IntervalBetween(const Bounds& heights) const {
  const double rise = to_.z - from_.z;
  if (rise == 0)
    return heights.min <= from_.z && from_.z <= heights.max ? Bounds(0, 1) : Bounds(1, 0);
  const double a = (heights.min - from_.z) / rise, b = (heights.max - from_.z) / rise;
  return Bounds(std::max(0.0, std::min(a, b)), std::min(1.0, std::max(a, b)));
}

void LineInBodies::AddBodyOf(const Model& model) {
  const Pose global = model.GetGlobalPose();
  const Geom geom = model.GetGeom();
  const Pose frame = global + geom.pose;
  const SineCosine turn = SinCos(-frame.a);
  const auto local = [&](const point3_t& p) {
    return Rotated(point_t(p.x - frame.x, p.y - frame.y), turn);
  };
  const point_t from = local(from_), to = local(to_);

  crossings_.clear();
  for (const auto& block : model.body().blocks()) {
    const double lift = global.z + geom.pose.z;
    const Bounds part =
        IntervalBetween(Bounds(block->z_range().min + lift, block->z_range().max + lift));
    if (part.min < part.max) AddBlock(*block, from, to, part);
  }
  AddInsides();
}

/// Crossings outside `part` are moved to its ends, so that winding numbers are right within it and
/// 0 outside.
void LineInBodies::AddBlock(const Block& block, const point_t& from, const point_t& to,
                            const Bounds& part) {
  const double dx = to.x - from.x, dy = to.y - from.y;
  const double square = dx * dx + dy * dy;
  if (!(square > 0)) return;
  const auto side = [&](const point_t& p) { return dx * (p.y - from.y) - dy * (p.x - from.x); };
  const auto along = [&](const point_t& p) {
    return (dx * (p.x - from.x) + dy * (p.y - from.y)) / square;
  };
  const std::vector<point_t>& points = block.points();
  for (size_t i = 0; i < points.size(); i++) {
    const point_t &p = points[i], &q = points[i + 1 < points.size() ? i + 1 : 0];
    const double p_side = side(p), q_side = side(q);
    if ((p_side >= 0) == (q_side >= 0)) continue;
    const double where = along(p) + (along(q) - along(p)) * (p_side / (p_side - q_side));
    crossings_.push_back({constrain(where, part.min, part.max), q_side >= 0 ? 1 : -1});
  }
}

/// Uses winding numbers, because holes in pictures are separate outlines of opposite orientation.
void LineInBodies::AddInsides() {
  std::sort(crossings_.begin(), crossings_.end());
  STAGE_ASSERT(crossings_.empty() ||
               !(crossings_.front().along < 0 || crossings_.back().along > 1));
  int winding = 0;
  double entered = 0;
  for (const Crossing& crossing : crossings_) {
    if (winding == 0) entered = crossing.along;
    winding += crossing.turns;
    if (winding == 0 && crossing.along > entered) insides_.emplace_back(entered, crossing.along);
  }
}

double LineInBodies::FirstInside() const {
  double first = 1;
  for (const Bounds& inside : insides_) first = std::min(first, inside.min);
  return first;
}

double LineInBodies::FractionInside() {
  std::sort(insides_.begin(), insides_.end(),
            [](const Bounds& a, const Bounds& b) { return a.min < b.min; });
  double sum = 0, reached = 0;
  for (const Bounds& inside : insides_) {
    const double from = std::max(inside.min, reached);
    if (inside.max > from) sum += inside.max - from;
    reached = std::max(reached, inside.max);
  }
  STAGE_ASSERT(!(sum < 0) && !(sum > 1 + 1e-9));  // not a number if a pose overflows
  return sum;
}

}  // namespace Stg
