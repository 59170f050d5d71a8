// SPDX-License-Identifier: GPL-2.0-or-later
//
// Everything that moves or can be pushed in a world, as columns: row i is body i.
//
// A step writes the targets (where each mover would be if nothing was in its way), calls Contacts,
// and reads the poses. The order of the rows is the only order that results depend on.

#ifndef STAGE_MOTION_COLUMNS_HH
#define STAGE_MOTION_COLUMNS_HH

#include <cstddef>
#include <cstdint>
#include <vector>

#include "motion/shape.hh"

namespace Stg::motion {

/// Bodies and walls of different groups touch each other. Models of the same tree are one group.
constexpr uint32_t kNoGroup = UINT32_MAX;

/// A row, to be added.
struct Row {
  double x = 0.0, y = 0.0, heading = 0.0;  // m, rad
  uint32_t shape = 0;                      // in Shapes
  uint32_t group = kNoGroup;
  bool pushable = false;
  double grip = 10.0;  // see Columns
  double friction = 0.0;
  double arm = 0.0;  // 0: by the shape
  double elevation = 0.0;
};

struct Columns {
  /// See `arm`. Positive even if the shape is empty or a point.
  static double ArmOf(const Shape& shape, bool pushable) {
    constexpr double kLeastArm = 1e-6;
    return Most(kLeastArm, pushable ? shape.arm : shape.bound);
  }
  size_t size() const { return x.size(); }

  /// Gives a body another shape.
  void SetShape(size_t i, uint32_t number, const Shape& its_shape) {
    shape[i] = number;
    arm[i] = ArmOf(its_shape, pushable[i] != 0);
  }

  /// Appends a body that stands. By default, the floor holds a pushable thing evenly over its area,
  /// and a robot by wheels near its outline.
  void Add(const Row& row, const Shape& its_shape) {
    x.push_back(row.x);
    y.push_back(row.y);
    heading.push_back(row.heading);
    target_x.push_back(row.x);
    target_y.push_back(row.y);
    target_heading.push_back(row.heading);
    turn.push_back(0.0);
    shape.push_back(row.shape);
    group.push_back(row.group);
    pushable.push_back(row.pushable);
    grip.push_back(row.grip);
    friction.push_back(row.friction);
    arm.push_back(row.arm > 0.0 ? row.arm : ArmOf(its_shape, row.pushable));
    elevation.push_back(row.elevation);
    made.push_back(1.0);
  }

  // The pose, and after the step the new pose.
  std::vector<double> x, y, heading;
  // The pose at the end of the step if nothing is in the way, and the angle that it turns by, which
  // may exceed a full turn. A body whose target is its pose stands.
  std::vector<double> target_x, target_y, target_heading, turn;
  std::vector<uint32_t> shape, group;
  // Whether other bodies can push it. A body that is not pushable and stands is like a wall.
  std::vector<uint8_t> pushable;
  // The greatest force that the floor exerts on it, in newtons: the friction of a pushed thing
  // (mass
  // * friction * g), the traction of a robot. The limit surface is an ellipsoid whose greatest
  // torque is grip * arm (Goyal, Ruina and Papadopoulos, 1991).
  std::vector<double> grip, arm;
  std::vector<double> friction;   // Coulomb coefficient of its surface
  std::vector<double> elevation;  // m, added to the heights of its pieces
  // The share of the wanted motion that was made in the last step, from 0 to 1: what was missed is
  // measured with turns multiplied by `arm`.
  std::vector<double> made;
};

}  // namespace Stg::motion

#endif
