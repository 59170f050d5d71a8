// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/crossing.hh"

#include <algorithm>
#include <cmath>
#include <limits>

namespace Stg::internal::sensing {

namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// A corner as the line sees it.
struct Seen {
  double along;   // metres from the start of the line
  double side;    // metres to its left; 0 if that may be mere rounding
  double unsure;  // what rounding may amount to, metres
};

Seen See(const Line& line, const point_t& p) {
  // Eight units in the last place of the coordinates: what turning a body, and the two products
  // here, may amount to.
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();
  const double dx = p.x - line.x, dy = p.y - line.y;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  const double unsure =
      kRounding * (std::fabs(p.x) + std::fabs(p.y) + std::fabs(line.x) + std::fabs(line.y));
  return {line.direction.cosine * dx + line.direction.sine * dy,
          std::fabs(side) <= unsure ? 0.0 : side, unsure};
}

/// Where the line through both crosses theirs; negative behind the start.
double Along(const Seen& a, const Seen& b) {
  if (a.side == 0) return b.side == 0 ? std::min(a.along, b.along) : a.along;
  if (b.side == 0) return b.along;
  return a.along + (b.along - a.along) * (a.side / (a.side - b.side));
}

double Crossing(const Seen& a, const Seen& b) {
  if ((a.side > 0 && b.side > 0) || (a.side < 0 && b.side < 0)) return kNone;
  const double along = Along(a, b);
  if (along >= 0) return along;
  // Behind the start, by no more than rounding: the start's distance from the edge is that along
  // the line times the sine of the angle between them.
  const double unsure = std::max(a.unsure, b.unsure);
  const double across = std::fabs(a.side - b.side), length = across + std::fabs(a.along - b.along);
  if (across == 0) return std::max(a.along, b.along) >= -unsure ? 0.0 : kNone;
  return -along * across <= unsure * length ? 0.0 : kNone;
}

}  // namespace

double FirstCrossing(const Line& line, const point_t* points, uint32_t edges) {
  double nearest = kNone;
  Seen from = See(line, points[0]);
  for (uint32_t i = 0; i < edges; i++) {
    const Seen to = See(line, points[i + 1]);
    nearest = std::min(nearest, Crossing(from, to));
    from = to;
  }
  return nearest;
}

}  // namespace Stg::internal::sensing
