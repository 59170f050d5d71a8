// SPDX-License-Identifier: GPL-2.0-or-later
//
// Quasi-static pushing against closed forms: Lynch and Mason, "Stable pushing: mechanics,
// controllability, and planning" (1996), and sums of tractions.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/motion_world.hh"

namespace {

using test::MotionWorld;
using test::Vector;

constexpr double kSkin = Stg::motion::kSkin;

/// A robot whose outline is a wedge, which touches with one corner. Far stronger than what it
/// pushes.
size_t AddWedge(MotionWorld* world, double x, double y, double friction) {
  const uint32_t wedge = world->AddPolygon({{0.0, 0.0}, {-0.1, 0.1}, {-0.1, -0.1}});
  const size_t robot = world->AddRobot(wedge, x, y, 0.0, friction);
  world->bodies.grip[robot] = 1e5;
  world->bodies.arm[robot] = 10.0;
  return robot;
}

TEST(Pushing, AStickingContactMovesABoxAsLynchAndMasonSay) {
  for (const double offset : {0.0, 0.03, 0.06, 0.1, 0.15, -0.1}) {
    SCOPED_TRACE(offset);
    MotionWorld world;
    world.AddBox(world.AddRectangle(0.4, 0.4), 0.0, 0.0, 4.0, 10.0);
    const size_t robot = AddWedge(&world, -0.2 - kSkin, offset, 10.0);
    world.CommandInWorld(robot, 0.05, 0.0);
    world.Step();
    // The velocity of the box from that of the contact at (x, y), with c the greatest torque over
    // the greatest force.
    const double c = world.bodies.arm[0], x = -0.2, y = offset, push = 0.005;
    EXPECT_NEAR(c, 0.38259785 * 0.4, 1e-4);  // of a square
    const double sum = c * c + x * x + y * y;
    const double vx = (c * c + x * x) * push / sum, vy = x * y * push / sum;
    EXPECT_NEAR(world.bodies.x[0], vx, 0.002 * push);
    EXPECT_NEAR(world.bodies.y[0], vy, 0.002 * push);
    EXPECT_NEAR(world.bodies.heading[0], (x * vy - y * vx) / (c * c), 0.002 * push / c);
  }
}

TEST(Pushing, AStickingContactTurnsADiscAsLynchAndMasonSayOverAMetre) {
  // A disc that is pushed along x by a small round robot which does not turn. It rolls on the
  // robot, so the contact moves on both, and the equation of the motion is integrated.
  MotionWorld world;
  const double r = 0.2, bearing = 0.05;  // of the robot, seen from the disc, against -x
  world.AddBox(world.AddDisc(r), 0.0, 0.0, 4.0, 10.0);
  double disc_x = 0.0, disc_y = 0.0;
  double robot_x = -(r + 0.05 + kSkin) * std::cos(bearing);
  const double robot_y = (r + 0.05 + kSkin) * std::sin(bearing);
  const size_t robot = world.AddRobot(world.AddDisc(0.05), robot_x, robot_y, 0.0, 10.0);
  world.bodies.grip[robot] = 1e5;
  world.bodies.arm[robot] = 1e3;  // does not turn
  EXPECT_NEAR(world.bodies.arm[0], 2.0 / 3.0 * r, 1e-12);
  const double c = world.bodies.arm[0];
  for (int step = 0; step < 200; step++) {
    world.CommandInWorld(robot, 0.05, 0.0);
    world.Step();
    constexpr int kParts = 100;
    for (int k = 0; k < kParts; k++) {
      const double v = 0.05 * world.dt / kParts;
      const double dx = robot_x - disc_x, dy = robot_y - disc_y, l = std::sqrt(dx * dx + dy * dy);
      const double x = dx * r / l, y = dy * r / l, sum = c * c + x * x + y * y;
      disc_x += (c * c + x * x) * v / sum;
      disc_y += x * y * v / sum;
      robot_x += v;
    }
  }
  EXPECT_NEAR(world.bodies.x[robot], robot_x, 1e-9);
  EXPECT_GT(disc_x, 0.8);
  EXPECT_LT(disc_y, -0.05);
  EXPECT_NEAR(world.bodies.x[0], disc_x, 0.01);
  EXPECT_NEAR(world.bodies.y[0], disc_y, 0.01);
}

TEST(Pushing, ALineContactPushesABoxStraightForAMetre) {
  MotionWorld world;
  world.AddBox(world.AddRectangle(0.4, 0.4), 0.0, 0.05, 4.0, 0.2);
  const size_t robot = world.AddRobot(world.AddRectangle(0.3, 0.3), -0.4, 0.0, 0.0, 0.2);
  world.CommandInWorld(robot, 0.2, 0.0);
  world.Steps(60);
  const double x = world.bodies.x[0];
  EXPECT_GT(x, 0.8);
  world.Steps(50);
  EXPECT_NEAR(world.bodies.x[0] - x, 1.0, 0.001);
  EXPECT_NEAR(world.bodies.y[0], 0.05, 1e-3);
  EXPECT_NEAR(world.bodies.heading[0], 0.0, 1e-3);
}

TEST(Pushing, ALineContactTurnsABoxWithinTheRangeOfStableDirectionsAndNotOutside) {
  // A robot with a wide front turns about a point far to its side while it pushes. The box keeps to
  // the front if the centre of rotation is at a distance that its friction and the line's width
  // allow; about a near one it slips off.
  const auto slip = [](double turn) {
    MotionWorld world;
    world.AddBox(world.AddRectangle(0.4, 0.4), 0.0, 0.0, 4.0, 0.5);
    const size_t robot = world.AddRobot(world.AddRectangle(0.4, 0.4), -0.4 - kSkin, 0.0, 0.0, 0.5);
    world.bodies.grip[robot] = 1e4;
    for (int i = 0; i < 30; i++) {
      world.Command(robot, 0.1, 0.0, turn);
      world.Step();
    }
    const Vector to_box = world.PositionOf(0) - world.PositionOf(robot);
    const Vector ahead = test::UnitVector(world.bodies.heading[robot]);
    return std::fabs(Cross(ahead, to_box)) +
           std::fabs(MotionWorld::Wrap(world.bodies.heading[0] - world.bodies.heading[robot]));
  };
  EXPECT_LT(slip(0.05), 0.01);  // radius 2 m
  EXPECT_GT(slip(0.5), 0.05);   // radius 0.2 m
}

/// The speed of a box that robots with a traction of 10 N each push with 0.2 m/s.
double SpeedOfBox(int robots, double load) {
  MotionWorld world;
  world.AddBox(world.AddRectangle(0.6, 0.4 * robots + 0.4), 0.0, 0.0, 10.0 * robots * load, 0.2);
  const uint32_t disc = world.AddDisc(0.19);
  for (int i = 0; i < robots; i++)
    world.Command(world.AddRobot(disc, -0.6, 0.4 * (i - 0.5 * (robots - 1)), 0.0, 0.2), 0.2, 0.0,
                  0.0);
  world.Steps(10);
  const double begin = world.bodies.x[0];
  world.Steps(100);
  EXPECT_GE(world.LeastGap(), 1e-9);
  return (world.bodies.x[0] - begin) / 10.0;
}

TEST(Pushing, TractionsOfSeveralRobotsAddUp) {
  for (const int robots : {1, 3, 6}) {
    for (const double load : {0.5, 2.5 / 3.0, 0.9, 0.97})
      EXPECT_NEAR(SpeedOfBox(robots, load), 0.2, 0.001) << robots << " robots, load " << load;
    for (const double load : {1.03, 1.1, 3.5 / 3.0, 2.0})
      EXPECT_NEAR(SpeedOfBox(robots, load), 0.0, 1e-6) << robots << " robots, load " << load;
  }
}

/// The speed of the first of a chain of boxes that a robot pushes with 0.2 m/s.
double SpeedOfChain(int boxes, double load) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  for (int i = 0; i < boxes; i++)
    world.AddBox(square, 0.45 * (boxes - i), 0.0, 10.0 * load / boxes, 0.2);
  const size_t robot = world.AddRobot(world.AddDisc(0.2), 0.0, 0.0, 0.0, 0.2);
  world.Command(robot, 0.2, 0.0, 0.0);
  world.Steps(10 + 5 * boxes);
  const double begin = world.bodies.x[0];
  world.Steps(50);
  EXPECT_GE(world.LeastGap(), 1e-9);
  return (world.bodies.x[0] - begin) / 5.0;
}

