// SPDX-License-Identifier: GPL-2.0-or-later
//
// Contacts of single robots with walls and with each other: gaps, turns, slides, thin walls.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "support/motion_world.hh"

namespace {

using test::MotionWorld;
using test::UnitVector;
using test::Vector;

enum Outline { kDisc, kSixteenCorners, kSquare };

uint32_t AddShape(Outline outline, double radius, MotionWorld* world) {
  if (outline == kDisc) return world->AddDisc(radius);
  if (outline == kSixteenCorners) return world->AddRound(16, radius);
  return world->AddRectangle(2.0 * radius, 2.0 * radius);
}

TEST(Contacts, AFreeBodyArrivesExactlyAtItsTarget) {
  MotionWorld world;
  const uint32_t disc = world.AddDisc(0.2);
  for (int i = 0; i < 3; i++) world.AddRobot(disc, 0.1 + i, 0.3 - 0.5 * i, 0.7 * i);
  // The last two are near each other, so they are an island, but nothing hinders them.
  world.AddRobot(disc, 0.1 + 2.0, 0.3 - 1.0 + 0.41, 1.0);
  for (size_t i = 0; i < 4; i++) world.Command(i, 0.1, 0.0, 0.3);
  world.Step();
  EXPECT_EQ(world.contacts.nearby().islands.size(), 1u);
  for (size_t i = 0; i < 4; i++) {
    EXPECT_EQ(world.bodies.x[i], world.bodies.target_x[i]);
    EXPECT_EQ(world.bodies.y[i], world.bodies.target_y[i]);
    EXPECT_EQ(world.bodies.heading[i], world.bodies.target_heading[i]);
    EXPECT_EQ(world.bodies.made[i], 1.0);
  }
}

TEST(Contacts, AFreeMotionIsReversedToRounding) {
  MotionWorld world;
  world.AddRobot(world.AddRound(16, 0.2), 0.0, 0.0, 0.3);
  test::Numbers random(3);
  std::vector<Vector> made;
  for (int i = 0; i < 1000; i++) made.push_back({random() - 0.5, random() - 0.5});
  for (const Vector& m : made) {
    world.Command(0, m.x, 0.0, m.y);
    world.Step();
  }
  for (size_t i = made.size(); i-- > 0;) {
    world.Command(0, -made[i].x, 0.0, -made[i].y);
    world.Step();
  }
  EXPECT_NEAR(world.bodies.x[0], 0.0, 1e-12);
  EXPECT_NEAR(world.bodies.y[0], 0.0, 1e-12);
  EXPECT_NEAR(world.bodies.heading[0], 0.3, 1e-12);
}

TEST(Contacts, TheGapToAWallIsLessThanAMillimetreForAllHeadingsAndSpeeds) {
  for (const Outline outline : {kDisc, kSixteenCorners, kSquare})
    for (const double speed : {0.02, 0.6, 1.5})
      for (int k = 0; k < 48; k++) {
        SCOPED_TRACE(testing::Message() << outline << " " << speed << " m/s, heading " << k);
        const double heading = MotionWorld::Wrap(2.0 * M_PI * k / 48);
        const int steps = 20 + static_cast<int>(10.0 / speed);
        MotionWorld straight;  // drives straight at a wall that is across its way
        const Vector u = UnitVector(heading), across{-3.0 * u.y, 3.0 * u.x};
        straight.AddWall(u + across, u - across);
        straight.AddRobot(AddShape(outline, 0.2, &straight), 0.0, 0.0, heading);
        straight.Command(0, speed, 0.0, 0.0);
        straight.Steps(steps);
        EXPECT_LE(straight.GapToWall(0, 0), 1e-3);
        EXPECT_GE(straight.GapToWall(0, 0), 1e-5);

        MotionWorld turned;  // moves along x, with any heading
        turned.AddWall({1.0, -9.0}, {1.0, 9.0});
        turned.AddRobot(AddShape(outline, 0.2, &turned), 0.0, 0.0, heading);
        for (int i = 0; i < steps; i++) {
          turned.CommandInWorld(0, speed, 0.0);
          turned.Step();
        }
        EXPECT_LE(turned.GapToWall(0, 0), 1e-3);
        EXPECT_GE(turned.GapToWall(0, 0), 1e-5);
      }
}

/// The least part of the commanded turn that a robot at a wall makes, over 72 headings.
double LeastTurn(Outline outline, double press, double friction) {
  double least = 1e9;
  for (int k = 0; k < 72; k++) {
    MotionWorld world;
    world.AddWall({1.0, -5.0}, {1.0, 5.0}, friction);
    world.AddRobot(AddShape(outline, 0.2, &world), 0.5, 0.0, MotionWorld::Wrap(M_PI * k / 36),
                   friction);
    for (int i = 0; i < 30; i++) {
      world.CommandInWorld(0, 0.4, 0.0);
      world.Step();
    }
    double turned = 0.0;
    for (int i = 0; i < 40; i++) {
      world.CommandInWorld(0, press, 0.0, k % 2 == 1 ? 0.5 : -0.5);
      const double before = world.bodies.heading[0];
      world.Step();
      turned += std::fabs(MotionWorld::Wrap(world.bodies.heading[0] - before));
    }
    EXPECT_GE(world.GapToWall(0, 0), 1e-5);
    least = std::min(least, turned / 2.0);
  }
  return least;
}

TEST(Contacts, DiscsTurnFullyAtAWallInAllHeadings) {
  EXPECT_NEAR(LeastTurn(kDisc, 0.0, 0.0), 1.0, 1e-9);
  EXPECT_NEAR(LeastTurn(kDisc, 0.0, 0.2), 1.0, 1e-9);
  EXPECT_NEAR(LeastTurn(kDisc, 0.2, 0.0), 1.0, 1e-9);
}

TEST(Contacts, FrictionBrakesTheTurnOfAPressedDisc) {
  // Torque of friction over that of the wheels: the turn is 0.5 rad/s less friction * speed / arm.
  EXPECT_NEAR(LeastTurn(kDisc, 0.2, 0.2), 1.0 - 0.2 * 0.2 / (0.2 * 0.5), 0.01);
}

TEST(Contacts, PolygonsTurnAtAWallAndArePushedOffIt) {
  EXPECT_GE(LeastTurn(kSixteenCorners, 0.0, 0.0), 0.99);
  EXPECT_GE(LeastTurn(kSixteenCorners, 0.0, 0.2), 0.99);
  EXPECT_GE(LeastTurn(kSquare, 0.0, 0.0), 0.9);
}

/// The speed along a wall of a robot that is driven into it at 30 degrees with 0.5 m/s, over a
/// joint of two walls.
double SlideSpeed(Outline outline, double friction, double arm) {
  MotionWorld world;
  world.AddWall({-5.0, 0.0}, {1.5, 0.0}, friction);
  world.AddWall({1.5, 0.0}, {9.0, 0.0}, friction);
  world.AddRobot(AddShape(outline, 0.2, &world), 0.0, 0.3, 0.0, friction);
  world.bodies.arm[0] = arm;
  double begin = 0.0;
  for (int i = 0; i < 120; i++) {
    if (i == 20) begin = world.bodies.x[0];
    world.CommandInWorld(0, 0.5 * std::sqrt(0.75), -0.25);
    world.Step();
    EXPECT_GE(std::min(world.GapToWall(0, 0), world.GapToWall(0, 1)), 1e-5);
  }
  return (world.bodies.x[0] - begin) / 10.0;
}

TEST(Contacts, RobotsSlideAtThirtyDegreesWithTheSpeedThatFrictionLeaves) {
  const double free_speed = 0.5 * std::sqrt(0.75);
  for (const Outline outline : {kDisc, kSixteenCorners, kSquare}) {
    EXPECT_NEAR(SlideSpeed(outline, 0.0, 0.2), free_speed, 0.01 * free_speed) << outline;
    EXPECT_NEAR(SlideSpeed(outline, 0.2, 0.2), free_speed - 0.2 * 0.25, 0.01 * free_speed)
        << outline;
  }
}

TEST(Contacts, FrictionOfMoreThanTheTangentOfSixtyDegreesHoldsARobotThatCannotTurn) {
  EXPECT_NEAR(SlideSpeed(kDisc, 1.7, 1e3), 0.5 * (std::sqrt(0.75) - 1.7 * 0.5), 1e-3);
  EXPECT_NEAR(SlideSpeed(kDisc, 1.8, 1e3), 0.0, 1e-6);
}

TEST(Contacts, ADiscSlidesAlongAWallOfManyShortEdges) {
  MotionWorld world;
  std::vector<Vector> corners;
  for (int i = 0; i <= 500; i++) corners.push_back({-1.0 + 0.02 * i, 0.0});
  world.walls.Add(corners, false);
  world.walls.Index();
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.3);
  for (int i = 0; i < 100; i++) {
    world.CommandInWorld(0, 0.5 * std::sqrt(0.75), -0.25);
    world.Step();
  }
  EXPECT_NEAR(world.bodies.x[0], 5.0 * std::sqrt(0.75), 0.01);
}

