// SPDX-License-Identifier: GPL-2.0-or-later

#include "motion/separation.hh"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "support/motion_world.hh"

namespace {

using Stg::motion::Hull;
using Stg::motion::kHard;
using Stg::motion::Moving;
using Stg::motion::SafePart;
using Stg::motion::Separate;
using Stg::motion::Separation;
using test::Numbers;
using test::UnitVector;
using test::Vector;

struct Convex {
  std::vector<Vector> corners;
  double radius = 0.0;
  Hull hull() const { return {corners.data(), static_cast<uint32_t>(corners.size()), radius}; }
};

Convex RandomConvex(Numbers* random, Vector center) {
  Convex convex;
  const int count = 1 + static_cast<int>(8.0 * (*random)());
  const double size = random->Between(0.05, 0.4), start = random->Between(0.0, 6.0);
  for (int i = 0; i < count; i++)
    convex.corners.push_back(center + size * UnitVector(start + 2.0 * M_PI * i / count));
  if (count == 1 || (*random)() < 0.3) convex.radius = random->Between(0.01, 0.3);
  return convex;
}

double DistanceToSegment(Vector p, Vector a, Vector b) {
  const Vector edge = b - a;
  const double square = Dot(edge, edge);
  const double t = square > 0.0 ? std::clamp(Dot(p - a, edge) / square, 0.0, 1.0) : 0.0;
  return Length(p - a - t * edge);
}

/// Distance of the corners and edges; right unless the cores overlap.
double Distance(const Convex& a, const Convex& b) {
  double least = 1e9;
  for (const auto& [host, guest] : {std::pair(&a, &b), std::pair(&b, &a)})
    for (size_t i = 0; i < host->corners.size(); i++)
      for (const Vector& p : guest->corners)
        least = std::min(least, DistanceToSegment(p, host->corners[i],
                                                  host->corners[(i + 1) % host->corners.size()]));
  return least - a.radius - b.radius;
}

Convex Moved(const Convex& convex, Vector center, const Stg::motion::Motion& motion, double part) {
  Convex moved = convex;
  const Stg::SineCosine turn = Stg::SinCos(part * motion.turn);
  for (Vector& p : moved.corners)
    p = center + part * Vector{motion.x, motion.y} + Rotate(p - center, turn.sine, turn.cosine);
  return moved;
}

TEST(Separation, IsTheDistanceOfConvexOutlines) {
  Numbers random(1);
  int apart = 0;
  for (int k = 0; k < 20000; k++) {
    const Convex a = RandomConvex(&random, {0.0, 0.0});
    const Convex b = RandomConvex(&random, {random.Between(-1.0, 1.0), random.Between(-1.0, 1.0)});
    const Separation found = Separate(a.hull(), b.hull(), UnitVector(random.Between(0.0, 6.0)));
    EXPECT_NEAR(Length(found.normal), 1.0, 1e-12);
    EXPECT_NEAR(GapAcross(a.hull(), b.hull(), found.normal), found.gap, 1e-12);
    if (found.gap + a.radius + b.radius <= 0.0) continue;  // the cores overlap
    ASSERT_NEAR(found.gap, Distance(a, b), 1e-9) << k;
    apart++;
  }
  EXPECT_GT(apart, 10000);
}

TEST(Separation, OfOverlappingSquaresIsAlongTheLeastOverlap) {
  Convex a, b;
  a.corners = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  b.corners = {{0.9, 0.3}, {1.9, 0.3}, {1.9, 1.3}, {0.9, 1.3}};
  const Separation found = Separate(a.hull(), b.hull(), {0.0, 1.0});
  EXPECT_NEAR(found.gap, -0.1, 1e-12);
  EXPECT_NEAR(found.normal.x, 1.0, 1e-12);
}

TEST(SafePart, LetsOutlinesThatOverlapGoNoDeeper) {
  Numbers random(4);
  int hindered = 0, free = 0;
  for (int k = 0; k < 5000; k++) {
    const Vector center_b = random.Between(0.0, 0.5) * UnitVector(random.Between(0.0, 6.3));
    const Convex a = RandomConvex(&random, {0.0, 0.0}), b = RandomConvex(&random, center_b);
    const double gap = Separate(a.hull(), b.hull(), {1.0, 0.0}).gap;
    if (gap >= 0.0) continue;
    const auto motion = [&] {
      return Stg::motion::Motion{random.Between(-0.2, 0.2), random.Between(-0.2, 0.2),
                                 random() < 0.5 ? 0.0 : random.Between(-1.0, 1.0)};
    };
    const Moving first{a.hull(), 0.4, {0.0, 0.0}, motion()};
    const Moving second{b.hull(), 0.4, center_b, motion()};
    const double part = SafePart(first, second, UnitVector(random.Between(0.0, 6.3)));
    ASSERT_GE(part, 0.0);
    ASSERT_LE(part, 1.0);
    const Convex after_a = Moved(a, {0.0, 0.0}, first.motion, part);
    const Convex after_b = Moved(b, center_b, second.motion, part);
    ASSERT_GE(Separate(after_a.hull(), after_b.hull(), {1.0, 0.0}).gap, gap - 1e-9) << k;
    (part < 1.0 ? hindered : free)++;
  }
  EXPECT_GT(hindered, 500);
  EXPECT_GT(free, 100);
}

TEST(SafePart, KeepsOutlinesApartAllTheWay) {
  Numbers random(2);
  int hindered = 0, free = 0;
  double wasted = 0.0;
  for (int k = 0; k < 20000; k++) {
    const Vector center_b = random.Between(0.2, 1.0) * UnitVector(random.Between(0.0, 6.3));
    const Convex a = RandomConvex(&random, {0.0, 0.0}), b = RandomConvex(&random, center_b);
    const double gap = Separate(a.hull(), b.hull(), {1.0, 0.0}).gap;
    if (gap < 0.0) continue;
    const double speed = random() < 0.3 ? 1e-3 : random.Between(0.0, 1.0);
    const auto core = [](const Convex& c, Vector center) {
      double most = 0.0;
      for (const Vector& p : c.corners) most = std::max(most, Length(p - center));
      return most;
    };
    const auto motion = [&] {
      return Stg::motion::Motion{speed * random.Between(-1.0, 1.0),
                                 speed * random.Between(-1.0, 1.0),
                                 random() < 0.3 ? 0.0 : speed * random.Between(-2.0, 2.0)};
    };
    const Moving first{a.hull(), core(a, {0.0, 0.0}), {0.0, 0.0}, motion()};
    const Moving second{b.hull(), core(b, center_b), center_b, motion()};
    const double part = SafePart(first, second, UnitVector(random.Between(0.0, 6.3)));
    ASSERT_GE(part, 0.0);
    ASSERT_LE(part, 1.0);
    const double keep = std::min(gap, kHard) - 1e-9;
    for (int i = 1; i <= 40; i++) {
      const double t = part * i / 40.0;
      const double now =
          Distance(Moved(a, {0.0, 0.0}, first.motion, t), Moved(b, center_b, second.motion, t));
      ASSERT_GE(now, keep) << k << ", part " << t << " of " << part;
    }
    // Not much more is lost than must be.
    double possible = part;
    while (possible < 1.0 && Distance(Moved(a, {0.0, 0.0}, first.motion, possible),
                                      Moved(b, center_b, second.motion, possible)) > kHard)
      possible += 0.01;
    wasted += std::min(possible, 1.0) - part;
    (part < 1.0 ? hindered : free)++;
  }
  EXPECT_GT(hindered, 1000);
  EXPECT_GT(free, 1000);
  EXPECT_LT(wasted / hindered, 0.3);
}

}  // namespace