TEST(Pushing, AChainOfBoxesMovesAtFullSpeedOrNotAtAll) {
  EXPECT_NEAR(SpeedOfChain(3, 0.75), 0.2, 0.001);
  EXPECT_NEAR(SpeedOfChain(3, 0.95), 0.2, 0.001);
  EXPECT_NEAR(SpeedOfChain(3, 1.05), 0.0, 1e-6);
  EXPECT_NEAR(SpeedOfChain(3, 1.2), 0.0, 1e-6);
  EXPECT_NEAR(SpeedOfChain(10, 0.75), 0.2, 0.001);
  EXPECT_NEAR(SpeedOfChain(10, 1.2), 0.0, 1e-6);
}

TEST(Pushing, ABoxStopsAsSoonAsNobodyPushes) {
  MotionWorld world;
  world.AddBox(world.AddRectangle(0.6, 0.6), 0.0, 0.0, 5.0, 0.2);
  world.AddRobot(world.AddDisc(0.2), -1.0, 0.05, 0.0, 0.2);
  world.Command(1, 0.3, 0.0, 0.0);
  world.Steps(60);
  const test::Columns before = world.bodies;
  EXPECT_GT(before.x[0], 1.0);
  EXPECT_LT(before.heading[0], -0.1);  // pushed beside its centre
  world.Command(1, 0.0, 0.0, 0.0);
  world.Steps(10);
  EXPECT_EQ(world.bodies.x[0], before.x[0]);
  EXPECT_EQ(world.bodies.y[0], before.y[0]);
  EXPECT_EQ(world.bodies.heading[0], before.heading[0]);
}