TEST(Contacts, NothingPassesThroughAThinWallAtAnySpeed) {
  for (int k = 0; k < 400; k++) {
    SCOPED_TRACE(k);
    MotionWorld world;
    world.dt = k % 7 == 0 ? 1.0 : k % 7 == 1 ? 0.001 : 0.1;
    world.AddRoom(-30.0, -30.0, 1.0, 30.0);
    const double speed = 100.0 * k * k / (399.0 * 399.0), radius = k % 11 == 0 ? 0.005 : 0.05;
    const Outline outline = static_cast<Outline>(k % 3);
    world.AddRobot(AddShape(outline, radius, &world), 0.1 + 0.00037 * k, 0.01 * k - 2.0,
                   (k % 40 - 20) * 0.06);
    world.Command(0, speed, 0.0, 0.7 * (k % 5));
    for (int i = 0; i < 30; i++) {
      world.Step();
      const Vector p = world.PositionOf(0);
      ASSERT_TRUE(p.x < 1.0 && p.x > -30.0 && std::fabs(p.y) < 30.0) << p.x << " " << p.y;
      ASSERT_GE(world.LeastGap(), 1e-9);
    }
  }
}

TEST(Contacts, TwoFastRobotsDoNotPassThroughEachOther) {
  for (const double speed : {1.0, 10.0, 100.0}) {
    MotionWorld world;
    const uint32_t disc = world.AddDisc(0.05);
    world.AddRobot(disc, -3.0, 0.0, 0.0);
    world.AddRobot(disc, 3.0, 0.0, M_PI);
    for (int i = 0; i < 100; i++) {
      world.CommandInWorld(0, speed, 0.0);
      world.CommandInWorld(1, -speed, 0.0);
      world.Step();
      ASSERT_LT(world.bodies.x[0], world.bodies.x[1]);
    }
    EXPECT_LE(world.LeastGap(), 1e-3);
  }
}

