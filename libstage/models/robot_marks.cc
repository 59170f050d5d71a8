// SPDX-License-Identifier: GPL-2.0-or-later

#include "models/robot_marks.hh"

#include <algorithm>
#include <cmath>

#include "geometry/rotated.hh"
#include "geometry/trigonometry.hh"
#include "models/body.hh"

namespace Stg {

namespace {

// Positions as fractions of the distance from the body's centre to its outline.
constexpr double kTip = 0.9, kBase = -0.3, kHalfWidth = 0.4;

/// Extent of the outlines from the centre along the model's axes; 0 where there is no outline.
struct Reach {
  double ahead = 0, left = 0, right = 0;
};

/// X coordinate at which the edge from a to b crosses the x axis, if it does.
std::optional<double> CrossXAxis(const point_t& a, const point_t& b) {
  if ((a.y > 0) == (b.y > 0)) return std::nullopt;
  return a.x + (b.x - a.x) * a.y / (a.y - b.y);
}

void Extend(const point_t& a, const point_t& b, Reach* reach) {
  if (const auto x = CrossXAxis(a, b)) reach->ahead = std::max(reach->ahead, *x);
  if (const auto y = CrossXAxis({a.y, a.x}, {b.y, b.x})) {
    reach->left = std::max(reach->left, *y);
    reach->right = std::max(reach->right, -*y);
  }
}

/// `heading` is the rotation of the body's frame in the model's frame.
Reach ReachOf(const BlockGroup& body, double heading) {
  const SineCosine turn = SinCos(heading);
  Reach reach;
  for (const auto& block : body.blocks()) {
    if (block->points().empty()) continue;
    point_t last = Rotated(block->points().back(), turn);
    for (const point_t& point : block->points()) {
      const point_t next = Rotated(point, turn);
      Extend(last, next, &reach);
      last = next;
    }
  }
  return reach;
}

}  // namespace

std::optional<Nose> NoseOf(const BlockGroup& body, const Pose& frame) {
  const Reach reach = ReachOf(body, frame.a);
  const double side = std::min(reach.left, reach.right);
  if (!(reach.ahead > 0 && side > 0)) return std::nullopt;
  // The nose of a long body is at most twice as long as the body is wide.
  const double length = std::min(reach.ahead, 4 * side) * (kTip - kBase);
  const double tip = frame.x + kTip * reach.ahead;
  const double half = kHalfWidth * std::min(side, reach.ahead);
  return Nose{point_t(tip, frame.y), point_t(tip - length, frame.y + half),
              point_t(tip - length, frame.y - half)};
}

Color NoseColor(const Color& body) {
  constexpr double kLightened = 0.85, kDarkened = 0.8;  // fraction of the way to white or black
  const bool is_dark = 0.3 * body.r + 0.6 * body.g + 0.1 * body.b < 0.5;
  const auto shade = [&](double part) {
    return is_dark ? part + kLightened * (1 - part) : part * (1 - kDarkened);
  };
  return Color(shade(body.r), shade(body.g), shade(body.b), body.a);
}

}  // namespace Stg
