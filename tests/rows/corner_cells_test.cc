// SPDX-License-Identifier: GPL-2.0-or-later
//
// Cells of corners that are found eight at a time are those of single corners.

#include "rows/corner_cells.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "geometry/trigonometry.hh"
#include "support/random_source.hh"

namespace Stg::rows {
namespace {

using test::RandomSource;

constexpr double kCells = 50;  // per metre

Body RandomBody(RandomSource* random) {
  Body body{};
  const int corners = random->Int(1, 20);
  for (int i = 0; i < corners; i++)
    body.corners.push_back(point_t(random->Real(-0.5, 0.5), random->Real(-0.5, 0.5)));
  for (size_t i = 0; i < (body.corners.size() + 7) / 8 * 8; i++) {
    const point_t& p = body.corners[std::min(i, body.corners.size() - 1)];
    body.corners_x.push_back(p.x);
    body.corners_y.push_back(p.y);
  }
  return body;
}

/// A place near the origin, far away, or at a border of the grid.
Placed RandomPlace(RandomSource* random) {
  const double border = internal::grid::kMaxCell / kCells;
  const auto coordinate = [&] {
    const double around = random->Real(-1, 1);
    return around +
           random->Pick<double>({0, 0, 1e3, -1e6, border / 2, border, -border, 2 * border});
  };
  const double x = coordinate(), y = coordinate();
  const double heading = random->OneIn(4) ? 0 : random->Real(-M_PI, M_PI);
  return {x, y, heading, SinCos(heading)};
}

TEST(CornerCells, EqualThoseOfSingleCorners) {
  RandomSource random(1);
  int outside = 0;
  for (int round = 0; round < 20000; round++) {
    const Body body = RandomBody(&random);
    const Placed at = RandomPlace(&random);
    CornerCells cells;
    const bool fits = FindCells(body, at, kCells, &cells);
    bool all_fit = true;
    for (size_t i = 0; i < body.corners.size(); i++) {
      const point_t& p = body.corners[i];
      const double x = (at.x + p.x * at.turn.cosine - p.y * at.turn.sine) * kCells;
      const double y = (at.y + p.x * at.turn.sine + p.y * at.turn.cosine) * kCells;
      const double limit = internal::grid::kMaxCell;
      all_fit = all_fit && std::fabs(std::floor(x)) < limit && std::fabs(std::floor(y)) < limit;
      if (!fits) continue;
      ASSERT_EQ(cells.x[i], std::floor(x)) << round;
      ASSERT_EQ(cells.y[i], std::floor(y)) << round;
    }
    ASSERT_EQ(fits, all_fit) << round;
    outside += !fits;
  }
  EXPECT_GT(outside, 1000);
  EXPECT_LT(outside, 19000);
}

}  // namespace
}  // namespace Stg::rows
