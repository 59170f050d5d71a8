// SPDX-License-Identifier: GPL-2.0-or-later
//
// Many bodies: heaps that leave, doors, random outlines and speeds, and what results may not depend
// on.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/motion_world.hh"

namespace {

using test::MotionWorld;
using test::Numbers;
using test::UnitVector;
using test::Vector;

/// The number of robots that leave a heap within 30 s.
int LeaveHeap(int count, int corners, double friction) {
  MotionWorld world;
  Numbers random(static_cast<uint64_t>(count));
  const double ring = 0.5 * std::sqrt(count) + 1.0;
  const uint32_t shape = corners == 0   ? world.AddDisc(0.2)
                         : corners == 4 ? world.AddRectangle(0.3, 0.3)
                                        : world.AddRound(corners, 0.2);
  while (world.bodies.size() < static_cast<size_t>(count)) {
    const Vector p{random.Between(-ring, ring), random.Between(-ring, ring)};
    bool free = true;
    for (size_t i = 0; i < world.bodies.size(); i++) free &= Length(world.PositionOf(i) - p) > 0.6;
    if (free) world.AddRobot(shape, p.x, p.y, random.Between(-M_PI, M_PI), friction);
  }
  for (int k = 0; k < 400 + 10 * static_cast<int>(ring); k++) {
    for (size_t i = 0; i < world.bodies.size(); i++) world.SteerTo(i, -world.PositionOf(i), 0.3);
    world.Step();
  }
  double heap_radius = 0.0;
  for (size_t i = 0; i < world.bodies.size(); i++)
    heap_radius = std::max(heap_radius, Length(world.PositionOf(i)));
  EXPECT_GE(world.LeastGap(), 1e-9);
  EXPECT_LE(world.LeastGap(), 1e-3);
  for (int k = 0; k < 300; k++) {
    for (size_t i = 0; i < world.bodies.size(); i++) world.SteerTo(i, world.PositionOf(i), 0.3);
    world.Step();
    if (k % 20 == 0) {
      EXPECT_GE(world.LeastGap(), 1e-9);
    }
  }
  int left = 0;
  for (size_t i = 0; i < world.bodies.size(); i++)
    left += Length(world.PositionOf(i)) > heap_radius + 1.0;
  return left;
}

TEST(Heaps, RoundRobotsThatGatheredAllLeave) {
  EXPECT_EQ(LeaveHeap(30, 0, 0.0), 30);
  EXPECT_EQ(LeaveHeap(30, 0, 0.2), 30);
  EXPECT_EQ(LeaveHeap(150, 0, 0.2), 150);
}

TEST(Heaps, PolygonsThatGatheredAllLeave) {
  EXPECT_EQ(LeaveHeap(30, 16, 0.2), 30);
  EXPECT_EQ(LeaveHeap(30, 4, 0.2), 30);
}

TEST(Heaps, ACrowdLeavesAHallThroughADoor) {
  MotionWorld world;
  const Vector hall[] = {{0.0, 0.4},   {0.0, 3.0},  {-6.0, 3.0},
                         {-6.0, -3.0}, {0.0, -3.0}, {0.0, -0.4}};
  world.walls.Add(hall, false);
  world.walls.Index();
  const uint32_t disc = world.AddDisc(0.15);
  constexpr size_t kRobots = 40;
  for (size_t i = 0; i < kRobots; i++)
    world.AddRobot(disc, -5.0 + 0.5 * static_cast<double>(i % 8),
                   -1.0 + 0.5 * static_cast<double>(i / 8));
  Numbers random(1);
  std::vector<int> away(kRobots);  // steps for which a robot goes elsewhere
  std::vector<double> elsewhere(kRobots);
  size_t inside = kRobots;
  for (int step = 0; step < 2000 && inside > 0; step++) {
    inside = 0;
    for (size_t i = 0; i < kRobots; i++) {
      const Vector p = world.PositionOf(i);
      inside += p.x < 0.3 ? 1 : 0;
      // Through the door, then on, in different directions. Who gets stuck in the crowd goes back a
      // little, as robots would form an arch around the door otherwise.
      if (p.x < 0.25 && world.bodies.made[i] < 0.2 && random() < 0.1) {
        away[i] = 8;
        elsewhere[i] = random.Between(-M_PI, M_PI);
      }
      const Vector aside{1.0, 0.1 * static_cast<double>(i % 21) - 1.0};
      const Vector to = away[i]-- > 0 ? UnitVector(elsewhere[i])
                        : p.x < 0.25  ? Vector{0.4, 0.0} - p
                                      : aside;
      world.CommandInWorld(i, 0.4 * to.x / Length(to), 0.4 * to.y / Length(to));
    }
    world.Step();
    if (step % 50 == 0) {
      ASSERT_GE(world.LeastGap(), 1e-9) << step;
    }
  }
  EXPECT_EQ(inside, 0u);
}

/// A random outline: a disc, a thin rod, a polygon, a star, an L; small or large.
uint32_t AddRandomShape(MotionWorld* world, Numbers* random) {
  const double size = (*random)() < 0.2    ? random->Between(0.005, 0.03)
                      : (*random)() < 0.05 ? random->Between(1.0, 3.0)
                                           : random->Between(0.1, 0.4);
  switch (static_cast<int>(6.0 * (*random)())) {
    case 0:
      return world->AddDisc(size, {random->Between(-0.1, 0.1), 0.0});
    case 1:
      return world->AddRectangle(2.0 * size, random->Between(0.001, 0.05));
    case 2:
      return world->AddRound(3 + static_cast<int>(14.0 * (*random)()), size);
    case 3:
      return world->AddPolygon({{-size, -size},
                                {size, -size},
                                {size, -0.5 * size},
                                {-0.5 * size, -0.5 * size},
                                {-0.5 * size, size},
                                {-size, size}});
    case 4: {
      std::vector<Vector> star;
      for (int i = 0; i < 14; i++)
        star.push_back((i % 2 == 0 ? size : 0.4 * size) * UnitVector(i * M_PI / 7.0));
      return world->AddPolygon(star);
    }
    default:
      return world->AddRectangle(size, size);
  }
}

void CommandAtRandom(MotionWorld* world, Numbers* random, double speed) {
  for (size_t i = 0; i < world->bodies.size(); i++) {
    if (world->bodies.pushable[i] || (*random)() > 0.2) continue;
    world->Command(i, speed * random->Between(-1.0, 1.0), speed * random->Between(-0.5, 0.5),
                   random->Between(-2.0, 2.0));
    if ((*random)() < 0.1) world->Command(i, 0.0, 0.0, 0.0);
  }
}

MotionWorld RandomHeap(uint64_t seed) {
  MotionWorld world;
  Numbers random(seed);
  const double half = 2.0;
  world.AddRoom(-half, -half, half, half);
  const Vector inner[] = {{-1.0, 0.3}, {-0.4, 0.31}, {-0.4, 1.2}};
  world.walls.Add(inner, false, {-1e9, 1e9}, 0.3);
  world.walls.Index();
  for (int attempt = 0; attempt < 150 && world.bodies.size() < 40; attempt++) {
    MotionWorld grown = world;
    const uint32_t shape = AddRandomShape(&grown, &random);
    const double x = random.Between(-half, half), y = random.Between(-half, half);
    const double heading = random.Between(-M_PI, M_PI), friction = random.Between(0.0, 0.6);
    const double grip = random.Between(1.0, 12.0);
    if (random() < 0.3)
      grown.AddBox(shape, x, y, grip, friction);
    else
      grown.AddRobot(shape, x, y, heading, friction);
    if (grown.LeastGap() > 1e-3) world = grown;
  }
  return world;
}

TEST(Heaps, RandomOutlinesNeverOverlapAtAnySpeedAndStep) {
  double made = 0.0;
  size_t movers = 0;
  for (uint64_t seed = 1; seed <= 12; seed++) {
    SCOPED_TRACE(seed);
    MotionWorld world = RandomHeap(seed);
    ASSERT_GT(world.bodies.size(), 20u);
    world.dt = seed % 3 == 0 ? 0.001 : seed % 3 == 1 ? 0.1 : 1.0;
    const double speed = seed % 4 == 0 ? 100.0 : seed % 4 == 1 ? 0.3 : seed % 4 == 2 ? 2.0 : 20.0;
    Numbers random(seed + 1000);
    for (int step = 0; step < 40; step++) {
      CommandAtRandom(&world, &random, speed);
      world.Step();
      ASSERT_GE(world.LeastGap(), 1e-9) << "step " << step;
      for (size_t i = 0; i < world.bodies.size(); i++) {
        const double most = 2.0 + world.shapes.shapes[world.bodies.shape[i]].bound;
        ASSERT_LT(std::fabs(world.bodies.x[i]), most);
        ASSERT_LT(std::fabs(world.bodies.y[i]), most);
        made += world.bodies.made[i];
        movers++;
      }
    }
  }
  EXPECT_GT(made / static_cast<double>(movers), 0.2);
}

/// A corridor with narrow doors, a chain of things that a robot pushes through it, and robots that
/// want to pass.
MotionWorld NarrowHeap(uint64_t seed) {
  MotionWorld world;
  Numbers random(seed);
  const double width = random.Between(0.5, 0.8), door = random.Between(0.25, 0.5);
  world.AddRoom(-4.0, -width, 4.0, width);
  for (const double x : {-1.0, 1.5})
    for (const double side : {-1.0, 1.0}) {
      const Vector post[] = {{x, side * width}, {x, side * 0.5 * door}};
      world.walls.Add(post, false, {-1e9, 1e9}, random.Between(0.0, 0.5));
    }
  world.walls.Index();
  const double size = random.Between(0.1, door - 0.05), friction = random.Between(0.0, 0.5);
  const uint32_t link = random() < 0.5 ? world.AddRectangle(size, size) : world.AddDisc(0.5 * size);
  const uint32_t robot = random() < 0.5 ? world.AddDisc(0.1) : world.AddRectangle(0.2, 0.15);
  double x = -2.0;
  for (int i = 0; i < 8; i++, x += size + random.Between(0.0002, 0.02))
    world.AddBox(link, x, random.Between(-0.02, 0.02), random.Between(0.2, 2.0), friction);
  for (int i = 0; i < 6; i++) world.AddRobot(robot, -3.7 + 0.25 * i, 0.0, 0.0, friction);
  for (int i = 0; i < 3; i++) world.AddRobot(robot, 2.0 + 0.4 * i, 0.1 * i, M_PI, friction);
  return world;
}

TEST(Heaps, ChainsAndRobotsInNarrowDoorsNeverOverlapAtAnySpeedAndStep) {
  double pushed = 0.0;
  for (uint64_t seed = 1; seed <= 36; seed++) {
    SCOPED_TRACE(seed);
    MotionWorld world = NarrowHeap(seed);
    ASSERT_GT(world.LeastGap(), 0.0);
    world.dt = seed % 3 == 0 ? 0.001 : seed % 3 == 1 ? 0.1 : 1.0;
    const double speeds[] = {0.3, 2.0, 20.0, 100.0};
    const double speed = speeds[seed / 3 % 4], begin = world.bodies.x[0];
    Numbers random(seed + 1000);
    for (int step = 0; step < 60; step++) {
      if (seed <= 24) CommandAtRandom(&world, &random, speed);
      for (size_t i = 8; i < 14; i++)
        if (seed > 24 || random() < 0.5) world.CommandInWorld(i, speed, 0.0);
      world.Step();
      ASSERT_GE(world.LeastGap(), 1e-9) << "step " << step;
      for (size_t i = 0; i < world.bodies.size(); i++) {
        ASSERT_LT(std::fabs(world.bodies.x[i]), 4.0);
        ASSERT_LT(std::fabs(world.bodies.y[i]), 0.8);
      }
    }
    pushed += world.bodies.x[0] - begin;
  }
  EXPECT_GT(pushed, 1.0);
}

TEST(Heaps, TheCheckFindsOverlaps) {
  MotionWorld world = RandomHeap(5);
  ASSERT_GT(world.LeastGap(), 0.0);
  world.bodies.x[3] = world.bodies.x[7] + 0.001;
  world.bodies.y[3] = world.bodies.y[7];
  EXPECT_LT(world.LeastGap(), 0.0);
}

TEST(Heaps, ResultsDoNotDependOnThreads) {
  constexpr size_t kRobots = 1500;  // so many that threads share the search for pairs
  MotionWorld alone = RandomHeap(3);
  for (size_t i = 0; i < kRobots; i++)
    alone.AddRobot(0, 10.0 + 0.5 * static_cast<double>(i % 50), static_cast<double>(i / 50) * 1.5);
  MotionWorld shared = alone;
  Stg::threads::WorkerPool workers(3);
  Numbers random_alone(5), random_shared(5);
  size_t islands = 0, told = 0;
  for (int step = 0; step < 50; step++) {
    CommandAtRandom(&alone, &random_alone, 0.5);
    alone.Step();
    CommandAtRandom(&shared, &random_shared, 0.5);
    shared.SetTargets();
    shared.contacts.Step(shared.shapes, shared.walls, &shared.bodies, &workers);
    islands = std::max(islands, shared.contacts.nearby().islands.size());
    ASSERT_EQ(shared.Hash(), alone.Hash()) << step;
    const auto a = alone.contacts.contacts(), b = shared.contacts.contacts();
    ASSERT_EQ(a.size(), b.size());
    told += a.size();
    for (size_t i = 0; i < a.size(); i++) {
      ASSERT_EQ(a[i].a, b[i].a);
      ASSERT_EQ(a[i].b, b[i].b);
      ASSERT_EQ(a[i].point.x, b[i].point.x);
    }
  }
  EXPECT_GT(islands, 50u);
  EXPECT_GT(told, 100u);
  EXPECT_GT(workers.shared_jobs(), 100u);
}

/// Outlines that a mirror or a quarter turn takes to themselves or to each other.
MotionWorld SymmetricHeap(bool mirror, int quarters) {
  MotionWorld world;
  Numbers random(17);
  const uint32_t shapes[] = {world.AddDisc(0.2), world.AddRectangle(0.3, 0.3),
                             world.AddRectangle(0.5, 0.1)};
  world.AddRoom(-1.2, -1.2, 1.2, 1.2);
  for (int i = 0; i < 20; i++) {
    Vector p{-0.96 + 0.48 * (i % 5), -0.9 + 0.6 * static_cast<double>(i / 5)};
    double heading = random.Between(-0.1, 0.1);
    if (mirror) {
      p.y = -p.y;
      heading = -heading;
    }
    for (int k = 0; k < quarters; k++) p = Left(p);
    heading = MotionWorld::Wrap(heading + 0.5 * M_PI * quarters);
    const uint32_t shape = shapes[i % 5 == 0 ? 2 : i % 2];
    if (i % 4 == 3)
      world.bodies.heading[world.AddBox(shape, p.x, p.y, 4.0, 0.2)] = heading;
    else
      world.AddRobot(shape, p.x, p.y, heading, 0.2);
  }
  return world;
}

void ExpectSymmetry(bool mirror, int quarters) {
  MotionWorld plain = SymmetricHeap(false, 0), other = SymmetricHeap(mirror, quarters);
  Numbers random(3);
  double moved = 0.0;
  const Vector begin = plain.PositionOf(0);
  for (int step = 0; step < 30; step++) {
    for (size_t i = 0; i < plain.bodies.size(); i++) {
      if (plain.bodies.pushable[i]) continue;
      const double sign = mirror ? -1.0 : 1.0;
      const double ahead = random.Between(-0.2, 0.5), aside = random.Between(-0.3, 0.3);
      const double turn = random.Between(-1.0, 1.0);
      plain.Command(i, ahead, aside, turn);
      other.Command(i, ahead, sign * aside, sign * turn);
    }
    plain.Step();
    other.Step();
    for (size_t i = 0; i < plain.bodies.size(); i++) {
      Vector p = plain.PositionOf(i);
      if (mirror) p.y = -p.y;
      for (int k = 0; k < quarters; k++) p = Left(p);
      ASSERT_NEAR(other.bodies.x[i], p.x, 1e-9) << "body " << i << ", step " << step;
      ASSERT_NEAR(other.bodies.y[i], p.y, 1e-9) << "body " << i << ", step " << step;
    }
  }
  moved = Length(plain.PositionOf(0) - begin);
  EXPECT_GT(moved, 0.01);
}

TEST(Heaps, AWorldTurnedByAQuarterGivesTheSameMotions) {
  for (const int quarters : {1, 2, 3}) ExpectSymmetry(false, quarters);
}

TEST(Heaps, AMirroredWorldGivesMirroredMotions) { ExpectSymmetry(true, 0); }

}  // namespace