TEST(Pushing, APushedBoxStopsAtAWallAndItsRobotsWithIt) {
  MotionWorld world;
  world.AddWall({2.0, -5.0}, {2.0, 5.0}, 0.2);
  world.AddBox(world.AddRectangle(0.3, 0.3), 0.6, 0.0, 5.0, 0.2);
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.0, 0.0, 0.2);
  world.Command(1, 0.3, 0.0, 0.0);
  world.Steps(100);
  EXPECT_NEAR(world.bodies.x[0], 1.85, 0.002);
  EXPECT_NEAR(world.bodies.x[1], 1.5, 0.003);
  const test::Columns before = world.bodies;
  world.Steps(10);
  EXPECT_NEAR(world.bodies.x[0], before.x[0], 1e-4);
  EXPECT_NEAR(world.bodies.x[1], before.x[1], 1e-4);
  EXPECT_LT(world.bodies.made[1], 0.01);
}

TEST(Pushing, BodiesWithoutOutlineOrSizeStayFinite) {
  MotionWorld world;
  const uint32_t nothing = world.shapes.Add({}, {});
  const uint32_t point = world.AddPolygon({{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}});
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.0, 0.0, 0.2);
  world.AddBox(world.AddRectangle(0.4, 0.4), 0.5, 0.0, 4.0, 0.2);
  for (const uint32_t shape : {nothing, point}) {
    world.AddBox(shape, 0.72, 0.05, 4.0, 0.2);
    world.Command(world.AddRobot(shape, -0.3, 0.05, 0.0, 0.2), 0.2, 0.0, 1.0);
  }
  world.Command(0, 0.2, 0.0, 0.0);
  world.Steps(30);
  for (size_t i = 0; i < world.bodies.size(); i++)
    EXPECT_TRUE(std::isfinite(world.bodies.x[i] + world.bodies.y[i] + world.bodies.heading[i]))
        << i;
  EXPECT_NEAR(world.bodies.x[1], 1.0, 0.001);
  EXPECT_EQ(world.bodies.x[2], 0.72);  // nothing touches it
  EXPECT_GT(world.bodies.x[4], 1.15);  // pushed by the box
}

TEST(Pushing, MotionsTooSmallForTheirSquaresStayFinite) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  world.AddRobot(square, 0.0, 0.0);
  world.AddBox(square, 0.4 + kSkin, 0.0, 4.0);                 // touches it
  world.AddBox(world.AddRectangle(0.1, 1.0), -0.5, 0.0, 4.0);  // is only near
  world.Command(0, 0.0, 0.0, 1e-200);
  world.Steps(3);
  for (size_t i = 0; i < 3; i++)
    EXPECT_TRUE(std::isfinite(world.bodies.x[i] + world.bodies.y[i] + world.bodies.heading[i]));
}

TEST(Pushing, AConcaveBoxIsDraggedByARobotInsideOfIt) {
  MotionWorld world;
  const uint32_t cup = world.AddPolygon({{-0.5, -0.5},
                                         {0.5, -0.5},
                                         {0.5, 0.5},
                                         {-0.5, 0.5},
                                         {-0.5, 0.4},
                                         {0.4, 0.4},
                                         {0.4, -0.4},
                                         {-0.5, -0.4}});
  world.AddBox(cup, 0.0, 0.0, 3.0, 0.2);
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.0, 0.0, 0.2);
  world.CommandInWorld(1, 0.2, 0.0);
  world.Steps(60);
  EXPECT_NEAR(world.bodies.x[0], 1.0, 0.002);
  for (int i = 0; i < 100; i++) {
    world.CommandInWorld(1, 0.0, 0.2);
    world.Step();
    ASSERT_GE(world.LeastGap(), 1e-9);
  }
  EXPECT_GT(world.bodies.y[0], 1.0);
}