TEST(Contacts, RobotsDoNotPushEachOther) {
  MotionWorld world;
  const uint32_t disc = world.AddDisc(0.2);
  world.AddRobot(disc, 0.0, 0.0);
  world.AddRobot(disc, 0.6, 0.0);
  world.Command(0, 0.3, 0.0, 0.0);
  world.Steps(30);
  EXPECT_EQ(world.bodies.x[1], 0.6);
  EXPECT_NEAR(world.bodies.x[0], 0.2, 1e-3);
  EXPECT_EQ(world.bodies.made[0], 0.0);
  // It follows one that goes the same way more slowly.
  world.Command(1, 0.1, 0.0, 0.0);
  world.Steps(50);
  EXPECT_NEAR(world.bodies.x[1], 1.1, 1e-9);
  EXPECT_NEAR(world.bodies.x[0], 0.7, 1e-3);
  EXPECT_NEAR(world.bodies.made[0], 1.0 / 3.0, 0.01);
}

TEST(Contacts, WhatIsPressedTogetherStandsStill) {
  for (int k = 0; k < 5; k++) {
    SCOPED_TRACE(k);
    MotionWorld world;
    const double half = k == 4 ? 0.2 : 5.0;  // a wall as wide as the square, so that corners meet
    world.AddWall({1.0, -half}, {1.0, half}, 0.2);
    if (k == 3) world.AddWall({-5.0, 0.5}, {5.0, 0.5}, 0.2);
    const Outline outline = k == 0 ? kDisc : k == 1 ? kSixteenCorners : kSquare;
    const double heading = k == 2 || k == 3 ? 0.5 : 0.0;
    world.AddRobot(AddShape(outline, 0.2, &world), 0.0, 0.0, heading, 0.2);
    world.Command(0, 0.3, 0.0, 0.0);
    world.Steps(150);
    const test::Columns before = world.bodies;
    world.Step();
    EXPECT_EQ(world.bodies.x[0], before.x[0]);
    EXPECT_EQ(world.bodies.y[0], before.y[0]);
    EXPECT_EQ(world.bodies.heading[0], before.heading[0]);
  }
}

