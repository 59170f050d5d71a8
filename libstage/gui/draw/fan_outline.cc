// SPDX-License-Identifier: GPL-2.0-or-later

#include "gui/draw/fan_outline.hh"

#include <algorithm>
#include <cmath>

namespace Stg::draw {

namespace {

/// The bundle of lines from one point that pass all accepted points within a tolerance. It is an
/// interval of slopes relative to the direction of the first accepted point.
class Sheaf {
 public:
  Sheaf(const Tip& from, float tolerance) : from_(from), tolerance_(tolerance) {}

  /// Accepts the point and returns true if a line to it passes all points accepted before.
  bool Take(const Tip& point) {
    const float x = point.x - from_.x, y = point.y - from_.y;
    if (ahead_.x == 0 && ahead_.y == 0) return TakeFirst(x, y);
    const float along = ahead_.x * x + ahead_.y * y, beside = ahead_.x * y - ahead_.y * x;
    // Points nearer than an accepted one are rejected: a line to them would cut off a spike.
    if ((along < farthest_) | (beside < least_ * along) | (beside > greatest_ * along))
      return false;
    farthest_ = along;
    const float share = 1 / along;
    least_ = std::max(least_, (beside - tolerance_) * share);
    greatest_ = std::min(greatest_, (beside + tolerance_) * share);
    return true;
  }

 private:
  /// Points within the tolerance of the start do not constrain the line.
  bool TakeFirst(float x, float y) {
    const float distance = std::sqrt(x * x + y * y);
    if (!(distance > tolerance_)) return true;
    ahead_ = {x / distance, y / distance};
    farthest_ = distance;
    greatest_ = tolerance_ / distance;
    least_ = -greatest_;
    return true;
  }

  Tip from_, ahead_{0, 0};  // ahead_ is a unit vector, or zero before the first point
  float tolerance_;
  float farthest_ = 0;  // greatest distance of an accepted point along ahead_
  float least_ = 0, greatest_ = 0;
};

/// Receives points one by one and drops those that the tolerance allows to drop.
class Outline {
 public:
  /// Ends of a few neighbouring rays.
  static constexpr std::size_t kBlock = 8;
  struct Block {
    float x[kBlock], y[kBlock];
  };

  /// Each of the two simplifications, of blocks and of single points, gets half of the tolerance.
  Outline(const Tip& first, float tolerance, std::vector<Tip>* tips)
      : tips_(*tips), tolerance_(tolerance / 2), sheaf_(first, tolerance_), last_(first) {
    tips_.push_back(first);
  }

  void Add(const Tip& next) {
    if (!sheaf_.Take(next)) {
      tips_.push_back(last_);
      sheaf_ = Sheaf(last_, tolerance_);
      sheaf_.Take(next);
    }
    last_ = next;
  }
  void Add(const Block& block) {
    if (IsStraight(block)) return Add(Tip{block.x[kBlock - 1], block.y[kBlock - 1]});
    for (std::size_t i = 0; i < kBlock; i++) Add(Tip{block.x[i], block.y[i]});
  }
  void End() { tips_.push_back(last_); }

 private:
  /// True if the block's points lie along the line from the last point to the block's last one.
  /// Branch-free, so that the compiler can vectorize the loop.
  bool IsStraight(const Block& block) const {
    const float x = block.x[kBlock - 1] - last_.x, y = block.y[kBlock - 1] - last_.y;
    const float square = x * x + y * y, most = tolerance_ * tolerance_ * square;
    int astray = square == 0;
    for (std::size_t i = 0; i < kBlock; i++) {
      const float px = block.x[i] - last_.x, py = block.y[i] - last_.y;
      const float beside = x * py - y * px, along = x * px + y * py;
      astray |= (beside * beside > most) | (along < 0) | (along > square);
    }
    return astray == 0;
  }

  std::vector<Tip>& tips_;
  const float tolerance_;
  Sheaf sheaf_;
  Tip last_;
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

std::size_t AppendOutline(const std::vector<double>& ranges, const Directions& directions,
                          float longest, float tolerance, std::vector<Tip>* tips) {
  if (ranges.empty()) return 0;
  const float* const x = directions.x.data();
  const float* const y = directions.y.data();
  const auto range = [&](std::size_t i) {
    return std::min(static_cast<float>(ranges[i]), longest);
  };
  const auto tip = [&](std::size_t i) { return Tip{range(i) * x[i], range(i) * y[i]}; };
  const std::size_t before = tips->size();
  Outline outline(tip(0), tolerance, tips);
  std::size_t i = 1;
  for (; i + Outline::kBlock <= ranges.size(); i += Outline::kBlock) {
    Outline::Block block;
    for (std::size_t k = 0; k < Outline::kBlock; k++) {
      const float r = range(i + k);
      block.x[k] = r * x[i + k];
      block.y[k] = r * y[i + k];
    }
    outline.Add(block);
  }
  for (; i < ranges.size(); i++) outline.Add(tip(i));
  if (ranges.size() > 1) outline.End();
  return tips->size() - before;
}

}  // namespace Stg::draw