/// The way of a box at the end of a bar that a robot with this shape turns.
double WayOfTurnedBox(double grip) {
  MotionWorld world;
  world.AddBox(world.AddDisc(0.1), 0.9, 0.111, grip);
  world.AddRobot(world.AddRectangle(2.0, 0.02), 0.0, 0.0);
  world.bodies.arm[1] = 0.2;  // greatest torque: 2 N m
  world.Command(1, 0.0, 0.0, 0.2);
  world.Steps(20);
  EXPECT_GE(world.LeastGap(), 1e-9);
  return Length(world.PositionOf(0) - Vector{0.9, 0.111});
}

TEST(Pushing, TheTorqueOfARobotIsLimited) {
  EXPECT_GT(WayOfTurnedBox(1.0), 0.3);
  EXPECT_LT(WayOfTurnedBox(4.0), 0.01);
}

TEST(Pushing, ALongLeverTurnsNoFartherThanWasForeseen) {
  // A bar between a pin and a robot near to it: its ends move much faster than the robot.
  for (int k = 0; k < 60; k++) {
    MotionWorld world;
    const Vector pin[] = {{-0.01, 0.012}, {0.01, 0.012}, {0.01, 0.03}, {-0.01, 0.03}};
    world.walls.Add(pin, true);
    world.walls.Index();
    world.AddBox(world.AddRectangle(3.0, 0.02), 0.0, 0.0, 1.0);
    const size_t robot = world.AddRobot(world.AddDisc(0.01), 0.04, -0.021);
    world.bodies.grip[robot] = 1e4;
    const uint32_t disc = world.AddDisc(0.1);
    world.AddRobot(disc, 1.3, 0.12 + 0.01 * k);  // stand in the way
    world.AddRobot(disc, -1.3, -0.12 - 0.01 * k);
    world.AddBox(disc, 0.9, 0.12 + 0.007 * k, 0.5);
    for (int i = 0; i < 20; i++) {
      world.CommandInWorld(robot, 0.0, 0.05 + 0.01 * k);
      world.Step();
      ASSERT_GE(world.LeastGap(), 1e-9) << k << " step " << i;
    }
  }
}

TEST(Pushing, WhatIsSqueezedOutGoesNoFartherThanWasForeseen) {
  // A disc between two plates that close like a wedge is much faster than they are.
  for (int k = 0; k < 60; k++) {
    MotionWorld world;
    const uint32_t plate = world.AddRectangle(2.0, 0.1);
    const double slope = 0.1, y = (0.1 + 0.05 + kSkin) / std::cos(slope);
    world.AddRobot(plate, 0.0, y, slope);
    world.AddRobot(plate, 0.0, -y, -slope);
    world.AddBox(world.AddDisc(0.1), 0.0, 0.0, 0.5);
    world.AddRobot(world.AddRectangle(0.1, 0.05), 0.151 + 0.002 * k, 0.0);  // stands
    for (size_t i = 0; i < 2; i++) {
      world.bodies.grip[i] = 1e4;
      world.bodies.arm[i] = 1e3;
    }
    for (int step = 0; step < 10; step++) {
      world.CommandInWorld(0, 0.0, -0.1);
      world.CommandInWorld(1, 0.0, 0.1);
      world.Step();
      ASSERT_GE(world.LeastGap(), 1e-9) << k << " step " << step;
    }
    EXPECT_GT(world.bodies.x[2], std::min(0.001 * k - 0.002, 0.02));
  }
}

TEST(Pushing, StepsOfFourMillimetresGiveNearlyTheMotionOfShorterOnes) {
  // A robot pushes a box beside its centre, and the box meets others on its way.
  const auto push = [](int steps) {
    MotionWorld world;
    world.dt = 1.0 / steps;
    world.AddRobot(world.AddDisc(0.1), -0.32, 0.05, 0.0, 0.3);
    world.AddBox(world.AddRectangle(0.4, 0.4), 0.0, 0.0, 4.0, 0.3);
    world.AddBox(world.AddRectangle(0.1, 0.1), 0.35, 0.1, 0.5, 0.3);
    world.AddBox(world.AddDisc(0.1), 0.6, -0.1, 0.5, 0.3);
    for (int i = 0; i < steps; i++) {
      world.CommandInWorld(0, 0.4, 0.0);
      world.Step();
    }
    return world.bodies;
  };
  const test::Columns exact = push(400), coarse = push(100);
  EXPECT_GT(exact.x[2], 0.4);
  EXPECT_GT(std::fabs(exact.heading[1]), 0.1);
  for (size_t i = 0; i < 4; i++) {
    EXPECT_NEAR(coarse.x[i], exact.x[i], 0.005) << i;
    EXPECT_NEAR(coarse.y[i], exact.y[i], 0.005) << i;
  }
  EXPECT_NEAR(coarse.heading[1], exact.heading[1], 0.01);
}

}  // namespace