TEST(Contacts, BodiesAtDifferentHeightsAndOfTheSameGroupPassEachOther) {
  MotionWorld world;
  const uint32_t low = world.AddPolygon({{-0.2, -0.2}, {0.2, -0.2}, {0.2, 0.2}, {-0.2, 0.2}});
  world.AddRobot(low, 0.0, 0.0);
  world.AddRobot(low, 1.0, 0.0);
  world.bodies.elevation[1] = 1.001;  // begins above the end of the other
  world.AddRobot(low, 2.0, 0.0);
  world.bodies.group[0] = world.bodies.group[2] = 7;
  world.Command(0, 0.5, 0.0, 0.0);
  world.Steps(60);
  EXPECT_NEAR(world.bodies.x[0], 3.0, 1e-9);
  world.bodies.group[2] = 8;
  world.Command(0, -0.5, 0.0, 0.0);
  world.Steps(60);
  EXPECT_NEAR(world.bodies.x[0], 2.4, 1e-3);
}

TEST(Contacts, ContactsTellPointNormalAndWhatTouches) {
  MotionWorld world;
  world.AddWall({1.0, -5.0}, {1.0, 5.0});
  world.AddRobot(world.AddRectangle(0.4, 0.4), 0.5, 0.0);
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.0);
  world.Command(0, 0.3, 0.0, 0.0);
  world.Command(1, 0.3, 0.0, 0.0);
  world.Steps(30);
  const auto contacts = world.contacts.contacts();
  ASSERT_EQ(contacts.size(), 3u);
  EXPECT_FALSE(contacts[0].wall);
  EXPECT_EQ(contacts[0].a, 0u);
  EXPECT_EQ(contacts[0].b, 1u);
  EXPECT_NEAR(contacts[0].normal.x, -1.0, 1e-9);
  EXPECT_NEAR(contacts[0].point.x, 0.6, 1.5e-3);
  EXPECT_NEAR(contacts[0].point.y, 0.0, 1e-9);
  for (size_t i = 1; i < 3; i++) {  // both ends of the side that lies at the wall
    EXPECT_TRUE(contacts[i].wall);
    EXPECT_EQ(contacts[i].a, 0u);
    EXPECT_EQ(contacts[i].b, 0u);
    EXPECT_NEAR(contacts[i].normal.x, 1.0, 1e-9);
    EXPECT_NEAR(contacts[i].point.x, 1.0, 1e-3);
    EXPECT_NEAR(std::fabs(contacts[i].point.y), 0.2, 1e-3);
    EXPECT_NEAR(contacts[i].gap, 2e-4, 2e-4);
  }
}

