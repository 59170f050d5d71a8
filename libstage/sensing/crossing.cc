// SPDX-License-Identifier: GPL-2.0-or-later

#include "sensing/crossing.hh"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace Stg::internal::sensing {

namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

/// A corner relative to the line.
struct RelativeCorner {
  double along;        // metres along the line from its start
  double side;         // metres to the left of the line; 0 if within rounding
  double error_bound;  // bound of the rounding error, metres
};

inline RelativeCorner Locate(const Line& line, const point_t& p) {
  const double dx = p.x - line.x, dy = p.y - line.y;
  const double side = line.direction.cosine * dy - line.direction.sine * dx;
  const double error_bound = RoundingAt(p, line.x, line.y);
  return {line.direction.cosine * dx + line.direction.sine * dy,
          std::fabs(side) <= error_bound ? 0.0 : side, error_bound};
}

/// Distance at which the edge crosses the line; negative behind the start.
double Along(const RelativeCorner& a, const RelativeCorner& b) {
  if (a.side == 0) return b.side == 0 ? std::min(a.along, b.along) : a.along;
  if (b.side == 0) return b.along;
  return a.along + (b.along - a.along) * (a.side / (a.side - b.side));
}

double Crossing(const RelativeCorner& a, const RelativeCorner& b) {
  if ((a.side > 0 && b.side > 0) || (a.side < 0 && b.side < 0)) return kNone;
  const double along = Along(a, b);
  if (along >= 0) return along;
  // The crossing lies behind the start. It counts if that may be rounding: the distance from the
  // start to the edge is the distance along the line times the sine of the angle between them.
  const double error_bound = std::max(a.error_bound, b.error_bound);
  const double across = std::fabs(a.side - b.side), length = across + std::fabs(a.along - b.along);
  if (across == 0) return std::max(a.along, b.along) >= -error_bound ? 0.0 : kNone;
  return -along * across <= error_bound * length ? 0.0 : kNone;
}

}  // namespace

double FirstCrossing(const Line& line, const point_t* points, uint32_t edges) {
  double nearest = kNone;
  RelativeCorner to{};
  uint32_t located = 0;  // index of the corner in `to`
  for (; edges != 0; edges &= edges - 1) {
    const auto i = static_cast<uint32_t>(std::countr_zero(edges));
    const RelativeCorner from = i == located && i != 0 ? to : Locate(line, points[i]);
    located = i + 1;
    to = Locate(line, points[located]);
    nearest = std::min(nearest, Crossing(from, to));
  }
  return nearest;
}

}  // namespace Stg::internal::sensing
