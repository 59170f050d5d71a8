// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_LOOKING_HH
#define STAGE_TESTS_LOOKING_HH

#include "support/model_testing.hh"

/// What rays from outside find of models.
namespace Stg {

inline bool Everything(Model* candidate, const Model* finder, const void*) {
  return candidate != finder;
}

/// Where a ray through the whole world stops.
inline RaytraceResult Look(World& world, double x, double y, double z, double heading,
                           double range = 20) {
  return world.Raytrace(Pose(x, y, z, heading), range, Everything, nullptr, nullptr, true);
}

/// What four rays from outside find of model "a", which is alone: its extents in x and y.
inline void ExpectExtent(World& world, double xmin, double xmax, double ymin, double ymax,
                         double z) {
  const double x = (xmin + xmax) / 2, y = (ymin + ymax) / 2;
  EXPECT_NEAR(-10 + Look(world, -10, y, z, 0).range, xmin, 1.01 * kCell);
  EXPECT_NEAR(10 - Look(world, 10, y, z, M_PI).range, xmax, 1.01 * kCell);
  EXPECT_NEAR(-10 + Look(world, x, -10, z, M_PI / 2).range, ymin, 1.01 * kCell);
  EXPECT_NEAR(10 - Look(world, x, 10, z, -M_PI / 2).range, ymax, 1.01 * kCell);
}

inline bool SeenAt(World& world, double z) { return Look(world, -10, 0, z, 0).mod != nullptr; }

}  // namespace Stg

#endif