TEST(Contacts, BodiesThatOverlapAtTheStartCanLeaveAndDoNotOverlapMore) {
  for (const Outline outline : {kDisc, kSixteenCorners, kSquare}) {
    SCOPED_TRACE(outline);
    MotionWorld world;
    world.AddWall({0.3, -9.0}, {0.3, 9.0});
    const uint32_t shape = AddShape(outline, 0.2, &world);
    for (int i = 0; i < 6; i++)
      world.AddRobot(shape, 0.12 * UnitVector(i).x, 0.12 * UnitVector(i).y, 0.3 * i);
    double deepest = world.LeastGap();
    EXPECT_LT(deepest, -0.1);
    for (int step = 0; step < 200; step++) {
      for (size_t i = 0; i < 6; i++) {
        const Vector to = UnitVector(0.5 * M_PI + (static_cast<double>(i) + 0.5) * M_PI / 6.0);
        world.CommandInWorld(i, 0.3 * to.x, 0.3 * to.y, 0.1);
      }
      world.Step();
      const double gap = world.LeastGap();
      EXPECT_GE(gap, deepest - 1e-9);
      deepest = std::min(gap, 1e-5);
    }
    EXPECT_GT(world.LeastGap(), 0.0);
    for (size_t i = 0; i < 6; i++) EXPECT_GT(Length(world.PositionOf(i)), 3.0) << i;
  }
}

TEST(Contacts, TheGapToAWallIsTheSameFarFromTheOrigin) {
  for (const double far : {-2e7, 1e5, 2e7})
    for (const Outline outline : {kDisc, kSquare}) {
      MotionWorld world;
      world.AddWall({far + 1.0, far - 5.0}, {far + 1.0, far + 5.0});
      world.AddRobot(AddShape(outline, 0.2, &world), far + 0.5, far, 0.3);
      for (int i = 0; i < 30; i++) {
        world.CommandInWorld(0, 0.4, 0.1);
        world.Step();
      }
      EXPECT_NEAR(world.GapToWall(0, 0), Stg::motion::kSkin, 1e-6) << far << " " << outline;
    }
}

TEST(Contacts, HeadingsStayWithinHalfATurnWhileATurnIsHindered) {
  MotionWorld world;
  world.AddWall({0.25, -5.0}, {0.25, 5.0});
  std::vector<Vector> tilted;  // stands on a corner when the heading passes half a turn
  for (int i = 0; i < 4; i++) tilted.push_back(0.28 * UnitVector(-0.4 + i * 0.5 * M_PI));
  world.AddRobot(world.AddPolygon(tilted), 0.0, 0.0);
  double turned = 0.0;
  for (int i = 0; i < 300; i++) {
    const double before = world.bodies.heading[0];
    world.CommandInWorld(0, 0.3, 0.0, 1.0);
    world.Step();
    ASSERT_LE(std::fabs(world.bodies.heading[0]), M_PI + 1e-9);
    turned += MotionWorld::Wrap(world.bodies.heading[0] - before);
  }
  EXPECT_GT(turned, 2.0 * M_PI);
}

TEST(Contacts, TheFrictionOfAContactIsTheMeanOfBothBodies) {
  for (const bool mover_first : {false, true})
    for (const double friction : {0.0, 0.4}) {
      MotionWorld world;
      const uint32_t disc = world.AddDisc(0.2), block = world.AddRectangle(9.0, 0.4);
      const auto add_block = [&] { world.AddRobot(block, 3.0, -0.2, 0.0, 0.4 - friction); };
      if (!mover_first) add_block();
      const size_t mover = world.AddRobot(disc, 0.0, 0.3, 0.0, friction);
      if (mover_first) add_block();
      double begin = 0.0;
      for (int i = 0; i < 70; i++) {
        if (i == 20) begin = world.bodies.x[mover];
        world.CommandInWorld(mover, 0.5 * std::sqrt(0.75), -0.25);
        world.Step();
      }
      const double speed = (world.bodies.x[mover] - begin) / 5.0;
      EXPECT_NEAR(speed, 0.5 * std::sqrt(0.75) - 0.2 * 0.25, 0.005) << mover_first << friction;
    }
}

