// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/fan_polyline.hh"

#include <algorithm>
#include <cmath>

namespace Stg::draw {

namespace {

/// The bundle of lines from one point that pass all accepted points within a tolerance. It is an
/// interval of slopes relative to the direction of the first accepted point.
class SlopeInterval {
 public:
  SlopeInterval(const RayEnd& from, float tolerance) : from_(from), tolerance_(tolerance) {}

  /// Accepts the point and returns true if a line to it passes all points accepted before.
  bool Accept(const RayEnd& point) {
    const float x = point.x - from_.x, y = point.y - from_.y;
    if (ahead_.x == 0 && ahead_.y == 0) return AcceptFirst(x, y);
    const float along = ahead_.x * x + ahead_.y * y, across = ahead_.x * y - ahead_.y * x;
    // Points nearer than an accepted one are rejected: a line to them would cut off a spike.
    if ((along < max_along_) | (across < min_slope_ * along) | (across > max_slope_ * along))
      return false;
    max_along_ = along;
    const float inverse = 1 / along;
    min_slope_ = std::max(min_slope_, (across - tolerance_) * inverse);
    max_slope_ = std::min(max_slope_, (across + tolerance_) * inverse);
    return true;
  }

 private:
  /// Points within the tolerance of the start do not constrain the line.
  bool AcceptFirst(float x, float y) {
    const float distance = std::sqrt(x * x + y * y);
    if (!(distance > tolerance_)) return true;
    ahead_ = {x / distance, y / distance};
    max_along_ = distance;
    max_slope_ = tolerance_ / distance;
    min_slope_ = -max_slope_;
    return true;
  }

  RayEnd from_, ahead_{0, 0};  // ahead_ is a unit vector, or zero before the first point
  float tolerance_;
  float max_along_ = 0;  // greatest distance of an accepted point along ahead_
  float min_slope_ = 0, max_slope_ = 0;
};

/// Receives points one by one and drops those that the tolerance allows to drop.
class PolylineSimplifier {
 public:
  /// Ends of a few neighbouring rays.
  static constexpr std::size_t kBlock = 8;
  struct Block {
    float x[kBlock], y[kBlock];
  };

  /// Each of the two simplifications, of blocks and of single points, gets half of the tolerance.
  PolylineSimplifier(const RayEnd& first, float tolerance, std::vector<RayEnd>* ray_ends)
      : ray_ends_(*ray_ends), tolerance_(tolerance / 2), slopes_(first, tolerance_), last_(first) {
    ray_ends_.push_back(first);
  }

  void Add(const RayEnd& next) {
    if (!slopes_.Accept(next)) {
      ray_ends_.push_back(last_);
      slopes_ = SlopeInterval(last_, tolerance_);
      slopes_.Accept(next);
    }
    last_ = next;
  }
  void Add(const Block& block) {
    if (IsStraight(block)) return Add(RayEnd{block.x[kBlock - 1], block.y[kBlock - 1]});
    for (std::size_t i = 0; i < kBlock; i++) Add(RayEnd{block.x[i], block.y[i]});
  }
  void End() { ray_ends_.push_back(last_); }

 private:
  /// True if the block's points lie along the line from the last point to the block's last one.
  /// Branch-free, so that the compiler can vectorize the loop.
  bool IsStraight(const Block& block) const {
    const float x = block.x[kBlock - 1] - last_.x, y = block.y[kBlock - 1] - last_.y;
    const float square = x * x + y * y, max_length = tolerance_ * tolerance_ * square;
    int rejected = square == 0;
    for (std::size_t i = 0; i < kBlock; i++) {
      const float px = block.x[i] - last_.x, py = block.y[i] - last_.y;
      const float across = x * py - y * px, along = x * px + y * py;
      rejected |= (across * across > max_length) | (along < 0) | (along > square);
    }
    return rejected == 0;
  }

  std::vector<RayEnd>& ray_ends_;
  const float tolerance_;
  SlopeInterval slopes_;
  RayEnd last_;
};

}  // namespace

Directions DirectionsOf(const std::vector<double>& bearings) {
  Directions directions;
  for (const double bearing : bearings) {
    directions.x.push_back(static_cast<float>(std::cos(bearing)));
    directions.y.push_back(static_cast<float>(std::sin(bearing)));
  }
  return directions;
}

std::size_t AppendSimplified(const std::vector<double>& ranges, const Directions& directions,
                             float longest, float tolerance, std::vector<RayEnd>* ray_ends) {
  if (ranges.empty()) return 0;
  const float* const x = directions.x.data();
  const float* const y = directions.y.data();
  const auto range = [&](std::size_t i) {
    return std::min(static_cast<float>(ranges[i]), longest);
  };
  const auto tip = [&](std::size_t i) { return RayEnd{range(i) * x[i], range(i) * y[i]}; };
  const std::size_t before = ray_ends->size();
  PolylineSimplifier outline(tip(0), tolerance, ray_ends);
  std::size_t i = 1;
  for (; i + PolylineSimplifier::kBlock <= ranges.size(); i += PolylineSimplifier::kBlock) {
    PolylineSimplifier::Block block;
    for (std::size_t k = 0; k < PolylineSimplifier::kBlock; k++) {
      const float r = range(i + k);
      block.x[k] = r * x[i + k];
      block.y[k] = r * y[i + k];
    }
    outline.Add(block);
  }
  for (; i < ranges.size(); i++) outline.Add(tip(i));
  if (ranges.size() > 1) outline.End();
  return ray_ends->size() - before;
}

}  // namespace Stg::draw
