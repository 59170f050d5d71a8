// SPDX-License-Identifier: GPL-2.0-or-later
#ifndef STAGE_TESTS_LOOKING_HH
#define STAGE_TESTS_LOOKING_HH

#include "support/model_testing.hh"

/// Helpers that find models by rays from outside.
namespace Stg {

inline bool Everything(Model* candidate, const Model* finder, const void*) {
  return candidate != finder;
}

/// Casts a ray that stops at any model.
inline RaytraceResult Look(World& world, double x, double y, double z, double heading,
                           double range = 20) {
  return world.Raytrace(Pose(x, y, z, heading), range, Everything, nullptr, nullptr, true);
}

/// Expects these extents of the only model "a", measured with four rays from outside.
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