TEST(Contacts, ABodyPassesAboveALowWallAndAWallOfItsOwnGroup) {
  for (const bool low : {false, true}) {
    MotionWorld world;
    const Vector ends[] = {{1.0, -5.0}, {1.0, 5.0}};
    world.walls.Add(ends, false, {0.0, 0.5}, 0.0, low ? Stg::motion::kNoGroup : 7);
    world.walls.Index();
    const size_t robot = world.AddRobot(world.AddRectangle(0.4, 0.4), 0.0, 0.0);
    world.bodies.group[robot] = 7;
    world.bodies.elevation[robot] = low ? 0.6 : 0.0;
    world.Command(robot, 0.5, 0.0, 0.0);
    world.Steps(40);
    EXPECT_NEAR(world.bodies.x[robot], 2.0, 1e-9) << low;
    world.bodies.elevation[robot] = 0.0;
    world.bodies.group[robot] = 8;
    world.Command(robot, -0.5, 0.0, 0.0);
    world.Steps(40);
    EXPECT_NEAR(world.bodies.x[robot], 1.2, 1e-3) << low;
  }
}

TEST(Contacts, ADiscSlidesAroundTheEndOfAWall) {
  MotionWorld world;
  world.AddWall({1.0, 0.0}, {1.0, 5.0});
  world.AddRobot(world.AddDisc(0.2), 0.0, -0.1);
  for (int i = 0; i < 100; i++) {
    world.CommandInWorld(0, 0.3, 0.0);
    world.Step();
  }
  EXPECT_GT(world.bodies.x[0], 2.0);
  EXPECT_NEAR(world.bodies.y[0], -0.2 - Stg::motion::kSkin, 1e-3);
}

TEST(Contacts, ASquareInACornerTouchesBothWallsAllAlong) {
  MotionWorld world;
  world.AddRoom(-3.0, -3.0, 1.0, 1.0);
  world.AddRobot(world.AddRectangle(0.4, 0.4), 0.0, 0.0);
  for (int i = 0; i < 60; i++) {
    world.CommandInWorld(0, 0.3, 0.2);
    world.Step();
  }
  EXPECT_NEAR(world.bodies.x[0], 0.8 - Stg::motion::kSkin, 1e-6);
  EXPECT_NEAR(world.bodies.y[0], 0.8 - Stg::motion::kSkin, 1e-6);
  int right = 0, top = 0;
  for (const test::Contact& contact : world.contacts.contacts())
    (contact.normal.x > 0.5 ? right : top)++;
  EXPECT_EQ(right, 2);
  EXPECT_EQ(top, 2);
  world.CommandInWorld(0, -0.3, 0.1);  // along one of them
  world.Steps(10);
  EXPECT_NEAR(world.bodies.x[0], 0.5 - Stg::motion::kSkin, 1e-6);
}

TEST(Contacts, NormalsPointFromTheLowerRowAndGapsAreThoseOfContacts) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  world.AddRobot(square, 1.0, 0.0);  // stands
  world.AddRobot(square, 0.0, 0.0, 0.02);
  world.bodies.arm[1] = 1e3;  // does not turn, so that one corner touches
  for (int i = 0; i < 30; i++) {
    world.CommandInWorld(1, 0.3, 0.0);
    world.Step();
  }
  const auto contacts = world.contacts.contacts();
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_EQ(contacts[0].a, 0u);
  EXPECT_EQ(contacts[0].b, 1u);
  EXPECT_NEAR(contacts[0].normal.x, -1.0, 0.01);
  EXPECT_LT(contacts[0].gap, Stg::motion::kTouch);
}

