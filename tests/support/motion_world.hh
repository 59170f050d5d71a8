// SPDX-License-Identifier: GPL-2.0-or-later
//
// A small world of bodies for tests of libstage/motion, and a check for overlaps that shares no
// code with what it checks.

#ifndef STAGE_TESTS_SUPPORT_MOTION_WORLD_HH
#define STAGE_TESTS_SUPPORT_MOTION_WORLD_HH

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "geometry/trigonometry.hh"
#include "motion/contacts.hh"

namespace test {

using Stg::motion::Columns;
using Stg::motion::Contact;
using Stg::motion::Contacts;
using Stg::motion::Disc;
using Stg::motion::Interval;
using Stg::motion::Polygon;
using Stg::motion::Row;
using Stg::motion::Shape;
using Stg::motion::Shapes;
using Stg::motion::Vector;
using Stg::motion::Walls;

inline Vector UnitVector(double angle) {
  const Stg::SineCosine found = Stg::SinCos(angle);
  return {found.cosine, found.sine};
}

/// A stream of random numbers (splitmix64).
class Numbers {
 public:
  explicit Numbers(uint64_t seed) : state_(seed) {}
  /// From 0 to 1.
  double operator()() {
    uint64_t z = state_ += 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((z ^ (z >> 31)) >> 11) * 0x1p-53;
  }
  double Between(double low, double high) { return low + (high - low) * (*this)(); }

 private:
  uint64_t state_;
};

struct MotionWorld {
  Shapes shapes;
  Walls walls;
  Columns bodies;
  Contacts contacts;
  double dt = 0.1;
  // Commands in the frame of each body.
  std::vector<double> forward, sideways, turn_rate;

  uint32_t AddPolygon(const std::vector<Vector>& corners, Interval height = {}) {
    const Polygon polygon{corners, height};
    return shapes.Add({&polygon, 1}, {});
  }
  uint32_t AddDisc(double radius, Vector center = {}) {
    const Disc disc{center, radius, {}};
    return shapes.Add({}, {&disc, 1});
  }
  uint32_t AddRectangle(double width, double height) {
    const double x = 0.5 * width, y = 0.5 * height;
    return AddPolygon({{-x, -y}, {x, -y}, {x, y}, {-x, y}});
  }
  uint32_t AddRound(int corners, double radius) {
    std::vector<Vector> polygon;
    for (int i = 0; i < corners; i++)
      polygon.push_back(radius * UnitVector(2.0 * M_PI * i / corners));
    return AddPolygon(polygon);
  }
  void AddWall(Vector from, Vector to, double friction = 0.0) {
    const Vector ends[] = {from, to};
    walls.Add(ends, false, {-1e9, 1e9}, friction);
    walls.Index();
  }
  /// Four walls around a rectangle.
  void AddRoom(double x0, double y0, double x1, double y1) {
    const Vector corners[] = {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
    walls.Add(corners, true);
    walls.Index();
  }
  size_t Add(const Row& row) {
    bodies.Add(row, shapes.shapes[row.shape]);
    forward.push_back(0.0);
    sideways.push_back(0.0);
    turn_rate.push_back(0.0);
    return bodies.size() - 1;
  }
  size_t AddRobot(uint32_t shape, double x, double y, double heading = 0.0, double friction = 0.0) {
    Row row;
    row.x = x;
    row.y = y;
    row.heading = heading;
    row.shape = shape;
    row.friction = friction;
    return Add(row);
  }
  size_t AddBox(uint32_t shape, double x, double y, double grip, double friction = 0.0) {
    Row row;
    row.x = x;
    row.y = y;
    row.shape = shape;
    row.friction = friction;
    row.grip = grip;
    row.pushable = true;
    return Add(row);
  }

  void Command(size_t body, double ahead, double left, double turn) {
    forward[body] = ahead;
    sideways[body] = left;
    turn_rate[body] = turn;
  }
  /// Lets a body move in a direction of the world, whatever its heading.
  void CommandInWorld(size_t body, double x, double y, double turn = 0.0) {
    const Vector ahead = UnitVector(bodies.heading[body] + 0.5 * dt * turn);
    Command(body, ahead.x * x + ahead.y * y, ahead.x * y - ahead.y * x, turn);
  }
  /// Lets a robot with differential drive turn to a direction of the world and go there.
  void SteerTo(size_t body, Vector direction, double speed) {
    const Vector ahead = UnitVector(bodies.heading[body]);
    const double length = Stg::motion::Length(direction) + 1e-9;
    const double cosine = Dot(ahead, direction) / length, sine = Cross(ahead, direction) / length;
    const double turn = cosine < 0.0 ? (sine >= 0.0 ? 1.0 : -1.0) : 1.5 * sine;
    Command(body, cosine > 0.0 ? speed * cosine : 0.0, 0.0, Stg::motion::Clamp(turn, -1.0, 1.0));
  }

  Vector PositionOf(size_t body) const { return {bodies.x[body], bodies.y[body]}; }

  /// Targets by the heading halfway, so that a motion back retraces the way.
  void SetTargets() {
    for (size_t i = 0; i < bodies.size(); i++) {
      const double turn = dt * turn_rate[i];
      const Vector ahead = UnitVector(bodies.heading[i] + 0.5 * turn);
      const bool stands = forward[i] == 0.0 && sideways[i] == 0.0;
      bodies.target_x[i] =
          stands ? bodies.x[i] : bodies.x[i] + dt * (ahead.x * forward[i] - ahead.y * sideways[i]);
      bodies.target_y[i] =
          stands ? bodies.y[i] : bodies.y[i] + dt * (ahead.y * forward[i] + ahead.x * sideways[i]);
      bodies.target_heading[i] = turn == 0.0 ? bodies.heading[i] : Wrap(bodies.heading[i] + turn);
      bodies.turn[i] = turn;
    }
  }
  void Step() {
    SetTargets();
    contacts.Step(shapes, walls, &bodies);
  }
  void Steps(int count) {
    for (int i = 0; i < count; i++) Step();
  }

  static double Wrap(double angle) { return std::remainder(angle, 2.0 * M_PI); }

  /// The least gap between outlines of different groups, or of an outline and a wall; negative
  /// where they overlap. Bodies further apart than `far` are skipped.
  double LeastGap(double far = 0.1) const;
  double GapToWall(size_t body, size_t edge) const;
  /// A checksum of all poses.
  uint64_t Hash() const;
};

}  // namespace test

#endif