TEST(Contacts, ThePartThatIsMadeCountsTurnsAndIsFromZeroToOne) {
  MotionWorld world;
  const Vector slot[] = {{-5.0, 0.21}, {5.0, 0.21}}, other[] = {{-5.0, -0.21}, {5.0, -0.21}};
  world.walls.Add(slot, false);
  world.walls.Add(other, false);
  world.walls.Index();
  const uint32_t bar = world.AddRectangle(0.8, 0.4);
  world.AddRobot(bar, 0.0, 0.0);
  world.Command(0, 0.0, 0.0, 1.0);
  world.Steps(20);
  EXPECT_LT(world.bodies.made[0], 0.01);  // it cannot turn in the slot
  world.Command(0, 0.3, 0.0, 0.0);
  world.Steps(3);
  world.Command(0, 0.0, 0.0, 0.0);
  world.Step();
  EXPECT_EQ(world.bodies.made[0], 1.0);  // nothing was wanted

  MotionWorld pushed;
  const uint32_t disc = pushed.AddDisc(0.2);
  pushed.AddRobot(disc, 0.0, 0.0);
  pushed.AddBox(disc, 0.5, 0.0, 1.0);  // a weak robot that drives against the first
  pushed.Command(0, 0.3, 0.0, 0.0);
  pushed.Command(1, -0.1, 0.0, 0.0);
  pushed.Steps(20);
  EXPECT_GT(pushed.bodies.x[1], 0.6);
  EXPECT_EQ(pushed.bodies.made[1], 0.0);
  pushed.Command(0, -1.0, 0.0, 0.0);
  pushed.Steps(2);
  EXPECT_EQ(pushed.bodies.made[1], 1.0);  // free again
}

TEST(Contacts, NeitherOfTwoRobotsCarriesTheOtherAlongByFriction) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  for (int i = 0; i < 2; i++) {
    world.AddRobot(square, 0.4 * i + 0.001 * i, 0.0, 0.0, 0.5);
    world.bodies.arm[static_cast<size_t>(i)] = 1e3;
  }
  for (int i = 0; i < 10; i++) {
    world.CommandInWorld(0, 0.2, 0.2);
    world.CommandInWorld(1, -0.2, 0.05);
    world.Step();
  }
  EXPECT_LE(world.bodies.y[1], 0.05 + 1e-6);
  EXPECT_GT(world.bodies.y[1], 0.045);
  EXPECT_LT(world.bodies.y[0], 0.19);  // braked
  EXPECT_GT(world.bodies.y[0], world.bodies.y[1]);
}

TEST(Contacts, BodiesThatOverlapArePushedApartSlowly) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  world.AddRobot(square, 0.0, 0.0);
  world.AddBox(square, 0.3, 0.0, 4.0);
  world.Command(0, 0.3, 0.0, 0.0);
  for (int i = 0; i < 20; i++) {
    const double before = world.bodies.x[1];
    world.Step();
    ASSERT_LT(world.bodies.x[1] - before, 0.03 + 2.0 * Stg::motion::kSkin) << "step " << i;
  }
}

TEST(Contacts, RobotsThatMeetFaceToFaceStopAtTheSameGapAsAtAWall) {
  MotionWorld world;
  const uint32_t square = world.AddRectangle(0.4, 0.4);
  world.AddRobot(square, 0.0, 0.0);
  world.AddRobot(square, 1.0, 0.1);
  for (int i = 0; i < 40; i++) {
    world.CommandInWorld(0, 0.2, 0.0);
    world.CommandInWorld(1, -0.3, 0.0);
    world.Step();
  }
  EXPECT_NEAR(world.LeastGap(), Stg::motion::kSkin, 1e-6);
}

TEST(Contacts, ABodyThatIsTooNearIsPushedOffAtOnce) {
  MotionWorld world;
  world.AddWall({-5.0, 0.0}, {5.0, 0.0});
  world.AddRobot(world.AddDisc(0.2), 0.0, 0.2 + 5e-5);
  world.Command(0, 1e-4, 0.0, 0.0);
  world.Step();
  EXPECT_NEAR(world.GapToWall(0, 0), Stg::motion::kSkin, 2e-5);
}

}  // namespace
